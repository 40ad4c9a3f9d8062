"""Closures with what the equations of motion need of them: gradient, rate and bias.

For φ(q, t): φ̇ = Φ_q v + φ_t, and φ̈ = Φ_q a + (φ_qq v v + 2 φ_qt v + φ_tt).
For ψ(q, v, t), linear in v: ψ̇ = ψ_v a + (ψ_q v + ψ_t). They stand beside
M a = f + Σ λ·gradient (Lagrange's equations of the first kind; Goldstein, Poole
and Safko, Classical Mechanics, 3rd ed., section 2.4).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import sympy as sp

from lagrange_cli.mechanics.calculus import Kinematics, derivative
from lagrange_cli.mechanics.equations import Closure
from lagrange_cli.mechanics.expansion import expand_terms
from lagrange_cli.mechanics.geometry import Restriction
from lagrange_cli.mechanics.grouping import grouped_sum
from lagrange_cli.mechanics.reduction import Reduced
from lagrange_cli.mechanics.terms import TermSum, factored, tidy

__all__ = ["closures"]

#: Terms that a part of a closure may be multiplied out to.
_TERM_BUDGET = 200


def closures(reduced: Reduced) -> tuple[tuple[Closure, ...], tuple[Closure, ...]]:
    """The closures of a scene and the gaps of its one-sided constraints, each in its order."""
    restrictions = (*reduced.closures, *reduced.gaps)
    found = tuple(
        _closure(reduced, restriction, name, symbol)
        for restriction, (name, symbol) in zip(restrictions, _multipliers(reduced), strict=True)
    )
    count = len(reduced.closures)
    return found[:count], found[count:]


def _multipliers(reduced: Reduced) -> Iterator[tuple[str, sp.Symbol]]:
    """Name and multiplier of each closure, then of each gap.

    The names are numbered where a constraint keeps several equations.
    """
    constraints = [r.name for r in (*reduced.closures, *reduced.gaps)]
    scene = reduced.scene
    taken = {*(c.name for c in scene.constraints), *(u.name for u in scene.unilateral)}
    used = {*reduced.names.parameters, *reduced.names.inputs, *reduced.names.cartesian}
    used |= {c.name for c in reduced.coordinates}
    for k, name in enumerate(constraints):
        if constraints.count(name) > 1:
            number = constraints[: k + 1].count(name)
            name = _free(f"{name}_{number}", taken)
            taken.add(name)
        symbol = _free(f"lambda_{name}", used)
        used.add(symbol)
        yield name, sp.Symbol(symbol, real=True)


def _free(name: str, taken: Iterable[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _closure(
    reduced: Reduced, restriction: Restriction, name: str, multiplier: sp.Symbol
) -> Closure:
    expression = tidy(restriction.left - restriction.right)
    position = restriction.kind == "position"
    parts = _of_position(reduced, expression) if position else _of_velocity(reduced, expression)
    gradient, rate, bias = parts
    return Closure(
        name=name,
        kind=restriction.kind,
        expression=expression,
        gradient=gradient,
        rate=rate,
        bias=bias,
        multiplier=multiplier,
        text=restriction.text,
        mark=restriction.mark,
        integral=restriction.integral,
    )


_Parts = tuple[tuple[sp.Expr, ...], sp.Expr, sp.Expr]


def _of_position(reduced: Reduced, phi: sp.Expr) -> _Parts:
    q, v, t = _symbols(reduced)
    gradient = [sp.Integer(0)] * len(q)
    present = phi.free_symbols
    numbers = [j for j, s in enumerate(q) if s in present]
    q, v = [q[j] for j in numbers], [v[j] for j in numbers]
    place = sp.Dummy()
    kinematics = Kinematics({place: phi}, q, v, t)
    for j, row in kinematics.jacobian(place).items():
        gradient[numbers[j]] = factored(_collected(row))
    rate = factored(_collected(_terms(derivative(phi, t))))
    bias = grouped_sum(_collected(kinematics.convective(place)), v)
    return tuple(gradient), rate, bias


def _of_velocity(reduced: Reduced, psi: sp.Expr) -> _Parts:
    q, v, t = _symbols(reduced)
    gradient = tuple(factored(_collected(_terms(derivative(psi, w)))) for w in v)
    at_rest = dict.fromkeys(v, sp.Integer(0))
    rate = psi.xreplace(at_rest)
    change = list(_terms(derivative(psi, t)))
    for s, w in zip(q, v, strict=True):
        change += _terms(derivative(psi, s) * w)
    return gradient, rate, grouped_sum(_collected(change), v)


def _symbols(reduced: Reduced) -> tuple[list[sp.Symbol], list[sp.Symbol], sp.Symbol]:
    coordinates = reduced.coordinates
    return [c.q for c in coordinates], [c.v for c in coordinates], reduced.names.t


def _terms(expr: sp.Expr) -> Sequence[sp.Expr]:
    if expr == 0:
        return ()
    return expand_terms(expr, _TERM_BUDGET) or sp.Add.make_args(expr)


def _collected(terms: Iterable[sp.Expr]) -> list[sp.Expr]:
    total = TermSum()
    total.add_all(e for e in terms if e != 0)
    return total.collected()
