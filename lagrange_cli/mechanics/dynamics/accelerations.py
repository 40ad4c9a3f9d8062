"""Accelerations and multipliers of closures in closed form, for few coupled ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import mpmath
import sympy
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.factor import factored, group_by_velocities
from lagrange_cli.mechanics.algebra.polynomials import expand_terms, has_more_nodes, term_count
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.algebra.shortest import shortest_coefficient
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.numerics.sampling import values_at_points
from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure

# Larger systems are left as M q̈ = f. The budgets are chosen so that a closed form takes a few
# lines of print, since longer ones fill pages; none is tuned.

#: Most accelerations that are coupled by the mass matrix alone.
_LARGEST_SOLVED = 2
#: Most nodes of an inertia or a right-hand side of those; shipped scenes have up to 100.
_MOST_NODES = 1_000
#: Most accelerations and multipliers that closures couple.
_MOST_UNKNOWNS = 8
#: Most terms of a determinant of those.
_MOST_TERMS = 16
#: Terms that a numerator may be multiplied out to for collection.
_MOST_EXPANDED = 60
#: Most operations of an acceleration or multiplier.
_MOST_OPERATIONS = 40

#: Decimal digits carried when a solution is tried at a point, points tried, and agreement.
_DIGITS, _DRAWS, _AGREEMENT = 40, 8, mpf(10) ** -25


@dataclass(frozen=True)
class ExplicitForm:
    """The equations of motion solved as far as closed forms are short.

    Attributes
    ----------
    accelerations
        q̈ over (q, v, t), one for each coordinate, None if it is not solved for. Multipliers of
        contacts may stand in them.
    multipliers
        λ of each closure over the same; None beside accelerations that are not solved for.
    """

    accelerations: tuple[sympy.Expr | None, ...]
    multipliers: tuple[sympy.Expr | None, ...]

    @property
    def coupled(self) -> list[int]:
        """Numbers of the coordinates whose accelerations are not solved for."""
        return [i for i, value in enumerate(self.accelerations) if value is None]


def explicit_form(equations: Equations) -> ExplicitForm:
    """Solve for accelerations and multipliers, block by block of those that are coupled.

    Without closures, at most two accelerations are solved for, from shown equations within a page,
    whose terms are collected as a person would: single ones are divided, pairs follow Cramer's
    rule, collected anew where that is shorter in print, and common factors cancel. With closures,
    the equations and the closures differentiated are solved by Cramer's rule as long as the
    results stay short.

    Raises
    ------
    InternalError
        A solution does not solve the equations: a defect of this module.
    """
    accelerations: list[sympy.Expr | None] = [None] * len(equations.system.coordinates)
    multipliers: list[sympy.Expr | None] = [None] * len(equations.system.closures)
    for block, closures in _coupled_blocks(equations):
        if closures:
            solution = _solved_with_closures(equations, block, closures)
        else:
            solution = _solved(equations, block)
        for i, value in zip(block, solution[: len(block)], strict=True):
            accelerations[i] = value
        for k, value in zip(closures, solution[len(block) :], strict=True):
            multipliers[k] = value
    return ExplicitForm(tuple(accelerations), tuple(multipliers))


def _coupled_blocks(equations: Equations) -> Iterator[tuple[list[int], list[int]]]:
    """Group coordinates whose accelerations are coupled, with the closures that couple them.

    Both are numbers, ascending.
    """
    holders: dict[int, list[int]] = {}
    for k, closure in enumerate(equations.system.closures):
        for i in closure.coordinate_numbers:
            holders.setdefault(i, []).append(k)
    placed: set[int] = set()
    for start in range(len(equations.system.coordinates)):
        if start in placed:
            continue
        block, closures, pending = {start}, set[int](), [start]
        while pending:
            i = pending.pop()
            near = set(entries(equations.system.mass_matrix[i]))
            for k in holders.get(i, ()):
                if k not in closures:
                    closures.add(k)
                    near.update(equations.system.closures[k].coordinate_numbers)
            pending.extend(near - block)
            block |= near
        placed |= block
        yield sorted(block), sorted(closures)


def forcing_with_reactions(equations: Equations) -> list[sympy.Expr]:
    """Right-hand sides f + Σ λ·gradient of M a = f + Σ λ·gradient, one for each coordinate."""
    pairs = zip(equations.system.forcing, multiplier_terms(equations), strict=True)
    return [sympy.Add(forcing, *terms) for forcing, terms in pairs]


def multiplier_terms(equations: Equations) -> list[list[sympy.Expr]]:
    """Terms λ·gradient of closures and contacts, by coordinate."""
    terms: list[list[sympy.Expr]] = [[] for _ in equations.system.coordinates]
    for closure in equations.system.pushing:
        for i, entry in entries(closure.gradient).items():
            terms[i].append(closure.multiplier * entry)
    return terms


def differentiated(equations: Equations, closure: Closure) -> ShownEquation:
    """The closure equation, differentiated until it holds accelerations, as terms."""
    slopes = entries(closure.gradient).items()
    terms = [(slope, equations.system.coordinates[i].a) for i, slope in slopes]
    return ShownEquation(closure.name, (*terms, (closure.bias, sympy.Integer(1))), sympy.Integer(1))


# Blocks without closures.


def _solved(equations: Equations, block: Sequence[int]) -> list[sympy.Expr | None]:
    """Solve for accelerations of a block without closures; None beyond budgets or no inertia."""
    if len(block) > _LARGEST_SOLVED:
        return [None] * len(block)
    mass, forcing = _linear_system(equations, block)
    if any(has_more_nodes(e, _MOST_NODES) for row in (*mass, forcing) for e in row):
        return [None] * len(block)
    if len(block) == 1:
        if mass[0][0] == 0:
            return [None]
        # The terms of a shown equation are collected.
        solution = [sympy.factor_terms(forcing[0]) / sympy.factor_terms(mass[0][0])]
    else:
        letters = _letters(equations)
        determinant = mass[0][0] * mass[1][1] - mass[0][1] * mass[1][0]
        numerators = (
            mass[1][1] * forcing[0] - mass[0][1] * forcing[1],
            mass[0][0] * forcing[1] - mass[1][0] * forcing[0],
        )
        solution = [_quotient(above, determinant, letters) for above in numerators]
    _is_confirmed(solution, [dict(enumerate(row)) for row in mass], forcing)
    return [*solution]


def _linear_system(
    equations: Equations, block: Sequence[int]
) -> tuple[list[list[sympy.Expr]], list[sympy.Expr]]:
    """Coefficients of the block's accelerations and the right-hand sides, as shown."""
    unknowns = [equations.system.coordinates[i].a for i in block]
    mass, forcing = [], []
    for i in block:
        terms = equations.derivation.shown[i].terms
        mass.append([sympy.Add(*(c for c, factor in terms if factor == a)) for a in unknowns])
        forcing.append(-sympy.Add(*(c * factor for c, factor in terms if factor not in unknowns)))
    return mass, forcing


class _Letters(NamedTuple):
    """Velocities in their order, by which terms are grouped, and parameters."""

    velocities: Sequence[sympy.Symbol]
    constants: frozenset[sympy.Symbol]


def _letters(equations: Equations) -> _Letters:
    parameters = frozenset(p.symbol for p in equations.system.parameters)
    return _Letters([c.v for c in equations.system.coordinates], parameters)


def _quotient(numerator: sympy.Expr, denominator: sympy.Expr, letters: _Letters) -> sympy.Expr:
    """Write a quotient of Cramer's rule in the way that is shortest in print."""
    ways = [
        above / shortest_coefficient(below, letters.constants)
        for above in _collected(numerator, letters)
        for below in _collected(denominator, letters)
    ]
    ways += [over for way in ways for over in _over_one(way, letters.constants)]
    return min(ways, key=printed_length)


def _collected(expr: sympy.Expr, letters: _Letters) -> list[sympy.Expr]:
    """List forms of an expression: common factors in front, and multiplied out if that is short."""
    ways = [sympy.factor_terms(expr)]
    terms = expand_terms(expr, _MOST_EXPANDED)
    if terms is not None:
        groups = group_by_velocities(collected_terms(terms), letters.velocities)
        parts = [shortest_coefficient(factored(c), letters.constants) * v for v, c in groups]
        ways.append(factored(parts))
    return ways


def _over_one(quotient: sympy.Expr, constants: frozenset[sympy.Symbol]) -> Iterator[sympy.Expr]:
    """Divide both parts by a term of parameters below: ``g sin α / (1 + I / (m R²))``."""
    above, below = sympy.fraction(quotient)
    for whole in (f for f in sympy.Mul.make_args(below) if f.is_Add):
        if whole.free_symbols <= constants and not whole.atoms(sympy.Function):
            for term in whole.args:
                left = above / term
                if sympy.fraction(left)[1] == 1:
                    inner = sympy.Add(*(summand / term for summand in whole.args))
                    yield left / (below / whole * inner)


# Blocks with closures.

_Row = Mapping[int, sympy.Expr]


def _solved_with_closures(
    equations: Equations, block: Sequence[int], closures: Sequence[int]
) -> list[sympy.Expr | None]:
    """Accelerations of a block, then multipliers of its closures; None of all beyond a budget."""
    unsolved: list[sympy.Expr | None] = [None] * (len(block) + len(closures))
    if len(unsolved) > _MOST_UNKNOWNS:
        return unsolved
    rows, right = _saddle_system(equations, block, closures)
    solution = _by_cramers_rule(rows, right, _letters(equations))
    if solution is None or not _is_confirmed(solution, rows, right):
        return unsolved
    return [*solution]


def _saddle_system(
    equations: Equations, block: Sequence[int], closures: Sequence[int]
) -> tuple[list[_Row], list[sympy.Expr]]:
    """M a − Σ λ·gradient = f and gradient·a = −bias, over accelerations, then multipliers."""
    column = {i: number for number, i in enumerate(block)}
    pushes = [
        (contact.closure.multiplier, entries(contact.closure.gradient))
        for contact in equations.system.contacts
    ]
    rows: list[_Row] = []
    right = []
    for i in block:
        row = {column[j]: entry for j, entry in entries(equations.system.mass_matrix[i]).items()}
        for number, k in enumerate(closures, len(block)):
            slope = entries(equations.system.closures[k].gradient).get(i)
            row |= {} if slope is None else {number: -slope}
        rows.append(row)
        pushed = (multiplier * gradient[i] for multiplier, gradient in pushes if i in gradient)
        right.append(sympy.Add(equations.system.forcing[i], *pushed))
    for k in closures:
        closure = equations.system.closures[k]
        rows.append({column[i]: slope for i, slope in entries(closure.gradient).items()})
        right.append(-closure.bias)
    return rows, right


def _by_cramers_rule(
    rows: Sequence[_Row], right: Sequence[sympy.Expr], letters: _Letters
) -> list[sympy.Expr] | None:
    """Solve a linear system; None where it is singular, or a solution is beyond the budgets."""
    order = sorted(range(len(rows)), key=lambda i: len(rows[i]))
    rows, right = [rows[i] for i in order], [right[i] for i in order]
    determinant = _determinant(rows)
    if determinant == 0:
        return None
    solution = []
    for k in range(len(rows)):
        numerator = _determinant(
            [{**row, k: value} for row, value in zip(rows, right, strict=True)]
        )
        if max(map(term_count, (numerator, determinant))) > _MOST_TERMS:
            return None
        above, below = sympy.fraction(shortened(numerator / determinant))
        solution.append(_quotient(above, below, letters))
        if sympy.count_ops(solution[-1]) > _MOST_OPERATIONS:
            return None
    return solution


def _determinant(rows: Sequence[_Row]) -> sympy.Expr:
    """Laplace's expansion along one row after another, each minor once."""
    minors: dict[tuple[int, ...], sympy.Expr] = {(): sympy.Integer(1)}

    def minor(columns: tuple[int, ...]) -> sympy.Expr:
        """Minor of the trailing rows and the given columns."""
        if columns not in minors:
            row = rows[len(rows) - len(columns)]
            minors[columns] = sympy.Add(
                *(
                    (-1) ** place * row[k] * minor(columns[:place] + columns[place + 1 :])
                    for place, k in enumerate(columns)
                    if row.get(k, 0) != 0
                )
            )
        return minors[columns]

    return minor(tuple(range(len(rows))))


def _is_confirmed(
    solution: Sequence[sympy.Expr], rows: Sequence[_Row], right: Sequence[sympy.Expr]
) -> bool:
    """Tell whether some random point gives real and finite values, and check the solution there.

    Raises
    ------
    InternalError
        The solution does not solve the system there.
    """
    with mpmath.workdps(_DIGITS):
        miss, size = next(_misses(solution, rows, right), (None, mpf(0)))
    if miss is None:
        return False
    if miss > _AGREEMENT * size:
        # A sum of terms that cancel is rounding, which shrinks as digits grow.
        with mpmath.workdps(2 * _DIGITS):
            again, _ = next(_misses(solution, rows, right))
        if again > _AGREEMENT * miss:
            raise InternalError(Problem("the explicit form does not solve the equations"))
    return True


def _misses(
    solution: Sequence[sympy.Expr], rows: Sequence[_Row], right: Sequence[sympy.Expr]
) -> Iterator[tuple[mpf, mpf]]:
    """Yield the largest mismatch of a row at points, and the size of its terms there."""
    expressions = [*solution, *right, *(entry for row in rows for entry in row.values())]
    for numbers in map(iter, values_at_points(expressions, _DRAWS)):
        values = [next(numbers) for _ in solution]
        sides = [next(numbers) for _ in right]
        mismatches = []
        for row, side in zip(rows, sides, strict=True):
            parts = [next(numbers) * values[k] for k in row]
            mismatches.append((abs(sum(parts) - side), sum(map(abs, parts), abs(side))))
        yield max(mismatches, key=lambda both: both[0] / (both[1] or 1))
