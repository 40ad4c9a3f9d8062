"""Forces that are not smooth at an equilibrium: abs, sign, min or max changes its side there."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

if TYPE_CHECKING:
    from lagrange_cli.analysis.rest_system import RestSystem
    from lagrange_cli.analysis.values import Equilibrium, Mpf

_KINKED = (sp.Abs, sp.sign, sp.Min, sp.Max, sp.Heaviside)

#: Digits of the numbers that decide, and the size of one that is zero.
_DIGITS, _NOTHING = 50, mpf(10) ** -12


def kinks_at(system: RestSystem, at: Equilibrium) -> list[tuple[sp.Expr, sp.Expr]]:
    """List the forces with a function that changes its side at an equilibrium, or at rest there.

    Each with that function.
    """
    place = _place(system, at)
    return [
        (force, atom)
        for force in system.equations.forcing
        for atom in force.atoms(*_KINKED)
        if _changes(system, atom, place)
    ]


def has_derivatives(system: RestSystem, at: Equilibrium) -> bool:
    """Tell whether forces and their first derivatives are the same on both sides of all kinks.

    They are of a drag c |v| v; they are not of dry friction.
    """
    place = _place(system, at)
    state = [s for c in system.equations.coordinates for s in (c.q, c.v)]
    for force, atom in kinks_at(system, at):
        first, second = (force.xreplace({atom: side}) for side in _sides(atom))
        difference = sp.Add(first, -second)
        slopes = (derivative(difference, s) for s in state if s in difference.free_symbols)
        try:
            with mpmath.workdps(_DIGITS):
                values = evaluate([difference, *slopes], place)
        except DomainError:
            return False
        if any(abs(x) > _NOTHING for x in values):
            return False
    return True


def _place(system: RestSystem, at: Equilibrium) -> dict[sp.Symbol, Mpf]:
    coordinates = system.equations.coordinates
    place = dict(zip((c.q for c in coordinates), at.position or (), strict=False))
    return place | {c.v: mpf(0) for c in coordinates} | dict(system.known)


def _changes(system: RestSystem, atom: sp.Expr, place: dict[sp.Symbol, Mpf]) -> bool:
    moving = atom.free_symbols - system.known.keys()
    if not any(s in place for s in moving):
        return False
    sides = atom.args if len(atom.args) == 1 else (sp.Add(atom.args[0], -atom.args[1]),)
    with mpmath.workdps(_DIGITS):
        try:
            return any(abs(x) < _NOTHING for x in evaluate(sides, place))
        except DomainError:
            return True


def _sides(atom: sp.Expr) -> Iterator[sp.Expr]:
    """What a function is on either side."""
    first = atom.args[0]
    if isinstance(atom, sp.Abs):
        return iter((first, -first))
    if isinstance(atom, sp.sign):
        return iter((sp.Integer(1), sp.Integer(-1)))
    if isinstance(atom, sp.Heaviside):
        return iter((sp.Integer(1), sp.Integer(0)))
    return iter((first, atom.args[1]))
