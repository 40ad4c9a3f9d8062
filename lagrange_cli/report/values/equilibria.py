"""Equilibria and steady motions as JSON."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

from lagrange_cli.report.values.expressions import (
    CONDITIONS,
    VERDICT,
    coordinate_names,
)
from lagrange_cli.report.values.json_types import (
    BOOLEAN,
    EXPRESSION,
    INTEGER,
    MAYBE_NUMBER,
    NAMES,
    NUMBER,
    TEXT,
    ConvertedType,
    JsonObject,
    Key,
    by_name,
    list_of,
    optional,
    or_null,
    through,
)
from lagrange_cli.report.values.steps import CLOSED_FORM, COMPLETENESS, NamedEquilibrium

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from sympy import Expr

    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.result import Analysis
    from lagrange_cli.analysis.values import (
        AbsentEquilibrium,
        Equilibria,
        Equilibrium,
        Turning,
    )


def _named(names: Sequence[str], values: Iterable[Any] | None) -> dict[str, Any] | None:
    return None if values is None else dict(zip(names, values, strict=True))


def _numbers(names: Sequence[str], values: Iterable[Any] | None) -> dict[str, float | None]:
    """Return numbers in doubles by name, None where they are not known."""
    if values is None:
        return dict.fromkeys(names)
    return dict(zip(names, map(float, values), strict=True))


class _Turning(NamedTuple):
    """Momenta and rates of ignored coordinates, and their names."""

    turning: Turning
    momenta: list[str]
    rates: list[str]


class _Point(NamedTuple):
    """An equilibrium, the names of the coordinates, and what turns in a steady motion."""

    named: NamedEquilibrium
    turning: _Turning | None = None


def _points(value: FoundEquilibria) -> list[_Point]:
    equilibria, steady, names = value
    points = []
    for point in equilibria.points:
        turning = None
        if point.turning is not None and steady is not None:
            momenta = [m.symbol.name for m in steady.momenta]
            rates = [c.v.name for c in steady.ignored]
            turning = _Turning(point.turning, momenta, rates)
        points.append(_Point(at_rest(steady, point, names), turning))
    return points


def at_rest(
    steady: SteadyForm | None, point: Equilibrium, names: Sequence[str]
) -> NamedEquilibrium:
    """Name the coordinates of an equilibrium that rest, without those that are ignored."""
    if steady is None:
        return NamedEquilibrium(point, names)
    position, exact = (
        None if values is None else tuple(values[k] for k in steady.resting)
        for values in (point.position, point.exact)
    )
    ignored = {c.name for c in steady.ignored}
    free = tuple(name for name in point.free if name not in ignored)
    resting = replace(point, position=position, exact=exact, free=free)
    return NamedEquilibrium(resting, [names[k] for k in steady.resting])


AT: Key[NamedEquilibrium] = Key(
    "at",
    by_name(MAYBE_NUMBER),
    "The coordinates that rest there; null if a parameter lacks its value.",
    lambda named: _numbers(named.names, named.point.position),
)
_REST: tuple[Key[_Point], ...] = through(
    lambda point: point.named,
    AT,
    *CLOSED_FORM,
    Key(
        "isolated",
        BOOLEAN,
        "False if it is proven to be part of a continuum, as along free coordinates.",
        lambda named: named.point.isolated and not named.point.free,
    ),
    *through(
        lambda named: named.point.stability,
        Key("stability", or_null(VERDICT), "What is proven of it.", lambda s: s.verdict),
        Key("reason", or_null(TEXT), "The theorem that proves this."),
    ),
    Key(
        "stable_where",
        CONDITIONS,
        "Conditions for the stability of what is undecided for lack of values.",
        lambda named: named.point.stability.stable_where if named.point.stability else (),
    ),
)
_OF_STEADY: tuple[Key[_Point], ...] = through(
    lambda point: point.turning,
    Key(
        "momenta",
        by_name(MAYBE_NUMBER),
        "With --steady: momenta of the ignored coordinates.",
        lambda of_point: _numbers(of_point.momenta, of_point.turning.momenta),
    ),
    Key(
        "exact_momenta",
        or_null(by_name(EXPRESSION)),
        "With --steady: these in closed form, or null.",
        lambda of_point: _named(of_point.momenta, of_point.turning.exact_momenta),
    ),
    Key(
        "rates",
        by_name(MAYBE_NUMBER),
        "With --steady: rates of the ignored coordinates.",
        lambda of_point: _numbers(of_point.rates, of_point.turning.rates),
    ),
    Key(
        "exact_rates",
        or_null(by_name(EXPRESSION)),
        "With --steady: these in closed form, or null.",
        lambda of_point: _named(of_point.rates, of_point.turning.exact_rates),
    ),
)
_EQUILIBRIUM, _STEADY_MOTION = JsonObject(*_REST), JsonObject(*_REST, *_OF_STEADY)
_POINT = ConvertedType(
    JsonObject(*_REST, *optional(*_OF_STEADY)).schema,
    lambda p, say: (_STEADY_MOTION if p.turning else _EQUILIBRIUM).write(p, say),
)
STEADY: JsonObject[SteadyForm] = JsonObject(
    Key(
        "ignored",
        NAMES,
        "Names of the ignored coordinates.",
        lambda form: [c.name for c in form.ignored],
    ),
    Key("momenta", NAMES, "Names of their momenta.", lambda form: [m.name for m in form.momenta]),
    Key(
        "given",
        by_name(MAYBE_NUMBER),
        "The momenta or rates that are given.",
        lambda form: {symbol.name: value for symbol, value in form.given_values},
    ),
)


class _Absent(NamedTuple):
    point: AbsentEquilibrium
    exact: dict[str, Expr]


class FoundEquilibria(NamedTuple):
    """The equilibria of an analysis, and the names of the coordinates."""

    equilibria: Equilibria
    steady: SteadyForm | None
    names: list[str]

    def at_rest(self, values: Sequence[Any]) -> dict[str, Any]:
        """Name the values of the coordinates that rest."""
        numbers = range(len(self.names)) if self.steady is None else self.steady.resting
        return {self.names[k]: values[k] for k in numbers}


def found_equilibria(analysis: Analysis) -> FoundEquilibria | None:
    """Return the equilibria of an analysis, None without any."""
    names = coordinate_names(analysis.rest_equations)
    equilibria = analysis.equilibria
    return None if equilibria is None else FoundEquilibria(equilibria, analysis.steady, names)


_ABSENT: JsonObject[_Absent] = JsonObject(
    Key(
        "exact",
        by_name(EXPRESSION),
        "Its coordinates in closed form.",
    ),
    Key("exists", CONDITIONS, "Conditions to exist.", lambda absent: absent.point.conditions),
)
_SEARCH: tuple[Key[FoundEquilibria], ...] = (
    Key(
        "absent",
        list_of(_ABSENT),
        "Equilibria that exist for other parameters.",
        lambda value: [
            _Absent(point, value.at_rest(point.exact)) for point in value.equilibria.absent
        ],
    ),
    *through(
        lambda value: value.equilibria,
        replace(COMPLETENESS[0], value=lambda e: e.complete and not e.released),
        *COMPLETENESS[1:],
        Key("starts", INTEGER, "Starts of the numeric search, 0 if none was needed."),
        Key(
            "held",
            by_name(NUMBER),
            "Inputs that vary with time and states with two values, with their values here.",
            lambda equilibria: equilibria.held_inputs,
        ),
    ),
    Key(
        "near",
        list_of(by_name(NUMBER)),
        "Configurations near which numbers balance, without a proof.",
        lambda value: [
            {name: float(x) for name, x in value.at_rest(near.position).items()}
            for near in value.equilibria.unproven
        ],
    ),
)
EQUILIBRIA: tuple[Key[FoundEquilibria], ...] = (
    Key(
        "equilibria",
        or_null(list_of(_POINT)),
        "Equilibria, or steady motions.",
        _points,
    ),
    *optional(*_SEARCH),
)
