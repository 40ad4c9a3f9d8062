"""Singular configurations: zeros and poles of the determinant of M.

At the pole of spherical angles the azimuth moves nothing, M loses rank, and no acceleration follows
from it, though nothing happens to the particle. The determinant is computed as a product of pivots
by exact elimination (:mod:`.solve_exactly`), block by block; a factor of a pivot that is proven to
vanish somewhere gives such a place, and so does a divisor of a pivot (the elbow of a square root).
Beyond a few terms nothing is claimed but of three angles that turn a body.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import mpmath
import numpy as np
import sympy as sp

from lagrange_cli.mechanics.algebra.polynomials import factored_form
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.solve_exactly import solve_exactly
from lagrange_cli.mechanics.findings import SingularConfiguration
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.scene.checks.table import name_table
from lagrange_cli.scene.reading.quaternions import by_quaternions, replaced_angles

#: Most coordinates of a block that is examined. This and the budgets below keep the search quick;
#: beyond them nothing is claimed; none is tuned.
_LARGEST_BLOCK = 3
#: Most operations of the entries of such a block.
_ENTRY_BUDGET = 400

#: Most operations of a sum that is factored.
_FACTOR_BUDGET = 60

#: Most coordinates of a system whose momenta are examined.
MOST_COORDINATES = 6

_ZERO = sp.Integer(0)

#: Singular values of M relative to the largest, and parts of its null vectors, that count as zero.
_NOTHING = 1e-9

_Matrix = Sequence[Sequence[sp.Expr]]


def singular_configurations(derivation: Uncertified) -> tuple[SingularConfiguration, ...]:
    """Find the proven singular configurations; none beside closures or gaps.

    Of long chains they are gimbal locks alone.
    """
    if derivation.closures or derivation.reduced.gaps:
        return ()
    places = () if derivation.tree is not None else _zeros_of_pivots(derivation)
    known = {place.where for place in places}
    return (*places, *(lock for lock in _gimbal_locks(derivation) if lock.where not in known))


def _gimbal_locks(derivation: Uncertified) -> Iterator[SingularConfiguration]:
    """Yield where the second of three angles that turn a body makes the axes of the others one.

    M turns no momentum into the difference of their rates there, if it holds these angles by the
    body's axes and angular velocity alone: if a quaternion could replace them.
    """
    reduced = derivation.reduced
    scene = replace(reduced.scene, forces=(), potentials=(), dissipation=(), outputs=())
    form = by_quaternions(scene, name_table(scene))
    symbols = {c.name: c.q for c in reduced.coordinates}
    for angles in () if form is None else replaced_angles(scene, form.scene):
        first, second, third = angles.angles
        is_proper = angles.axes[0] == angles.axes[2]
        where = (sp.sin if is_proper else sp.cos)(symbols[second])
        yield SingularConfiguration((first, third), where)


def _zeros_of_pivots(derivation: Uncertified) -> tuple[SingularConfiguration, ...]:
    """Find zeros and poles of the pivots of M, by exact elimination of small blocks."""
    reduced = derivation.reduced
    coordinates = [c.q for c in reduced.coordinates]
    signed = _with_signs(derivation)
    numbers = {
        signed.get(symbol, symbol): reduced.values.exact[name]
        for name, symbol in reduced.names.parameters.items()
        if name in reduced.values.exact
    }
    zeros: dict[tuple[sp.Expr, bool], dict[str, None]] = {}
    for block in _blocks(derivation):
        mass = [[derivation.mass_matrix[j][k].xreplace(signed) for k in block] for j in block]
        members = [coordinates[j] for j in block]
        if sum(e.count_ops() for row in mass for e in row) > _ENTRY_BUDGET:
            continue
        for factor, infinite in _factors(mass, members):
            if _vanishes(factor, coordinates, numbers):
                lost = _held(factor, members)
                if not infinite:
                    lost = _lost(mass, members, factor, coordinates, numbers)
                zeros.setdefault((factor, infinite), {}).update(dict.fromkeys(q.name for q in lost))
    named = {positive: symbol for symbol, positive in signed.items()}
    return tuple(
        SingularConfiguration(tuple(names), where.xreplace(named), infinite)
        for (where, infinite), names in zeros.items()
    )


def conserved_momenta(derivation: Uncertified) -> tuple[str, ...]:
    """Name coordinates whose momentum is proven conserved and is their rate times an inertia.

    Such a rate keeps its sign unless it is zero, and the inertia does not vanish on the way. No
    coordinate is named where closures act, or in systems of many coordinates.
    """
    coordinates = derivation.reduced.coordinates
    if derivation.closures or derivation.reduced.gaps or len(coordinates) > MOST_COORDINATES:
        return ()
    conserved = []
    for j, (coordinate, row) in enumerate(zip(coordinates, derivation.mass, strict=True)):
        inertia = sp.Add(*row.get(j, ()))
        force = sp.Add(*derivation.forcing[j])
        if set(row) != {j} or inertia.count_ops() + force.count_ops() > _ENTRY_BUDGET:
            continue
        change = inertia.diff(derivation.reduced.names.t)
        change += sp.Add(*(inertia.diff(c.q) * c.v for c in coordinates))
        if sp.expand(force + change * coordinate.v) == 0:
            conserved.append(coordinate.name)
    return tuple(conserved)


def _with_signs(derivation: Uncertified) -> dict[sp.Symbol, sp.Symbol]:
    """Replace parameters with positive values by positive symbols."""
    reduced = derivation.reduced
    return {
        symbol: sp.Symbol(name, positive=True)
        for name, symbol in reduced.names.parameters.items()
        if not symbol.is_positive and reduced.values.exact.get(name, _ZERO).is_positive
    }


def _blocks(derivation: Uncertified) -> Iterator[list[int]]:
    """Yield small groups of coordinates that M couples and whose part of M is not constant."""
    moving = {c.q for c in derivation.reduced.coordinates}
    seen: set[int] = set()
    for first in range(len(derivation.mass)):
        if first in seen:
            continue
        block = [first]
        for j in block:
            block += [k for k in derivation.mass[j] if k not in block]
        seen.update(block)
        terms = [t for j in block for entry in derivation.mass[j].values() for t in entry]
        eligible = len(block) <= _LARGEST_BLOCK and any(t.free_symbols & moving for t in terms)
        if eligible:
            yield sorted(block)


def _factors(mass: _Matrix, members: Sequence[sp.Symbol]) -> Iterator[tuple[sp.Expr, bool]]:
    """Factors of the determinant that hold coordinates, and whether it is divided by them."""
    if len(members) == 1:
        pivots: Sequence[sp.Expr] = [mass[0][0]]
    else:
        solution = solve_exactly(mass, [_ZERO] * len(members), members)
        pivots = solution.pivots if solution is not None else []
    for pivot in pivots:
        for part in sp.Mul.make_args(_product(pivot)):
            base, exponent = part.as_base_exp()
            if base.free_symbols and exponent.is_number:
                yield base, bool(exponent.is_negative)


def _product(pivot: sp.Expr) -> sp.Expr:
    """The pivot as one fraction of products, where it is short."""
    if pivot.count_ops() > _FACTOR_BUDGET:
        return pivot
    whole = sp.together(pivot)
    above, below = sp.fraction(whole)
    return _split(above) / _split(below)


def _split(expr: sp.Expr) -> sp.Expr:
    """A product whose sums are factored, with sin² and cos² of one angle combined."""
    return sp.Mul(*(_factored(part) for part in sp.Mul.make_args(expr)))


def _factored(part: sp.Expr) -> sp.Expr:
    base, exponent = part.as_base_exp()
    if not base.is_Add or not exponent.is_Integer:
        return part
    return factored_form(base) ** exponent


def _held(factor: sp.Expr, members: Sequence[sp.Symbol]) -> list[sp.Symbol]:
    return [q for q in members if q in factor.free_symbols] or list(members)


def _vanishes(
    factor: sp.Expr, coordinates: Sequence[sp.Symbol], numbers: Mapping[sp.Symbol, sp.Expr]
) -> bool:
    """Tell whether a factor is proven to have a zero that real coordinates reach."""
    return any(_zero(factor, q, numbers) is not None for q in coordinates)


def _zero(factor: sp.Expr, q: sp.Symbol, numbers: Mapping[sp.Symbol, sp.Expr]) -> sp.Expr | None:
    """A value of one coordinate at which the factor is zero; None if none is certain."""
    if q not in factor.free_symbols or factor.is_nonzero:
        return None
    if factor.func in (sp.sin, sp.cos):
        return _solved(factor.args[0], q, _ZERO if factor.func is sp.sin else sp.pi / 2)
    waves = [f for f in factor.atoms(sp.sin, sp.cos) if q in f.free_symbols]
    place = sp.Dummy(real=True)
    if len(waves) == 1:
        (wave,) = waves
        level = _root(factor.xreplace({wave: place}), place, q, numbers)
        if level is None or not _at_most_one(level, numbers):
            return None
        inverse = sp.asin if wave.func is sp.sin else sp.acos
        return _solved(wave.args[0], q, inverse(level))
    root = None if waves else _root(factor, q, None, numbers)
    return root if root is None or _is_reached(root, q, numbers) else None


def _is_reached(value: sp.Expr, q: sp.Symbol, numbers: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Tell whether a coordinate can have a value: one that is positive, if it is proven to be."""
    return not q.is_positive or bool(value.is_positive or value.xreplace(dict(numbers)).is_positive)


def _solved(argument: sp.Expr, q: sp.Symbol, value: sp.Expr) -> sp.Expr | None:
    """q where an argument that is linear in it has a value."""
    slope = argument.diff(q)
    if not slope.is_number or slope == 0:
        return None
    return (value - argument.xreplace({q: _ZERO})) / slope


def _root(
    expr: sp.Expr,
    unknown: sp.Symbol,
    barred: sp.Symbol | None,
    numbers: Mapping[sp.Symbol, sp.Expr],
) -> sp.Expr | None:
    """A real root of a polynomial of degree up to two over parameters."""
    if not expr.is_polynomial(unknown) or (barred is not None and barred in expr.free_symbols):
        return None
    coefficients = sp.Poly(expr, unknown).all_coeffs()
    if len(coefficients) == 2:
        slope, constant = coefficients
        return -constant / slope if slope.is_nonzero else None
    if len(coefficients) != 3:
        return None
    a, b, c = coefficients
    discriminant = sp.expand(b**2 - 4 * a * c)
    if not a.is_nonzero or not _is_sign(discriminant, numbers):
        return None
    return (-b + sp.sqrt(discriminant)) / (2 * a)


def _is_sign(expr: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Tell whether an expression over parameters is proven not to be negative."""
    return bool(expr.is_nonnegative or expr.xreplace(dict(numbers)).is_nonnegative)


def _at_most_one(level: sp.Expr, numbers: Mapping[sp.Symbol, sp.Expr]) -> bool:
    return _is_sign(1 - level**2, numbers)


def _lost(
    mass: _Matrix,
    members: Sequence[sp.Symbol],
    factor: sp.Expr,
    coordinates: Sequence[sp.Symbol],
    numbers: Mapping[sp.Symbol, sp.Expr],
) -> list[sp.Symbol]:
    """The coordinates whose rates M does not see where the factor vanishes."""
    if len(members) == 1:
        return list(members)
    for q in coordinates:
        value = _zero(factor, q, numbers)
        if value is not None:
            return [s for s, moved in zip(members, _null(mass, q, value), strict=True) if moved]
    return list(members)


def _null(mass: _Matrix, q: sp.Symbol, value: sp.Expr) -> list[bool]:
    """For each rate, tell whether it moves nothing if coordinate ``q`` has a value.

    All other symbols have irrational values, at which nothing vanishes by chance.
    """
    entries = [e.xreplace({q: value}) for row in mass for e in row]
    symbols = sorted(set().union(*(e.free_symbols for e in entries)), key=str)
    point = {s: mpmath.frac(mpmath.sqrt(2) * k) for k, s in enumerate(symbols, 7)}
    n = len(mass)
    try:
        numbers = np.array([float(x) for x in evaluate(entries, point)]).reshape(n, n)
    except (DomainError, ZeroDivisionError):
        return [True] * n
    _, sizes, directions = np.linalg.svd(numbers)
    null = np.abs(directions[sizes <= _NOTHING * sizes.max()])
    return [bool(x) for x in null.max(axis=0, initial=0.0) > _NOTHING] if len(null) else [True] * n
