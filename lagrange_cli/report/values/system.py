"""The system of a derivation and what is found of it, as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.report.contents.sentences import undecided
from lagrange_cli.report.values.check import PROBLEM
from lagrange_cli.report.values.expressions import (
    CERTIFICATE,
    coordinate_names,
    named_expression,
)
from lagrange_cli.report.values.forces import FORCES, DerivedForces
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    EXPRESSION,
    INTEGER,
    NAMES,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    list_of,
    one_of,
    optional,
    or_null,
    through,
)
from lagrange_cli.report.values.steps import STEPS

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import EnergyBalance, Facts, FormulationChoice
    from lagrange_cli.mechanics.kinks import Switch
    from lagrange_cli.mechanics.system import Closure, Contact, Controller, Input, State
    from lagrange_cli.scene.model import DeclaredFunction


_PREDICTED: JsonObject[FormulationChoice] = JsonObject(
    Key("minimal", INTEGER, "Operations with few coordinates."),
    Key("multiplier", INTEGER, "Operations with constraints beside the coordinates."),
)


class _Singular(NamedTuple):
    coordinate: str
    where: Expr


_SINGULAR: JsonObject[_Singular] = JsonObject(
    Key("coordinate", TEXT, "Name of the coordinate."),
    Key(
        "where",
        ConvertedType(TEXT.schema, lambda zero, say: f"{say(zero)} = 0"),
        "The equation of the places.",
    ),
)
SYSTEM: JsonObject[Equations] = JsonObject(
    Key("name", TEXT, "Name of the scene.", lambda e: e.presentation.name),
    *through(
        lambda equations: equations.derivation.account,
        Key("cartesian", INTEGER, "Number of Cartesian coordinates of the particles."),
        *optional(
            Key(
                "of_bodies",
                INTEGER,
                "Number of coordinates of rigid bodies: 6 each, 3 each in a plane.",
                lambda account: account.of_bodies or None,
            )
        ),
        Key("extra", INTEGER, "Number of coordinates beside them."),
        Key("constraints", INTEGER, "Number of independent constraints."),
        Key("dof", INTEGER, "Number of degrees of freedom."),
        Key("nonholonomic", INTEGER, "Number of velocity constraints that cannot be integrated."),
        Key("unilateral", INTEGER, "Number of one-sided constraints."),
    ),
    Key(
        "coordinates",
        NAMES,
        "Names of the coordinates, with --form routhian of those that are left.",
        coordinate_names,
    ),
    Key(
        "formulation",
        one_of("minimal", "multiplier"),
        "The form; multiplier: constraints stay beside the coordinates.",
        lambda equations: equations.system.formulation,
    ),
    Key(
        "predicted",
        or_null(_PREDICTED),
        "Operations expected of a right-hand side in each formulation; null where there is one.",
        lambda equations: equations.derivation.choice,
    ),
    Key(
        "singular",
        list_of(_SINGULAR),
        "Places at which a coordinate has no meaning.",
        lambda equations: [
            _Singular(name, place.where)
            for place in equations.derivation.singular
            for name in place.coordinates
        ],
    ),
    Key(
        "positive",
        NAMES,
        "Names that the scene declares to stay above zero.",
        lambda equations: [name for name, _ in equations.system.positive],
    ),
    *through(
        lambda equations: equations.system,
        Key("kinetic", EXPRESSION, "The kinetic energy T."),
        Key("potential", EXPRESSION, "The potential V."),
        Key("lagrangian", EXPRESSION, "The Lagrangian L."),
    ),
)

# Findings.


class _Balance(NamedTuple):
    energy: Expr
    balance: EnergyBalance


def _balance(equations: Equations) -> _Balance | None:
    balance = equations.derivation.balance
    return None if balance is None else _Balance(equations.system.energy, balance)


def _forces(equations: Equations) -> DerivedForces | None:
    forces = equations.derivation.constraint_forces
    return None if forces is None else DerivedForces(equations, forces)


_BALANCE: JsonObject[_Balance] = JsonObject(
    Key("name", one_of("energy", "jacobi"), "The energy's name.", lambda value: value.balance.kind),
    Key("expression", EXPRESSION, "The energy.", lambda value: value.energy),
    Key("rate", EXPRESSION, "Its rate.", lambda value: value.balance.rate),
)
_CLOSURE: JsonObject[Closure] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key("kind", one_of("position", "velocity"), "The kind; velocity: it holds velocities."),
    Key("expression", EXPRESSION, "The expression that is zero."),
)


class _Entry(NamedTuple):
    coordinate: str
    entry: Expr


class _NamedContact(NamedTuple):
    contact: Contact
    coordinates: Sequence[str]

    @property
    def gradient(self) -> list[_Entry]:
        slopes = entries(self.contact.closure.gradient).items()
        return [_Entry(self.coordinates[j], slope) for j, slope in slopes]


_ENTRY: JsonObject[_Entry] = JsonObject(
    Key("coordinate", TEXT, "Name of the coordinate."),
    Key("entry", EXPRESSION, "The derivative of the gap by it."),
)
_CONTACT: JsonObject[_NamedContact] = JsonObject(
    Key("name", TEXT, "Name of the one-sided constraint.", lambda named: named.contact.name),
    Key(
        "gap",
        EXPRESSION,
        "The gap, which is at least 0.",
        lambda named: named.contact.closure.expression,
    ),
    Key("gradient", list_of(_ENTRY), "Its derivatives that are not zero."),
    Key(
        "multiplier",
        TEXT,
        "Name of the multiplier, which is 0 while the contact is open.",
        lambda named: named.contact.closure.multiplier.name,
    ),
    Key("restitution", EXPRESSION, "The restitution.", lambda named: named.contact.restitution),
)
_RECORDED = {
    "file": "The file of recorded values.",
    "column": "Its column.",
    "interpolation": "The values between two rows: previous, linear or cubic.",
}
_INPUT: JsonObject[Input] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key(
        "expression",
        or_null(EXPRESSION),
        "Its value over time; null for a recorded one.",
        lambda source: source.expression if source.recording is None else None,
    ),
    *through(
        lambda source: source.recording,
        *(Key(name, TEXT, text, optional=True) for name, text in _RECORDED.items()),
    ),
)
_TABLE: JsonObject[DeclaredFunction] = JsonObject(
    Key("name", TEXT, "Name of the function."),
    Key("of", TEXT, "What it is a function of.", lambda function: function.argument),
    *through(
        lambda function: function.table and function.table.source,
        Key("file", TEXT, "The file of its values."),
        Key("column", TEXT, "Its column."),
    ),
    *through(
        lambda function: function.table,
        Key("interpolation", TEXT, "The values between two rows: monotone, linear or cubic."),
        Key("outside", TEXT, "The values beyond the outermost rows: end, hold or extend."),
    ),
)
_SWITCH: JsonObject[Switch] = JsonObject(
    Key("on", EXPRESSION, "What is not negative where the state becomes 1."),
    Key("off", EXPRESSION, "What is not negative where it becomes 0."),
)
_STATE: JsonObject[State] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key("rate", EXPRESSION, "Its time derivative."),
    Key("switch", _SWITCH, "What changes a state with two values.", optional=True),
    Key("unit", TEXT, "Its unit.", optional=True),
    Key("description", TEXT, "Its description.", optional=True),
)
_FACTS: JsonObject[Facts] = JsonObject(
    Key("constant_mass_matrix", BOOLEAN, "M is constant."),
    Key("diagonal_mass_matrix", BOOLEAN, "M is diagonal."),
    Key("separable", BOOLEAN, "H is T(p) + V(q), without constraints beside the coordinates."),
    Key("autonomous", BOOLEAN, "Nothing depends on t."),
    Key("rheonomic", BOOLEAN, "A position or constraint depends on t."),
    Key("planar", BOOLEAN, "All particles move in parallel planes."),
    Key("positive_definite_mass_matrix", BOOLEAN, "M is positive definite."),
    Key("unused_parameters", NAMES, "Parameters that nothing depends on."),
    Key("separable_on_closures", BOOLEAN, "As separable, but for constraints of positions."),
)
_OUTPUT: JsonObject[tuple[str, Expr]] = JsonObject(
    Key("name", TEXT, "Its name.", lambda pair: pair[0]),
    Key("expression", EXPRESSION, "Its expression.", lambda pair: pair[1]),
)
_CONTROLLER: JsonObject[Controller] = JsonObject(
    Key("name", TEXT, "Its name; empty if it is the only one.", lambda c: c.name),
    Key("every", EXPRESSION, "The time between its samples."),
    Key("hold", list_of(_OUTPUT), "Inputs that it sets.", lambda c: c.held_inputs),
    Key("memory", list_of(_OUTPUT), "States that it sets."),
)
FINDINGS: JsonObject[Equations] = JsonObject(
    Key("cyclic", NAMES, "Cyclic coordinates.", lambda e: e.derivation.cyclic),
    Key(
        "conserved",
        list_of(named_expression("The quantity.")),
        "What is conserved among cyclic momenta and the energy.",
        lambda equations: equations.derivation.conserved,
    ),
    Key(
        "undecided",
        NAMES,
        "Names of those of which this is neither proven nor refuted.",
        undecided,
    ),
    Key(
        "energy_balance",
        or_null(_BALANCE),
        "The energy that is not conserved and its rate; null where it is, or its rate is long.",
        _balance,
    ),
    Key(
        "multipliers",
        NAMES,
        "Names lambda_NAME in the residuals: of closures, then of contacts.",
        lambda equations: [c.multiplier.name for c in equations.system.pushing],
    ),
    Key(
        "closure",
        list_of(_CLOSURE),
        "Constraints that stay beside the coordinates.",
        lambda equations: equations.system.closures,
    ),
    Key(
        "contacts",
        list_of(_CONTACT),
        "One-sided constraints.",
        lambda e: [_NamedContact(contact, coordinate_names(e)) for contact in e.system.contacts],
    ),
    Key(
        "states",
        list_of(_STATE),
        "States of first order with their rates; they are no degrees of freedom.",
        lambda equations: equations.system.states or None,
        optional=True,
    ),
    Key(
        "controllers",
        list_of(_CONTROLLER),
        "Sampled controllers, with the values behind a sample over those before it.",
        lambda equations: equations.system.controllers or None,
        optional=True,
    ),
    Key("inputs", list_of(_INPUT), "Inputs of the scene.", lambda e: e.system.inputs),
    Key(
        "tables",
        list_of(_TABLE),
        "Functions that files give.",
        lambda e: [f for f in e.system.functions if f.table is not None] or None,
        optional=True,
    ),
    Key("outputs", list_of(_OUTPUT), "Outputs of the scene.", lambda e: e.system.outputs),
    Key("facts", _FACTS, "Proven structure; false: not shown.", lambda e: e.derivation.facts),
    *through(_forces, *optional(*FORCES.keys)),
    Key(
        "steps",
        STEPS,
        "With --steps: the steps.",
        lambda equations: None if equations.derivation.steps is None else equations,
        optional=True,
    ),
    Key(
        "certificate",
        CERTIFICATE,
        "The comparison with Newton's law.",
        lambda equations: equations.derivation.certificate,
    ),
    Key(
        "warnings",
        list_of(PROBLEM),
        "Warnings on the scene.",
        lambda equations: equations.derivation.warnings,
    ),
)
