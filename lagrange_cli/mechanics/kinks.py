"""Functions with a kink or a jump, and what each is on either side of its surfaces.

Every room that asks for such functions asks here: their list, the expressions that vanish on
their surfaces, and the same written with ``sign``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy as sp

_HALF = sp.Rational(1, 2)

#: Most rewritten expressions that are kept.
_KEPT = 2**12


class Cases(sp.Function):  # type: ignore[misc]
    """One expression where a condition holds, another where it does not.

    ``Cases(value, side, strict, otherwise)`` is ``value`` where ``side`` is positive, and on its
    zeros too unless ``strict`` is 1; elsewhere it is ``otherwise``.
    """

    nargs = 4
    is_real = True

    @classmethod
    def eval(cls, value: sp.Expr, side: sp.Expr, strict: sp.Expr, otherwise: sp.Expr) -> Any:
        if value == otherwise:
            return value
        if side.is_positive or (strict == 0 and side.is_nonnegative):
            return value
        if side.is_negative or (strict == 1 and side.is_nonpositive):
            return otherwise
        return None

    def _eval_derivative(self, symbol: sp.Symbol) -> sp.Expr:
        value, side, strict, otherwise = self.args
        return Cases(value.diff(symbol), side, strict, otherwise.diff(symbol))


@dataclass(frozen=True)
class Switch:
    """Conditions, ``on`` ≥ 0 and ``off`` ≥ 0, under which a state becomes 1 and 0."""

    on: sp.Expr
    off: sp.Expr

    def until(self, state: sp.Symbol) -> sp.Expr:
        """Return what falls through zero where the state changes, from 1 or from 0."""
        return -state * self.off - (1 - state) * self.on


#: Functions that jump where an argument changes its sign.
JUMPING: tuple[Any, ...] = (sp.sign, sp.Heaviside, Cases)

#: Continuous functions with a kink.
BENT: tuple[Any, ...] = (sp.Abs, sp.Min, sp.Max)

#: Functions with a kink or a jump.
KINKED: tuple[Any, ...] = (*BENT, *JUMPING)

#: Functions that numbers are computed of as sums and products with ``sign``.
STEPS: tuple[Any, ...] = (sp.Heaviside, Cases)


def surfaces_of(kink: sp.Expr) -> Iterator[sp.Expr]:
    """Yield the expressions on whose zeros a function of :data:`KINKED` has a kink or a jump."""
    if isinstance(kink, (sp.Min, sp.Max)):
        first, *others = kink.args
        for argument in others:
            yield first - argument
            first = kink.func(first, argument)
    else:
        yield kink.args[1] if isinstance(kink, Cases) else kink.args[0]


def sides_of(kink: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Return what a function of :data:`KINKED` is above and below its first surface."""
    first = kink.args[0]
    if isinstance(kink, sp.Abs):
        return first, -first
    if isinstance(kink, sp.sign):
        return sp.Integer(1), sp.Integer(-1)
    if isinstance(kink, sp.Heaviside):
        return sp.Integer(1), sp.Integer(0)
    if isinstance(kink, Cases):
        return first, kink.args[3]
    return first, kink.args[1]


@lru_cache(maxsize=_KEPT)
def step_by_signs(step: sp.Expr) -> sp.Expr:
    """Write a function of :data:`STEPS` with ``sign``, with its value on the surface."""
    if isinstance(step, sp.Heaviside):
        return _HALF + _HALF * sp.sign(step.args[0])
    value, side, strict, otherwise = step.args
    # sign(sign x + 1/2) is 1 for x = 0, and sign(sign x − 1/2) is −1.
    above = sp.sign(sp.sign(side) + (-_HALF if strict == 1 else _HALF))
    return _HALF * (1 + above) * value + _HALF * (1 - above) * otherwise


def step_beside_surface(step: sp.Expr) -> sp.Expr:
    """Write a function of :data:`STEPS` with one ``sign``: the same but on the surface."""
    if isinstance(step, sp.Heaviside):
        return step_by_signs(step)
    value, side, _, otherwise = step.args
    above = sp.sign(side)
    return _HALF * (1 + above) * value + _HALF * (1 - above) * otherwise
