"""The parameter that varies, its range, and the parameters that depend on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.configuration import number_of
from lagrange_cli.analysis.values import Mpf
from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.errors import nearest as nearest_name
from lagrange_cli.mechanics.interpretation import interpret
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.phrases import Phrase
from lagrange_cli.scene.language.expression import names_in
from lagrange_cli.scene.language.families import read_expression

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Parameter
    from lagrange_cli.scene.model import Scene

#: Largest magnitude of an end.
_LARGEST = mpf(10) ** 30

#: Width of a range, relative to its ends, below which it is none.
_NARROW = mpf(10) ** -9


@dataclass(frozen=True)
class Varied:
    """A parameter that varies.

    Attributes
    ----------
    parameter
        The parameter.
    low, high
        Its range.
    follows
        Parameters that the scene gives as expressions in it, over it and others.
    """

    parameter: Parameter
    low: Mpf
    high: Mpf
    follows: Mapping[sp.Symbol, sp.Expr]

    def values(self, value: Mpf, known: Mapping[sp.Symbol, Mpf]) -> dict[sp.Symbol, Mpf]:
        """Return the values of this parameter, and of those that follow it.

        Raises
        ------
        DomainError
            One of them has none.
        """
        symbol = self.parameter.symbol
        everything = {**known, symbol: value}
        followed = evaluate([*self.follows.values()], everything) if self.follows else []
        return {symbol: value, **dict(zip(self.follows, followed, strict=True))}


def varied(
    equations: Equations, scene: Scene, name: str, ends: tuple[str, str], option: str
) -> Varied:
    """Read a parameter and its range.

    Parameters
    ----------
    equations, scene
        The equations, and the scene they were derived from.
    name, ends
        The parameter, and texts of both ends; expressions of the scene language.
    option
        Name of the option in messages.

    Raises
    ------
    InputError
        Located: there is no such parameter, nothing depends on it, an end is no number or not one
        that the scene allows, both ends are one.
    """
    shown = f"{name}={ends[0]}..{ends[1]}"
    mark = Mark(option, 1, 1, shown, max(1, len(name)))
    parameter = _parameter(equations, name, mark)
    places = (len(name) + 2, len(name) + len(ends[0]) + 4)
    first, last = (
        _value(equations, text, Mark(option, 1, place, shown, max(1, len(text))))
        for text, place in zip(ends, places, strict=True)
    )
    low, high = min(first, last), max(first, last)
    place = Mark(option, 1, places[0], shown, len(shown) - places[0] + 1)
    if high - low <= _NARROW * max(abs(low), abs(high)):
        message = Phrase("both ends of the range of {name} are one", name=(name,))
        raise InputError(Problem(message, place, rule="analysis-range"))
    if parameter.positive and low <= 0:
        message = Phrase("the scene declares {name} positive", name=(name,))
        raise InputError(Problem(message, place, rule="not-positive"))
    return Varied(parameter, low, high, _followers(equations, scene, parameter))


def _parameter(equations: Equations, name: str, mark: Mark) -> Parameter:
    known = {p.name: p for p in equations.system.parameters}
    sizes = dict(equations.presentation.sizes)
    if name in sizes:
        message = f"'{name}' is a size, which is a whole number and does not vary"
        raise InputError(Problem(message, mark, f"-p {name}={sizes[name] + 1}", "unknown-name"))
    if name not in known:
        kind = _other_kind(equations, name)
        hint = nearest_name(name, known) or f"parameters are {', '.join(sorted(known))}"
        hint = hint if known else "this scene has no parameters"
        raise InputError(Problem(f"'{name}' is {kind}", mark, hint, "unknown-name"))
    if name in equations.derivation.facts.unused_parameters:
        message = f"no equation of motion depends on '{name}'"
        raise InputError(Problem(message, mark, rule="unused"))
    return known[name]


def _other_kind(equations: Equations, name: str) -> str:
    if name in {c.name for c in equations.system.coordinates}:
        return "a coordinate, no parameter"
    if name in {u.name for u in equations.system.inputs}:
        return "an input, no parameter"
    return "no parameter"


def _value(equations: Equations, text: str, place: Mark) -> Mpf:
    value = number_of(equations, interpret(equations, read_expression(text, place)), place)
    if abs(value) > _LARGEST:
        message = f"a range ends at {float(_LARGEST):g} at most"
        raise InputError(Problem(message, place, rule="analysis-range"))
    return value


def _followers(
    equations: Equations, scene: Scene, parameter: Parameter
) -> Mapping[sp.Symbol, sp.Expr]:
    """Find the parameters that the scene gives as expressions in one, also over others."""
    symbols = {p.name: p.symbol for p in equations.system.parameters}
    written = {p.name: p.value for p in scene.parameters if p.value is not None}
    follows: dict[sp.Symbol, sp.Expr] = {}
    while True:
        moving = {parameter.symbol, *follows}
        new = {
            symbols[name]: interpret(equations, value).xreplace(follows)
            for name, value in written.items()
            if name in symbols
            and name != parameter.name
            and symbols[name] not in follows
            and {symbols.get(n.name) for n in names_in(value.node)} & moving
        }
        if not new:
            return follows
        settled = {s: e for s, e in new.items() if not e.free_symbols & new.keys()}
        follows |= settled
