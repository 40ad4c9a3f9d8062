"""Other forms of the equations as JSON, in the scene language."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.analysis.forms.hamiltonian import hamiltonian_form
from lagrange_cli.analysis.forms.routhian import routhian_form
from lagrange_cli.analysis.small_oscillations import small_oscillations
from lagrange_cli.mechanics.dynamics.accelerations import differentiated, explicit_form
from lagrange_cli.mechanics.step_values import spin_symbol
from lagrange_cli.notation.symbols import latex_name
from lagrange_cli.notation.vocabulary import with_symbols
from lagrange_cli.report.contents.derivation.writer import required_euler, with_spins
from lagrange_cli.report.contents.forms.brackets import quantity_names
from lagrange_cli.report.contents.forms.contents import velocity_letter, with_velocities
from lagrange_cli.report.contents.forms.small_oscillations import ModeLetters, with_displacements
from lagrange_cli.report.contents.forms.writer import with_momenta
from lagrange_cli.report.contents.steps.writer import Writer
from lagrange_cli.report.values.expressions import (
    CERTIFICATE,
    COMPLEX,
    MATRIX,
    ROW,
    ROWS,
    SUM,
    VERDICT,
    residuals,
)
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    EXPRESSION,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    or_null,
    through,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr

    from lagrange_cli.analysis.forms.hamiltonian import CanonicalPair, Hamiltonian
    from lagrange_cli.analysis.forms.momenta import Momentum
    from lagrange_cli.analysis.forms.routhian import Routhian
    from lagrange_cli.analysis.small_oscillations import NormalMode, SmallOscillations
    from lagrange_cli.mechanics.equations import Equations, EulerForm, ShownEquation
    from lagrange_cli.mechanics.findings import PoissonBracket, PoissonBrackets
    from lagrange_cli.mechanics.system import Coordinate
    from lagrange_cli.notation.scene_language import ExpressionPrinter


#: Digits of numbers that have no closed form: those of doubles.
_DIGITS = 17

_MAYBE_EXPRESSION = or_null(EXPRESSION)

#: Rates of coordinates are names of velocities, those of velocities expressions.
_RATE_VALUE = ConvertedType(
    _MAYBE_EXPRESSION.schema,
    lambda rate, say: rate if isinstance(rate, str) else _MAYBE_EXPRESSION.write(rate, say),
)


def _pairs(
    coordinates: Sequence[Coordinate], shown: Sequence[ShownEquation]
) -> list[tuple[str, ShownEquation]]:
    return list(zip([c.name for c in coordinates], shown, strict=True))


# Hamilton's equations, and Poisson brackets.

_MOMENTUM: tuple[Key[Momentum], ...] = (
    Key("coordinate", TEXT, "Name of the coordinate.", lambda m: m.coordinate.name),
    Key("momentum", TEXT, "Name of its momentum.", lambda momentum: momentum.name),
    Key("definition", EXPRESSION, "The momentum over velocities.", lambda m: m.expression),
)
_PAIR: JsonObject[CanonicalPair] = JsonObject(
    *through(lambda pair: pair.momentum, *_MOMENTUM),
    Key(
        "velocity",
        _MAYBE_EXPRESSION,
        "Its velocity over momenta; null where these determine velocities as a linear system.",
    ),
    Key("rate", SUM, "The rate of the momentum."),
)
_HAMILTONIAN_FACTS: JsonObject[Hamiltonian] = JsonObject(
    Key(
        "is_energy_sum",
        or_null(BOOLEAN),
        "True if H is T + V; null if not known.",
        lambda h: h.is_sum,
    ),
    Key(
        "conserved",
        BOOLEAN,
        "True if H is found to be conserved.",
        lambda h: h.conserved is not None,
    ),
    Key("certificate", CERTIFICATE, "The comparison with L, M and f."),
)
HAMILTONIAN: JsonObject[Hamiltonian] = JsonObject(
    Key("hamiltonian", SUM, "H over coordinates and momenta.", lambda h: h.parts),
    Key(
        "momenta",
        NAMES,
        "Names of the momenta.",
        lambda h: [pair.momentum.name for pair in h.pairs],
    ),
    Key("canonical", list_of(_PAIR), "The canonical equations.", lambda h: h.pairs),
    Key("hamiltonian_facts", _HAMILTONIAN_FACTS, "Statements on H.", lambda h: h),
)
_BRACKET: JsonObject[PoissonBracket] = JsonObject(
    Key("first", EXPRESSION, "The first function."),
    Key("second", EXPRESSION, "The second function."),
    Key("value", EXPRESSION, "Their bracket."),
    Key("rate", _MAYBE_EXPRESSION, "Rate of the first where the second is H, else null."),
    Key("conserved", or_null(BOOLEAN), "True if that rate is zero; null without it."),
)
BRACKETS: JsonObject[PoissonBrackets] = JsonObject(
    Key("brackets", list_of(_BRACKET), "Poisson brackets of --bracket."),
    Key(
        "quantities",
        by_name(EXPRESSION),
        "The named quantities in them, over coordinates and momenta.",
        lambda brackets: {q.name: q.expression for q in brackets.quantities},
    ),
    Key("bracket_certificate", CERTIFICATE, "Their certificate.", lambda b: b.certificate),
)


def hamiltonian_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return H, the canonical equations and the brackets that were asked for."""
    form, brackets = hamiltonian_form(equations), equations.derivation.brackets
    say = say.knowing(with_momenta(say.words, [pair.momentum for pair in form.pairs]))
    report = HAMILTONIAN.write(form, say)
    if brackets is not None:
        names = [(symbol, name, None) for symbol, name in quantity_names(brackets).items()]
        report |= BRACKETS.write(brackets, say.knowing(with_symbols(say.words, names)))
    return report


# Routh's equations.


class _Recovered(NamedTuple):
    momentum: Momentum
    velocity: Expr
    start: float | None


def _recovered(form: Routhian) -> list[_Recovered]:
    starts = form.start or (None,) * len(form.momenta)
    return list(map(_Recovered, form.momenta, form.velocities, starts))


_RECOVERED: JsonObject[_Recovered] = JsonObject(
    *through(lambda recovered: recovered.momentum, *_MOMENTUM),
    Key("velocity", EXPRESSION, "Its velocity over the momenta."),
    Key("start", MAYBE_NUMBER, "The momentum at the initial state; null if not known."),
)
ROUTHIAN: JsonObject[Routhian] = JsonObject(
    Key(
        "coordinates",
        NAMES,
        "Names of the coordinates, with --form routhian of those that are left.",
        lambda form: [c.name for c in form.coordinates],
    ),
    Key(
        "ignored",
        NAMES,
        "Names of the ignored coordinates.",
        lambda form: [m.coordinate.name for m in form.momenta],
    ),
    Key(
        "momenta",
        NAMES,
        "Names of the momenta.",
        lambda form: [m.name for m in form.momenta],
    ),
    Key("routhian", EXPRESSION, "Routh's function R.", lambda form: form.expression),
    Key("effective_potential", SUM, "The effective potential.", lambda form: form.potential),
    Key("gyroscopic", EXPRESSION, "The part of R that is linear in velocities."),
    Key(
        "equations",
        list_of(residuals("coordinate")),
        "The equation of motion of each coordinate.",
        lambda form: _pairs(form.coordinates, form.shown),
    ),
    Key("mass_matrix", MATRIX, "M in M ddot(q) = f, unscaled."),
    Key("forcing", list_of(EXPRESSION), "The right side f, with multipliers beside it."),
    Key("recovered", list_of(_RECOVERED), "The ignored coordinates.", _recovered),
    Key(
        "routhian_certificate",
        CERTIFICATE,
        "The comparison with L, M and f.",
        lambda form: form.certificate,
    ),
)


def routhian_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return R, V_eff and the equations of the coordinates that are not ignored."""
    form = routhian_form(equations)
    return ROUTHIAN.write(form, say.knowing(with_momenta(say.words, form.momenta)))


# Equations of first order.


class _FirstOrder(NamedTuple):
    """Equations with velocities of their own.

    Attributes
    ----------
    velocities
        Coordinate → name of its velocity.
    accelerations, multipliers
        Name → value, None where it is not solved for.
    coupled
        Equations of those that are not.
    states
        States of first order and their rates.
    """

    velocities: dict[str, str]
    accelerations: dict[str, Expr | None]
    multipliers: dict[str, Expr | None]
    coupled: list[ShownEquation]
    states: Sequence[tuple[str, Expr]]


_RATE: JsonObject[tuple[str, Expr | str | None]] = JsonObject(
    Key("state", TEXT, "Name of a coordinate or velocity.", lambda pair: pair[0]),
    Key("rate", _RATE_VALUE, "Its rate; null if it is not solved for.", lambda pair: pair[1]),
)
_MULTIPLIER: JsonObject[tuple[str, Expr | None]] = JsonObject(
    Key("name", TEXT, "Its name.", lambda pair: pair[0]),
    Key("value", _MAYBE_EXPRESSION, "Its value; null if not solved for.", lambda pair: pair[1]),
)
_FIRST_ORDER: JsonObject[_FirstOrder] = JsonObject(
    Key("velocities", by_name(TEXT), "The velocity of each coordinate."),
    Key(
        "rates",
        list_of(_RATE),
        "Rates of all coordinates, then of all velocities, then of states.",
        lambda form: [
            *form.velocities.items(),
            *((form.velocities[name], rate) for name, rate in form.accelerations.items()),
            *form.states,
        ],
    ),
    Key(
        "multipliers",
        list_of(_MULTIPLIER),
        "The multipliers.",
        lambda form: form.multipliers.items(),
    ),
    Key("coupled", list_of(ROW), "Equations, = 0, of what is not solved for."),
)
FIRST_ORDER: JsonObject[_FirstOrder] = JsonObject(
    Key("first_order", _FIRST_ORDER, "Equations of first order.", lambda form: form)
)


def first_order_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return names of the velocities, and the rate of each state."""
    letter, solved = velocity_letter(equations), explicit_form(equations)
    coordinates, closures = equations.system.coordinates, equations.system.closures
    shown = equations.derivation.shown
    names, multipliers = [c.name for c in coordinates], [c.multiplier.name for c in closures]
    form = _FirstOrder(
        {name: f"{letter}_{name}" for name in names},
        dict(zip(names, solved.accelerations, strict=True)),
        dict(zip(multipliers, solved.multipliers, strict=True)),
        [row for row, rate in zip(shown, solved.accelerations, strict=True) if rate is None]
        + [
            differentiated(equations, closure)
            for closure, value in zip(closures, solved.multipliers, strict=True)
            if value is None
        ],
        [(state.name, state.rate) for state in equations.system.states],
    )
    return FIRST_ORDER.write(form, say.knowing(with_velocities(say.words, equations, letter)))


# Euler's equations.


class _NamedEuler(NamedTuple):
    """Euler's equations with the names of the components of ω, and of the coordinates."""

    form: EulerForm
    spins: Sequence[str]
    coordinates: Sequence[str]


_AXIS: JsonObject[tuple[str, Expr]] = JsonObject(
    Key("spin", TEXT, "The component of the angular velocity.", lambda pair: pair[0]),
    Key("residual", EXPRESSION, "I ω̇ + ω × I ω − M, which equals zero.", lambda pair: pair[1]),
)
_EULER: JsonObject[_NamedEuler] = JsonObject(
    Key("body", TEXT, "The body, along whose axes they are.", lambda named: named.form.body),
    Key(
        "equations",
        list_of(_AXIS),
        "Those of the three axes.",
        lambda named: zip(named.spins, named.form.residuals, strict=True),
    ),
    Key(
        "spins",
        by_name(EXPRESSION),
        "The angular velocity over coordinates and their rates.",
        lambda named: dict(zip(named.spins, named.form.spins, strict=True)),
    ),
    Key(
        "rates",
        by_name(EXPRESSION),
        "The rates of the coordinates that turn the body over its angular velocity.",
        lambda named: dict(
            zip((named.coordinates[k] for k in named.form.numbers), named.form.rates, strict=True)
        ),
    ),
    Key("kinetic", EXPRESSION, "T over the angular velocity.", lambda named: named.form.kinetic),
)
EULER: JsonObject[_NamedEuler] = JsonObject(
    Key("euler", _EULER, "Euler's equations of one body.", lambda named: named)
)


def euler_report(
    equations: Equations, say: ExpressionPrinter, *, is_required: bool
) -> dict[str, Any]:
    """Return Euler's equations; none if there are none and they are not required."""
    form = required_euler(equations) if is_required else equations.derivation.euler
    if form is None:
        return {}
    letter = Writer(equations).spin_letter
    names = [(str(spin_symbol(form.body, axis)), latex_name(f"{letter}_{axis}")) for axis in "123"]
    named = _NamedEuler(
        form, [name for name, _ in names], [c.name for c in equations.system.coordinates]
    )
    return EULER.write(named, say.knowing(with_spins(say.words, form, names)))


# Small oscillations.

_MODE: JsonObject[NormalMode] = JsonObject(
    Key("frequency", NUMBER, "Its angular frequency."),
    Key("square", EXPRESSION, "The square of that, in closed form if there is one."),
    Key("shape", list_of(EXPRESSION), "Amplitudes of the displacements."),
    Key("closed", BOOLEAN, "True if both are in closed form.", lambda mode: mode.is_closed),
)
_SMALL_OSCILLATIONS: JsonObject[SmallOscillations] = JsonObject(
    Key(
        "at",
        by_name(EXPRESSION),
        "The equilibrium, by coordinate.",
        lambda form: zip([c.name for c in form.coordinates], form.rest_values, strict=True),
    ),
    Key(
        "stability",
        or_null(VERDICT),
        "What is proven of its stability.",
        lambda form: form.at.stability and form.at.stability.verdict,
    ),
    Key(
        "displacements",
        NAMES,
        "Names of the displacements.",
        lambda form: [d.name for d in form.displacements],
    ),
    Key("kinetic", SUM, "The quadratic kinetic energy."),
    Key(
        "potential",
        or_null(SUM),
        "The quadratic potential; null where other forces act.",
        lambda form: form.potential or None,
    ),
    Key("M", ROWS, "The mass matrix.", lambda form: form.mass),
    Key("C", ROWS, "The matrix of velocities.", lambda form: form.damping),
    Key("K", ROWS, "The stiffness matrix.", lambda form: form.stiffness),
    Key(
        "equations",
        list_of(residuals("coordinate")),
        "The equation of each displacement.",
        lambda form: _pairs(form.displacements, form.shown),
    ),
    Key("modes", list_of(_MODE), "Normal modes by frequency; none with poles."),
    Key("poles", list_of(COMPLEX), "Exponents s of exp(s t), with damping or gyroscopic terms."),
)
SMALL_OSCILLATIONS: JsonObject[SmallOscillations] = JsonObject(
    Key(
        "small_oscillations",
        _SMALL_OSCILLATIONS,
        "Motions near the nearest stable equilibrium.",
        lambda form: form,
    )
)


def small_oscillations_report(equations: Equations, say: ExpressionPrinter) -> dict[str, Any]:
    """Return quadratic energies, linear equations and normal modes at an equilibrium."""
    form = small_oscillations(equations, _DIGITS)
    words = with_displacements(say.words, form, ModeLetters.of(equations, form))
    return SMALL_OSCILLATIONS.write(form, say.knowing(words))
