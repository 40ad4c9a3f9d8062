"""Velocities over momenta, in closed form: the Legendre transformation of the kinetic energy.

Coordinates are taken in blocks that the mass matrix couples. Within a block L is quadratic in the
velocities, ½ v·M v + b·v, or β √(a − v·G v) + b·v as in the theory of relativity. With w = p − b

    ½ w·M⁻¹ w    and    ∓ √(a (β² + w·G⁻¹ w))

are the parts of H (V. I. Arnold, Mathematical Methods of Classical Mechanics, 2nd ed., section 14).
Inverses are sums of squares, one for each order of elimination, or Cramer's rule; the shortest in
print is taken. Each is counted, and given up where it is long.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import factored, group_by_velocities, grouped_sum, tidy
from lagrange_cli.mechanics.algebra.polynomials import expand_terms, has_more_nodes, term_count
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.algebra.shortest import shortest_coefficient
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

# Budgets: beyond them a closed form is longer than the linear equations that it solves.

#: Most coordinates of a block that is solved in closed form.
_LARGEST_BLOCK = 3
#: Most letters, numbers and functions of a block's part of H, and of one velocity.
_LONGEST = 90
#: Terms that a sum may be multiplied out to.
_TERM_BUDGET = 60
#: Nodes of an entry on the way to an inverse, and terms that it is multiplied out to: beyond them
#: hours pass. Entries of shipped scenes have up to 700 nodes and 50 terms.
_MOST_NODES, _MOST_TERMS = 1_000, 1_000

Rows = Sequence[Mapping[int, sp.Expr]]


@dataclass(frozen=True)
class Momenta:
    """The momenta as functions of the velocities.

    Attributes
    ----------
    expressions
        ∂L/∂q̇ of each coordinate over (q, v, t), as they are printed.
    shifts
        b of each coordinate over (q, t): its momentum at rest.
    """

    expressions: tuple[sp.Expr, ...]
    shifts: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class BlockTransform:
    """A block of coordinates, solved for their velocities.

    Attributes
    ----------
    numbers
        The coordinates of the block, ascending.
    kinetic
        The block's part of H over momenta and q, less L at rest; None without a short form.
    velocities
        v of the block over the same; none without a short form.
    is_quadratic
        True if L is quadratic in the velocities of the block.
    """

    numbers: tuple[int, ...]
    kinetic: sp.Expr | None
    velocities: tuple[sp.Expr, ...]
    is_quadratic: bool


def momenta_of(equations: Equations) -> Momenta:
    """Differentiate L by each velocity."""
    velocities = [c.v for c in equations.system.coordinates]
    known = {
        q.coordinate: q.expression
        for q in equations.derivation.conserved
        if q.coordinate is not None
    }
    holding = terms_by_symbol(equations.system.lagrangian)
    at_rest = dict.fromkeys(velocities, sp.S.Zero)
    expressions, shifts = [], []
    for c in equations.system.coordinates:
        whole = sp.Add(*(derivative(t, c.v) for t in holding.get(c.v, ())))
        expressions.append(known.get(c.name) or collected(whole, velocities))
        shifts.append(collected(whole.xreplace(at_rest), ()))
    return Momenta(tuple(expressions), tuple(shifts))


def terms_by_symbol(expression: sp.Expr) -> dict[sp.Symbol, list[sp.Expr]]:
    """Map each symbol of a sum to the terms that contain it."""
    holding: dict[sp.Symbol, list[sp.Expr]] = {}
    for term in sp.Add.make_args(expression):
        for symbol in symbols_in(term):
            holding.setdefault(symbol, []).append(term)
    return holding


def collected(expression: sp.Expr, rates: Sequence[sp.Symbol]) -> sp.Expr:
    """Gather the terms of a sum by velocities or momenta, within a budget of terms."""
    expanded = expand_terms(expression, _TERM_BUDGET)
    if expanded is None:
        return expression
    terms = collected_terms(expanded)
    if all(symbols_in(t).isdisjoint(rates) for t in terms):
        return factored(terms)
    groups = [factored(c) * rate for rate, c in group_by_velocities(terms, rates)]
    return min(sp.Add(*groups), grouped_sum(terms, rates), key=printed_length)


def coupled_blocks(equations: Equations) -> list[list[int]]:
    """Return groups of coordinates, ascending, whose velocities the mass matrix couples."""
    return blocks_of([entries(row) for row in equations.system.mass_matrix])


def blocks_of(rows: Rows) -> list[list[int]]:
    """Return groups of rows, ascending, that entries of a symmetric matrix couple."""
    placed: set[int] = set()
    blocks = []
    for start in range(len(rows)):
        if start in placed:
            continue
        block, pending = {start}, [start]
        while pending:
            near = set(rows[pending.pop()]) - block
            block |= near
            pending.extend(near)
        placed |= block
        blocks.append(sorted(block))
    return blocks


def transformed(
    equations: Equations, block: Sequence[int], shifted: Sequence[sp.Expr]
) -> BlockTransform:
    """Solve a block for its velocities.

    Parameters
    ----------
    shifted
        w = p − b of the coordinates of the block.
    """
    velocities = [equations.system.coordinates[j].v for j in block]
    number = {j: k for k, j in enumerate(block)}
    rows = [
        {number[k]: entry for k, entry in entries(equations.system.mass_matrix[j]).items()}
        for j in block
    ]
    constants = frozenset(p.symbol for p in equations.system.parameters)
    unsolved = BlockTransform(tuple(block), None, (), True)
    if is_quadratic(equations, block):
        solved = inverse_form(rows, shifted, constants)
        if solved is None:
            return unsolved
        return BlockTransform(tuple(block), solved[0] / 2, solved[1], True)
    root = _root_of(equations, velocities)
    solved = None if root is None else inverse_form(root.matrix, shifted, constants)
    if root is None or solved is None:
        return BlockTransform(tuple(block), None, (), False)
    is_negative = _is_negative(equations, root.weight)
    return _rooted_transform(tuple(block), root, is_negative, *solved)


def is_quadratic(equations: Equations, block: Sequence[int]) -> bool:
    """Tell whether L is a polynomial of degree 2 in the velocities of a block."""
    everything = {c.v for c in equations.system.coordinates}
    rows = [entries(equations.system.mass_matrix[j]).values() for j in block]
    if any(not symbols_in(entry).isdisjoint(everything) for row in rows for entry in row):
        return False
    velocities = {equations.system.coordinates[j].v for j in block}
    return all(
        term.is_polynomial(*sorted(rates, key=str))
        for term in sp.Add.make_args(equations.system.lagrangian)
        if (rates := symbols_in(term) & velocities)
    )


# -- inverses of quadratic forms ------------------------------------------------------


def inverse_form(
    matrix: Rows, w: Sequence[sp.Expr], constants: frozenset[sp.Symbol]
) -> tuple[sp.Expr, tuple[sp.Expr, ...]] | None:
    """Return w·A⁻¹ w and A⁻¹ w for a symmetric matrix A, each in its shortest form.

    None if the block is large, A is singular, or the results are long.
    """
    n = len(matrix)
    if n > _LARGEST_BLOCK:
        return None
    if any(
        has_more_nodes(e, _MOST_NODES) for e in (*w, *(e for row in matrix for e in row.values()))
    ):
        return None
    try:
        ways = [_by_cramers_rule(matrix, w)] if n > 1 else []
        ways += [_by_elimination(matrix, w, order, constants) for order in _orders(matrix)]
    except _LongError:
        return None
    solved = [way for way in ways if way is not None]
    if not solved:
        return None
    form = min((way[0] for way in solved), key=printed_length)
    solution = tuple(min((way[1][k] for way in solved), key=printed_length) for k in range(n))
    if any(printed_length(e) > _LONGEST for e in (form, *solution)):
        return None
    return form, solution


class _LongError(Exception):
    """An entry is beyond the budgets."""


def _multiplied_out(entry: sp.Expr) -> sp.Expr:
    """Multiply an entry out; raises :class:`_LongError` for one beyond the budgets."""
    if has_more_nodes(entry, _MOST_NODES) or term_count(entry) > _MOST_TERMS:
        raise _LongError
    return sp.expand_mul(entry)


def _orders(matrix: Rows) -> list[list[int]]:
    """Return the orders of elimination: by rising and by falling length of the inertia."""
    lengths = [printed_length(row.get(k, sp.S.Zero)) for k, row in enumerate(matrix)]
    first = sorted(range(len(matrix)), key=lambda k: (lengths[k], len(matrix[k]), k))
    return [first, first[::-1]] if len(first) > 1 else [first]


def _by_elimination(
    matrix: Rows, w: Sequence[sp.Expr], order: Sequence[int], constants: frozenset[sp.Symbol]
) -> tuple[sp.Expr, list[sp.Expr]] | None:
    """Compute Σ y²/d by A = L D Lᵀ and y = L⁻¹ w in an order of rows; None if a pivot is 0.

    Raises :class:`_LongError` as :func:`_multiplied_out` does.
    """
    remainder = {(i, j): entry for i, row in enumerate(matrix) for j, entry in row.items()}
    y = [*w]
    pivots: dict[int, sp.Expr] = {}
    slopes: dict[int, dict[int, sp.Expr]] = {}
    for place, k in enumerate(order):
        pivot = remainder.get((k, k), sp.S.Zero)
        if has_more_nodes(pivot, _MOST_NODES):
            raise _LongError
        d = compact(pivot, constants)
        if d == 0:
            return None
        later = [i for i in order[place + 1 :] if remainder.get((i, k), 0) != 0]
        pivots[k], slopes[k] = d, {i: shortened(remainder[i, k] / d) for i in later}
        for i in later:
            y[i] = shortened(y[i] - slopes[k][i] * y[k])
            for j in later:
                entry = remainder.get((i, j), sp.S.Zero) - slopes[k][i] * remainder[k, j]
                remainder[i, j] = shortened(_multiplied_out(entry))
    form = sp.Add(*(_square(y[k], pivots[k]) for k in order))
    solution = [sp.S.Zero] * len(matrix)
    for k in reversed(order):
        taken = (slope * solution[i] for i, slope in slopes[k].items())
        solution[k] = sp.Add(_quotient(y[k], pivots[k]), *(-t for t in taken))
    return form, [min(s, shortened(s), key=printed_length) for s in solution]


def _square(y: sp.Expr, d: sp.Expr) -> sp.Expr:
    """Return y²/d with the sum in y as one factor."""
    scale, product = _one_factor(y)
    return product**2 * (scale**2 / d)


def _quotient(y: sp.Expr, d: sp.Expr) -> sp.Expr:
    scale, product = _one_factor(y)
    return product * (scale / d)


def _one_factor(y: sp.Expr) -> tuple[sp.Expr, sp.Expr]:
    """Split off a scale, so that the sum has no denominators but numbers and roots."""
    above, below = sp.fraction(sp.together(y))
    if all(f.is_Rational or not f.as_base_exp()[1].is_Integer for f in sp.Mul.make_args(below)):
        return sp.S.One, y
    number, product = above.as_coeff_Mul(rational=True)
    return number / below, product


def _by_cramers_rule(matrix: Rows, w: Sequence[sp.Expr]) -> tuple[sp.Expr, list[sp.Expr]] | None:
    """Compute both over the determinant; None if that is 0 or a numerator is long.

    Raises :class:`_LongError` as :func:`_multiplied_out` does.
    """
    n = len(matrix)
    dense = sp.Matrix(n, n, lambda i, j: matrix[i].get(j, 0))
    determinant = shortened(_multiplied_out(dense.det(method="berkowitz")))
    if determinant == 0:
        return None
    adjugate = dense.adjugate(method="berkowitz").applyfunc(lambda e: shortened(_multiplied_out(e)))
    dummies = sp.symbols(f"w0:{n}", real=True, cls=sp.Dummy)
    back = dict(zip(dummies, w, strict=True))

    def over(numerator: sp.Expr) -> sp.Expr | None:
        expanded = expand_terms(numerator, _TERM_BUDGET)
        if expanded is None:
            return None
        quotient = shortened(grouped_sum(collected_terms(expanded), dummies) / determinant)
        above, below = sp.fraction(quotient)
        terms = expand_terms(above, _TERM_BUDGET)
        whole = quotient if terms is None else grouped_sum(collected_terms(terms), dummies) / below
        return whole.xreplace(back)

    vector = sp.Matrix(dummies)
    products = adjugate * vector
    form, solution = over((vector.T * products)[0]), [over(e) for e in products]
    if form is None or any(e is None for e in solution):
        return None
    return form, [e for e in solution if e is not None]


def compact(expression: sp.Expr, constants: frozenset[sp.Symbol]) -> sp.Expr:
    """Return a sum with its common factor in front, in its shortest form."""
    below = sp.S.One
    if any(f.is_Add for t in expression.args for f in sp.Mul.make_args(sp.fraction(t)[1])):
        expression, below = sp.fraction(sp.together(expression))
        terms = expand_terms(expression, _TERM_BUDGET) or [expression]
        expression = sp.Add(*collected_terms(terms))
    whole = factored([*sp.Add.make_args(tidy(expression))])
    return tidy(shortest_coefficient(whole, constants) / sp.factor_terms(below))


# -- roots ---------------------------------------------------------------------------


@dataclass(frozen=True)
class _Root:
    """The part β √(a − v·G v) of L, with G as ``matrix``."""

    weight: sp.Expr
    constant: sp.Expr
    matrix: Rows


def _root_of(equations: Equations, velocities: Sequence[sp.Symbol]) -> _Root | None:
    """Find the root in L that contains the velocities of a block; None if L has another form."""
    terms: list[sp.Expr] = []
    for term in sp.Add.make_args(equations.system.lagrangian):
        if not symbols_in(term).isdisjoint(velocities):
            terms += expand_terms(term, _TERM_BUDGET) or [term]
    curved = [t for t in terms if not t.is_polynomial(*velocities)]
    affine = [t for t in terms if t.is_polynomial(*velocities)]
    roots = {
        f for t in curved for f in sp.Mul.make_args(t) if not symbols_in(f).isdisjoint(velocities)
    }
    if len(roots) != 1 or any(
        derivative(derivative(t, v), u) != 0 for t in affine for v in velocities for u in velocities
    ):
        return None
    (root,) = roots
    base, exponent = root.as_base_exp()
    if exponent != sp.S.Half or not base.is_polynomial(*velocities):
        return None
    at_rest = dict.fromkeys(velocities, sp.S.Zero)
    slopes = [derivative(base, v) for v in velocities]
    rows = [
        {k: e for k, u in enumerate(velocities) if (e := -derivative(slope, u) / 2) != 0}
        for slope in slopes
    ]
    curved_base = any(
        not symbols_in(e).isdisjoint(velocities) for row in rows for e in row.values()
    )
    if curved_base or any(slope.xreplace(at_rest) != 0 for slope in slopes):
        return None
    return _Root(sp.Add(*(t / root for t in curved)), base.xreplace(at_rest), rows)


def _rooted_transform(
    block: tuple[int, ...],
    root: _Root,
    is_negative: bool,
    form: sp.Expr,
    solution: Sequence[sp.Expr],
) -> BlockTransform:
    """Return ∓√(a (β² + w·G⁻¹w)), less its value β√a at rest, and v = ∓a G⁻¹w/√(…)."""
    sign = sp.Integer(1 if is_negative else -1)
    radicand = _expanded(root.constant * (root.weight**2 + form))
    whole = sign * sp.sqrt(radicand)
    velocities = [sign * _expanded(root.constant * s) / sp.sqrt(radicand) for s in solution]
    kinetic = whole + root.weight * sp.sqrt(root.constant)
    return BlockTransform(block, kinetic, tuple(velocities), False)


def _is_negative(equations: Equations, weight: sp.Expr) -> bool:
    """Tell whether β is negative with the scene's parameters."""
    if equations.derivation.sources is None:
        return bool(weight.could_extract_minus_sign())
    (value,) = evaluate([weight], equations.derivation.sources.state)
    return bool(value < 0)


def _expanded(expression: sp.Expr) -> sp.Expr:
    expanded = expand_terms(expression, _TERM_BUDGET)
    return expression if expanded is None else sp.Add(*collected_terms(expanded))


def at_rest(expression: sp.Expr, velocities: Sequence[sp.Symbol]) -> sp.Expr:
    """Set all velocities of an expression to 0."""
    return expression.xreplace(dict.fromkeys(velocities, sp.S.Zero))
