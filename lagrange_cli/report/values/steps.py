"""The steps of a derivation as JSON; expressions are in the scene language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, get_args

from lagrange_cli.analysis.equilibria.laws import laws_of_equilibrium
from lagrange_cli.analysis.equilibria.rest_system import rest_system
from lagrange_cli.mechanics.step_values import SpinAxes, Way
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.scene_language import ExpressionPrinter
from lagrange_cli.report.contents.steps.writer import StepsWriter
from lagrange_cli.report.values.expressions import CONDITIONS, by_symbol, coordinate_names
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    EXPRESSION,
    INTEGER,
    NAMES,
    NUMBER,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    one_of,
    or_null,
    through,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.analysis.values import Equilibrium
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import (
        BodySteps,
        ComponentSteps,
        CoordinateSteps,
        ForceSteps,
        SpinSteps,
        TermSteps,
        TurningSteps,
        VirtualWork,
    )

# Equilibria in closed form.


class NamedEquilibrium(NamedTuple):
    """An equilibrium with the names of the coordinates."""

    point: Equilibrium
    names: Sequence[str]

    @property
    def exact(self) -> dict[str, Expr] | None:
        exact = self.point.exact
        return None if exact is None else dict(zip(self.names, exact, strict=True))


CLOSED_FORM: tuple[Key[NamedEquilibrium], ...] = (
    Key("exact", or_null(by_name(EXPRESSION)), "Its coordinates in closed form, or null."),
    Key("exists", CONDITIONS, "Conditions to exist.", lambda named: named.point.conditions),
    Key("free", NAMES, "Coordinates that have any value there.", lambda n: n.point.free),
)
COMPLETENESS: tuple[Key[Any], ...] = (
    Key("complete", BOOLEAN, "True if it is proven that there are no others."),
    Key(
        "nonzero",
        NAMES,
        "Parameters without a value that are not zero where that is proven.",
    ),
)

# Steps.

_COMPONENT: JsonObject[ComponentSteps] = JsonObject(
    Key("name", TEXT, "The Cartesian name."),
    Key("position", EXPRESSION, "Its value over coordinates and time."),
    Key(
        "partials",
        by_name(EXPRESSION),
        "Its derivatives by coordinates and time that are not zero.",
        lambda component: by_symbol(component.partials),
    ),
    Key("velocity", EXPRESSION, "Its rate."),
    Key("acceleration", EXPRESSION, "The rate of that."),
    Key("force", EXPRESSION, "The applied force along it."),
)
_SPIN: JsonObject[SpinSteps] = JsonObject(
    Key(
        "axis",
        TEXT,
        "1, 2 or 3 along the axes of the body, x, y or z of space; empty in a plane.",
    ),
    Key("spin", EXPRESSION, "The component of the angular velocity."),
    Key(
        "partials",
        by_name(EXPRESSION),
        "Its derivatives by the rates of coordinates, by t what holds none; zero ones left out.",
        lambda component: by_symbol(component.partials),
    ),
    Key("rate", EXPRESSION, "Its rate."),
    Key("inertia", EXPRESSION, "The rate of the angular momentum about the centre of mass."),
    Key("torque", EXPRESSION, "The applied torque."),
)
_TURNING: JsonObject[TurningSteps] = JsonObject(
    Key("axes", one_of(*get_args(SpinAxes)), "The axes of the components."),
    Key(
        "rotation",
        list_of(EXPRESSION),
        "Entries of R by rows, whose columns are the axes of the body.",
        lambda steps: steps.turning.rotation,
    ),
    Key(
        "inertia",
        list_of(EXPRESSION),
        "Entries of the tensor of inertia about the centre of mass, by rows.",
        lambda steps: steps.turning.inertia,
    ),
    Key("components", list_of(_SPIN), "Those of the angular velocity that do not vanish."),
)
_BODY: JsonObject[BodySteps] = JsonObject(
    Key("name", TEXT, "Name of the particle, body or point."),
    Key("mass", or_null(EXPRESSION), "Its mass; null for a point."),
    Key(
        "speed_squared",
        or_null(EXPRESSION),
        "Its squared speed; null for a point or without a short form.",
        lambda body: body.square,
    ),
    Key("components", list_of(_COMPONENT), "Its x, y and z."),
    Key("turning", _TURNING, "Of a rigid body that turns: how.", optional=True),
)
_TERM: JsonObject[TermSteps] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key("written", EXPRESSION, "The term over Cartesian names and their rates."),
    Key("expression", EXPRESSION, "The term over the coordinates.", lambda term: term.resolved),
)
_FORCE: JsonObject[ForceSteps] = JsonObject(
    Key("name", TEXT, "Its name."),
    Key("on", TEXT, "What it acts on."),
    Key("components", by_name(EXPRESSION), "Its components that are not zero."),
    Key(
        "generalized",
        by_name(EXPRESSION),
        "The generalized force on each coordinate that is not zero.",
        lambda force: by_symbol(force.generalized),
    ),
)


class _EquationSteps(NamedTuple):
    """Lagrange's equation of a coordinate, and the factor that is divided out."""

    parts: CoordinateSteps
    coordinate: str
    divided_by: Expr


_EQUATION: JsonObject[_EquationSteps] = JsonObject(
    Key("coordinate", TEXT, "Name of the coordinate."),
    *through(
        lambda steps: steps.parts,
        Key("momentum", EXPRESSION, "∂L/∂q̇."),
        Key("momentum_rate", EXPRESSION, "Its rate."),
        Key("lagrangian_slope", EXPRESSION, "∂L/∂q.", lambda parts: parts.slope),
        Key("dissipation_slope", EXPRESSION, "∂D/∂q̇.", lambda parts: parts.drag),
        Key("residual", EXPRESSION, "The equation before anything is divided out."),
    ),
    Key("divided_by", EXPRESSION, "The factor by which the shown equation is divided."),
)
_BALANCE: JsonObject[VirtualWork] = JsonObject(
    Key(
        "coordinate",
        TEXT,
        "Name of the coordinate, or of the body that turns.",
        lambda parts: parts.displacement.name,
    ),
    Key(
        "axis",
        TEXT,
        "Of a small turn of a body by a quaternion: 1, 2 or 3, the axis of the body.",
        lambda parts: parts.displacement.axis or None,
        optional=True,
    ),
    Key("inertia", EXPRESSION, "Σ m r̈·∂r/∂q."),
    Key("work", EXPRESSION, "Σ F·∂r/∂q, which is subtracted."),
    Key(
        "turning",
        EXPRESSION,
        "Where it is not 0: Σ L̇·∂ω/∂q̇ of rigid bodies, with their angular momenta L.",
        lambda parts: parts.turning or None,
        optional=True,
    ),
    Key(
        "torques",
        EXPRESSION,
        "Where it is not 0: Σ M·∂ω/∂q̇ of torques, which is subtracted.",
        lambda parts: parts.torques or None,
        optional=True,
    ),
    Key(
        "in_coordinates",
        EXPRESSION,
        "What is added for terms that act on no particle.",
        lambda parts: parts.coordinates,
    ),
    Key(
        "residual",
        EXPRESSION,
        "Of a small turn: the sum of these, and of the forces of multipliers, which vanishes.",
        lambda parts: parts.whole if parts.displacement.axis else None,
        optional=True,
    ),
)
_CERTIFICATE: JsonObject[StepsWriter] = JsonObject(
    Key("points", INTEGER, "Number of random states.", lambda writer: writer.steps.states),
    Key(
        "digits",
        INTEGER,
        "Decimal digits of the arithmetic.",
        lambda writer: writer.equations.derivation.certificate.digits,
    ),
    *through(
        lambda writer: writer.steps,
        Key("mismatch", NUMBER, "Largest relative mismatch of a line."),
        Key("difference", NUMBER, "Largest difference between the two ways."),
    ),
)


class _Equilibria(NamedTuple):
    """Equilibria in closed form for all values of the parameters."""

    points: list[NamedEquilibrium]
    complete: bool
    nonzero: tuple[str, ...]


_EQUILIBRIA: JsonObject[_Equilibria] = JsonObject(
    Key("points", list_of(JsonObject(*CLOSED_FORM)), "The equilibria."), *COMPLETENESS
)


def _equilibria(writer: StepsWriter) -> _Equilibria | None:
    """Return the equilibria if the steps lead to these."""
    if writer.steps.of_motion:
        return None
    system = rest_system(writer.equations, {})
    forms = laws_of_equilibrium(system)
    if forms is None:
        return _Equilibria([], False, ())
    names = coordinate_names(system.equations)
    points = [NamedEquilibrium(point, names) for point in forms.points]
    return _Equilibria(points, forms.complete, tuple(forms.nonzero))


def _equations(writer: StepsWriter) -> list[_EquationSteps]:
    pairs = zip(writer.steps.coordinates, writer.equations.derivation.shown, strict=True)
    return [_EquationSteps(parts, shown.coordinate, shown.divided_by) for parts, shown in pairs]


_STEPS: JsonObject[StepsWriter] = JsonObject(
    *through(
        lambda writer: writer.steps,
        Key("by", one_of(*get_args(Way)), "The way.", lambda steps: steps.way),
        Key("bodies", list_of(_BODY), "Positions and their rates."),
        Key("kinetic", list_of(_TERM), "Kinetic terms of the scene."),
        Key("potentials", list_of(_TERM), "Potentials of the scene."),
        Key("forces", list_of(_FORCE), "Forces of the scene."),
    ),
    Key("coordinates", list_of(_EQUATION), "Lagrange's equations part by part.", _equations),
    Key(
        "virtual_work",
        list_of(_BALANCE),
        "Parts of the coefficients of δq by d'Alembert or virtual work, else none.",
        lambda writer: writer.steps.balances,
    ),
    Key(
        "equilibrium",
        _EQUILIBRIA,
        "With --by virtual-work: the equilibria for all values of the parameters.",
        _equilibria,
        optional=True,
    ),
    Key("certificate", _CERTIFICATE, "The comparison of all lines.", lambda writer: writer),
)


def _written(equations: Equations, _: ExpressionPrinter) -> dict[str, Any]:
    """Write steps in the scene language, whatever the language of the report."""
    assert equations.derivation.steps is not None
    steps = equations.derivation.steps.over_parameters()
    writer = StepsWriter(equations, steps=steps, read_back=True)
    return _STEPS.write(writer, ExpressionPrinter(writer.words, ScenePrinter()))


#: The steps of equations that have some.
STEPS = ConvertedType(_STEPS.schema, _written)
