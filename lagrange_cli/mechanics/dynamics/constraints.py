"""Gradients, rates and biases of closures, as the equations of motion need them.

For φ(q, t): φ̇ = Φ_q v + φ_t, and φ̈ = Φ_q a + (φ_qq v v + 2 φ_qt v + φ_tt).
For ψ(q, v, t), linear in v: ψ̇ = ψ_v a + (ψ_q v + ψ_t). They stand beside
M a = f + Σ λ·gradient (Lagrange's equations of the first kind; Goldstein, Poole
and Safko, Classical Mechanics, 3rd ed., section 2.4).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import sympy as sp

from lagrange_cli.mechanics.algebra.alpha_equivalence import ShapeClasses
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import POSITION_TERMS, Kinematics, derivative
from lagrange_cli.mechanics.algebra.factor import factored, grouped_sum, tidy
from lagrange_cli.mechanics.algebra.polynomials import expand_terms, term_count
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.mechanics.system import Closure, tagged
from lagrange_cli.scene.bodies import bodies_of

#: Terms that a part of a closure may be multiplied out to.
_TERM_BUDGET = 200

#: Terms of the longest closure of bodies in space that is multiplied out, as of their positions: a
#: loop of six hinges has hundreds, which share the axes of the frames that they are made of.
_LOOP_TERMS = 25


def closures(reduced: Reduced) -> tuple[tuple[Closure, ...], tuple[Closure, ...]]:
    """Derive the closures of a scene and the gaps of its one-sided constraints, in their order."""
    equations = (*reduced.closures, *reduced.gaps)
    works = {"position": _of_position, "velocity": _of_velocity}
    families = {
        kind: ShapeClasses(reduced.coordinates, partial(w, reduced)) for kind, w in works.items()
    }
    derived = tuple(
        _closure(equation, name, symbol, families[equation.kind])
        for equation, (name, symbol) in zip(equations, _multipliers(reduced), strict=True)
    )
    count = len(reduced.closures)
    return derived[:count], derived[count:]


def _multipliers(reduced: Reduced) -> Iterator[tuple[str, sp.Symbol]]:
    """Name and multiplier of each closure, then of each gap.

    The names are numbered where a constraint keeps several equations.
    """
    constraints = [r.name for r in (*reduced.closures, *reduced.gaps)]
    scene = reduced.scene
    taken = {*(c.name for c in scene.constraints), *(u.name for u in scene.unilateral)}
    used = {*reduced.names.parameters, *reduced.names.external, *reduced.names.cartesian}
    used |= {c.name for c in reduced.coordinates}
    used |= {d.name for d in scene.definitions} | {output.name for output in scene.outputs}
    several, so_far = Counter(constraints), Counter[str]()
    for name in constraints:
        so_far[name] += 1
        if several[name] > 1:
            name = _free(tagged(name, f"_{so_far[name]}"), taken)
            taken.add(name)
        symbol = _free(f"lambda_{name}", used)
        used.add(symbol)
        yield name, sp.Symbol(symbol, real=True)


def _free(name: str, taken: Iterable[str]) -> str:
    while name in taken:
        name = tagged(name, "_")
    return name


@dataclass(frozen=True)
class _Parts:
    """A closure's expression and its derivatives, as in :class:`Closure`.

    Attributes
    ----------
    expression
        φ or ψ.
    gradient
        Number of a coordinate → entry.
    rate, bias
        Parts of the derivatives without the highest rates.
    """

    expression: sp.Expr
    gradient: Mapping[int, sp.Expr]
    rate: sp.Expr
    bias: sp.Expr


def _closure(
    equation: ClosureEquation, name: str, multiplier: sp.Symbol, families: ShapeClasses[_Parts]
) -> Closure:
    member = families.instance(equation.left - equation.right)
    parts = member.result
    numbers = dict(zip(sorted(parts.gradient), member.numbers, strict=True))
    gradient = {numbers[j]: member.renamed(entry) for j, entry in parts.gradient.items()}
    return Closure(
        name=name,
        constraint=equation.name,
        kind=equation.kind,
        expression=member.renamed(parts.expression),
        gradient=ExpressionRow(families.width, gradient),
        rate=member.renamed(parts.rate),
        bias=member.renamed(parts.bias),
        multiplier=multiplier,
        text=equation.text,
        mark=equation.mark,
        integral=equation.integral,
    )


def _of_position(reduced: Reduced, stated: sp.Expr) -> _Parts:
    stays = _is_long_loop(reduced, stated)
    phi = stated if stays else reduced.drawn(tidy(stated))
    numbers = _held(reduced, stated)
    coordinates = [reduced.coordinates[j] for j in numbers]
    q, v, t = [c.q for c in coordinates], [c.v for c in coordinates], reduced.names.t
    place = sp.Dummy()
    kinematics = Kinematics({place: phi}, q, v, t, 1 if stays else POSITION_TERMS)
    rows = kinematics.jacobian(place)
    gradient = {j: factored(collected_terms(rows.get(k, ()))) for k, j in enumerate(numbers)}
    rate = factored(collected_terms(_terms(derivative(phi, t))))
    bias = grouped_sum(collected_terms(kinematics.convective(place)), v)
    return _Parts(phi, gradient, rate, bias)


def _is_long_loop(reduced: Reduced, stated: sp.Expr) -> bool:
    """Tell whether an equation is of bodies in space, and stays as their frames compose it."""
    in_space = any(not body.planar for body in bodies_of(reduced.scene))
    return in_space and term_count(stated) > _LOOP_TERMS


def _of_velocity(reduced: Reduced, stated: sp.Expr) -> _Parts:
    stays = _is_long_loop(reduced, stated)
    psi, t = stated if stays else tidy(stated), reduced.names.t
    budget = 1 if stays else _TERM_BUDGET
    numbers = _held(reduced, stated)
    coordinates = [reduced.coordinates[j] for j in numbers]
    v = [c.v for c in coordinates]
    slopes = ((j, derivative(psi, w)) for j, w in zip(numbers, v, strict=True))
    gradient = {j: factored(collected_terms(_terms(slope, budget))) for j, slope in slopes}
    rate = psi.xreplace(dict.fromkeys(v, sp.Integer(0)))
    change = list(_terms(derivative(psi, t), budget))
    for c in coordinates:
        change += _terms(derivative(psi, c.q) * c.v, budget)
    return _Parts(psi, gradient, rate, grouped_sum(collected_terms(change), v))


def _held(reduced: Reduced, stated: sp.Expr) -> list[int]:
    """Numbers of the coordinates that an equation holds, or the rates of."""
    present = stated.free_symbols
    return [j for j, c in enumerate(reduced.coordinates) if c.q in present or c.v in present]


def _terms(expr: sp.Expr, budget: int = _TERM_BUDGET) -> Sequence[sp.Expr]:
    if expr == 0:
        return ()
    return expand_terms(expr, budget) or sp.Add.make_args(expr)
