"""Linear systems at an equilibrium, reduced to independent coordinates.

With M q̈ = f + Gᵀλ and closures G q̇ = 0, a small motion q = q* + Z x obeys

    ZᵀM Z ẍ + ZᵀC Z ẋ + ZᵀK Z x = ZᵀB u,   C = −∂f/∂q̇,   K = −∂(f + Gᵀλ)/∂q

where the columns of Z span the null space of the gradients; that multipliers are kept while
gradients turn is how the second derivatives of closures enter K. Derivatives are exact ones of the
value graph.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_system import has_derivatives
from lagrange_cli.analysis.interval_values import around, ends
from lagrange_cli.analysis.linear.first_order import FirstOrder
from lagrange_cli.analysis.linear.second_order import LinearSystem
from lagrange_cli.analysis.values import DIGITS, Equilibrium, ExactMatrices, Matrix, Mpf, StateSpace
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import cancelled, factored_form
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.phrases import Phrase

if TYPE_CHECKING:
    from lagrange_cli.analysis.equilibria.rest_system import RestSystem


#: Size of a pivot, relative to its row, below which a gradient depends on others: far above the
#: rounding of 50 digits, far below coefficients that scenes have.
_DEPENDENT = mpf(10) ** -12

#: Inertia, and its part of others, that is none.
_WITHOUT_INERTIA = mpf(10) ** -25

#: Least uncertainty of an equilibrium.
_LAST_DIGITS = mpf(10) ** -48

#: Largest entry, and inverse of the least inertia, of which squares and products are doubles.
_LARGEST = 1e150

#: Part of its terms below which a sum is rounding.
_ROUNDING = mpf(10) ** -30

# The budget of closed forms: beyond it matrices are longer than a reader compares.

#: Coordinates of M, C, K, and of A and B, which hold the inverse of M.
_MATRICES, _STATE_SPACE = 10, 3
#: Operations of the forcing, and of an entry.
_OPERATIONS, _LONGEST = 1_500, 60
#: Operations of an entry at the equilibrium, before it is simplified.
_PLACED = 300

_Rows = tuple[tuple[sp.Expr, ...], ...]


def linear_system(system: RestSystem, at: Equilibrium) -> LinearSystem:
    """Linearize the equations of motion at an equilibrium.

    Raises
    ------
    InputError
        They have no derivatives there, or the coordinates or the constraints are singular.
    """
    position, multipliers = _numbers(system, at)
    if not has_derivatives(system, at):
        message = Phrase("the forces are not smooth there")
        raise InputError(Problem(message, rule="analysis-singular"))
    functions = system.functions
    n, m = functions.n, functions.m
    inputs = functions.width > 2 * n + m
    with mpmath.workdps(DIGITS):
        try:
            forces = functions.forces_at(position, multipliers).slopes
            gradients = _columns(functions.constraints_at(position).slopes, 0, n)
            table = functions.rates_at(position).slopes
            sizes = functions.force_sizes_at(position, multipliers)
            errors = _errors(system, at)
            mass = functions.masses_at(position)
        except DomainError:
            message = Phrase("the equations of motion have no derivatives at this equilibrium")
            raise InputError(Problem(message, rule="analysis-singular")) from None
        rates = _columns(table, n, 2 * n)
        _require_homogeneous(_columns(table, 0, n))
        placed, positions = _null_space(gradients, n)
        _require_independent(system, placed)
        independent, velocities = _null_space([*gradients, *rates], n)
        across = velocities.T
        reduced = across * mass * velocities
        largest = _magnitudes(across) * sizes * _magnitudes(positions)
        largest_error = _magnitudes(across) * errors[:, :n] * _magnitudes(positions)
        stiffness = _without_rounding(
            across * -forces[:, :n] * positions, largest * _ROUNDING + largest_error
        )
        damping = _without_rounding(
            across * -forces[:, n : 2 * n] * velocities,
            _magnitudes(across) * errors[:, n : 2 * n] * _magnitudes(velocities),
        )
        _require_regular(system, reduced, independent)
        diagonal = [mpmath.sqrt(abs(reduced[k, k])) for k in range(reduced.rows)]
        sides = mpmath.matrix([[_ROUNDING * a * b for b in diagonal] for a in diagonal])
        return LinearSystem(
            _without_rounding(reduced, sides),
            damping,
            stiffness,
            across * forces[:, 2 * n + m :] if inputs else mpmath.matrix(across.rows, 0),
            velocities,
            positions,
            independent,
            placed,
            largest,
            largest_error,
        )


def _errors(system: RestSystem, at: Equilibrium) -> mpmath.matrix:
    """Bound the errors of the derivatives of forces at an equilibrium, from those of its place.

    Raises
    ------
    DomainError
        They have no values all around it.
    """
    functions = system.functions
    numbers = (*(at.position or ()), *(at.multipliers or ()))
    exact = (*(at.exact or ()), *(at.exact_multipliers or ()))
    radius = max(mpf(at.uncertainty), _LAST_DIGITS)
    matrix = mpmath.zeros(functions.n, functions.width)
    try:
        box = [
            around(x, mpf(0) if k < len(exact) and exact[k] == 0 else radius * max(1, abs(x)))
            for k, x in enumerate(numbers)
        ]
        for place, slope in functions.enclosed_force_slopes(box).items():
            low, high = ends(slope)
            matrix[place] = high - low
    except (ArithmeticError, ValueError) as error:
        raise DomainError from error
    return matrix


def _magnitudes(matrix: mpmath.matrix) -> mpmath.matrix:
    return matrix.apply(abs)


def _without_rounding(matrix: mpmath.matrix, errors: mpmath.matrix) -> mpmath.matrix:
    """Set entries to zero that are no larger than their errors."""
    clean = matrix.copy()
    for i in range(matrix.rows):
        for j in range(matrix.cols):
            if abs(matrix[i, j]) <= errors[i, j]:
                clean[i, j] = mpf(0)
    return clean


def _numbers(system: RestSystem, at: Equilibrium) -> tuple[tuple[Mpf, ...], tuple[Mpf, ...]]:
    """Return positions and multipliers, which need the values of all parameters."""
    system.require_values()
    assert at.position is not None
    assert at.multipliers is not None
    return at.position, at.multipliers


def _columns(table: mpmath.matrix, first: int, end: int) -> list[list[Mpf]]:
    return [[table[row, j] for j in range(first, end)] for row in range(table.rows)]


def _null_space(rows: Sequence[Sequence[Mpf]], n: int) -> tuple[tuple[int, ...], mpmath.matrix]:
    """Solve rows·x = 0: the independent columns, and the matrix that gives x of their values.

    Gauss–Jordan elimination with complete pivoting chooses the largest coefficients, so that
    dependent coordinates follow the independent ones as slowly as can be.
    """
    left = [
        [x / largest for x in row] for row in rows if (largest := max(map(abs, row), default=0))
    ]
    pivots: list[int] = []
    done = 0
    while done < len(left):
        candidates = [
            (abs(left[i][j]), -i, j)
            for i in range(done, len(left))
            for j in range(n)
            if j not in pivots
        ]
        size, i, column = max(candidates, default=(0, 0, 0))
        if size < _DEPENDENT:
            break
        left[done], left[-i] = left[-i], left[done]
        pivot = left[done][column]
        left[done] = [x / pivot for x in left[done]]
        for k, row in enumerate(left):
            if k != done and row[column]:
                factor = row[column]
                left[k] = [x - factor * y for x, y in zip(row, left[done], strict=True)]
        pivots.append(column)
        done += 1
    independent = tuple(j for j in range(n) if j not in pivots)
    null = mpmath.zeros(n, len(independent)) if independent else mpmath.matrix(n, 0)
    for k, j in enumerate(independent):
        null[j, k] = mpf(1)
        for row, column in zip(left, pivots, strict=False):
            null[column, k] = -row[j]
    return independent, null


def _require_homogeneous(by_positions: Sequence[Sequence[Mpf]]) -> None:
    """Refuse closures between velocities that demand motion near an equilibrium."""
    if any(x for row in by_positions for x in row):
        message = Phrase(
            "a constraint between velocities asks for velocities beside this equilibrium"
        )
        raise InputError(Problem(message, rule="analysis-rates"))


def _require_independent(system: RestSystem, placed: Sequence[int]) -> None:
    """Refuse an equilibrium at which closures between positions leave more than elsewhere.

    There what their gradients allow is more than what they allow, as where a rhombus is folded.
    """
    n = system.functions.n
    try:
        slopes = system.functions.constraints_at(system.start).slopes
    except DomainError:
        return
    if len(placed) > len(_null_space(_columns(slopes, 0, n), n)[0]):
        message = Phrase("the constraints are not independent there")
        raise InputError(Problem(message, rule="analysis-singular"))


def _require_regular(system: RestSystem, mass: mpmath.matrix, independent: Sequence[int]) -> None:
    """Refuse an equilibrium at which the velocities do not determine the motion."""
    coordinates = system.equations.system.coordinates
    rows = [[abs(mass[k, i]) for i in range(mass.cols)] for k in range(mass.rows)]
    usual = _usual_inertia(system)
    idle = [
        j
        for row, j in zip(rows, independent, strict=True)
        if max(row) <= _WITHOUT_INERTIA * usual[j]
    ]
    sizes = mpmath.fprod(max(row) for row in rows)
    if not idle and abs(mpmath.det(mass)) > _WITHOUT_INERTIA * sizes:
        return
    names = ", ".join(f"'{coordinates[j].name}'" for j in idle or independent)
    mark = coordinates[(idle or independent)[0]].mark
    message = Phrase(
        "coordinates are singular there: no inertia goes with a rate of {names}", names=names
    )
    hint = "other coordinates, as Cartesian ones, cover it"
    raise InputError(Problem(message, mark, hint, "analysis-singular"))


def _usual_inertia(system: RestSystem) -> list[Mpf]:
    """Return the largest entry of each row of M at the initial configuration, 1 if it is 0."""
    try:
        mass = system.functions.masses_at([mpf(x) for x in system.start])
    except (DomainError, ZeroDivisionError):
        return [mpf(1)] * len(system.equations.system.coordinates)
    rows = [[abs(x) for x in row] for row in mass.tolist()]
    largest = max((x for row in rows for x in row), default=mpf(0)) or mpf(1)
    return [max(row) or largest for row in rows]


def _output_slopes(system: RestSystem, at: Equilibrium) -> mpmath.matrix:
    """Return the derivatives of the outputs at an equilibrium."""
    try:
        return system.functions.outputs_at(*_numbers(system, at)).slopes
    except DomainError:
        message = Phrase("the outputs have no derivatives at this equilibrium")
        raise InputError(Problem(message, rule="analysis-singular")) from None


def state_space(system: RestSystem, linear: LinearSystem, at: Equilibrium) -> StateSpace:
    """Write a linear system as one of first order, with the outputs of the scene.

    Without outputs the coordinates are given, and outputs without derivatives there are refused.
    States are positions, velocities, then states of first order.
    """
    functions, equations = system.functions, system.equations
    n, m = functions.n, functions.m
    k, p = len(linear.independent), len(linear.placed)
    names = [c.name for c in equations.system.coordinates]
    with mpmath.workdps(DIGITS):
        # ẏ = W w: the placed positions change with the independent velocities.
        follow = linear.velocities
        rows = [[follow[j, i] for i in range(k)] for j in linear.placed]
        below = _solved(linear.mass, -linear.stiffness, -linear.damping, linear.inputs)
        if equations.system.outputs:
            table = _output_slopes(system, at)
            outputs = tuple(name for name, _ in equations.system.outputs)
            by_q, by_v = table[:, :n] * linear.positions, table[:, n : 2 * n] * follow
            through = _doubles(_columns(table, 2 * n + m, functions.width))
            seen = np.hstack([_doubles(by_q.tolist(), p), _doubles(by_v.tolist(), k)])
        else:
            outputs = tuple(names[: system.moving])
            whole = _doubles(linear.positions.tolist(), p)[: system.moving]
            seen = np.hstack([whole, np.zeros((len(outputs), k))])
            through = np.zeros((len(outputs), len(equations.system.inputs)))
    kinematic = np.hstack([np.zeros((p, p)), _doubles(rows, k)])
    stiff, damped, driven = (_doubles(x.tolist(), x.cols) for x in below)
    order, inputs = FirstOrder.of_system(system, linear), equations.system.inputs
    state_names = [names[j] for j in linear.placed]
    state_names += [f"dot({names[j]})" for j in linear.independent]
    return StateSpace(
        tuple(order.ordered(state_names)),
        tuple(u.name for u in inputs),
        outputs,
        np.vstack([kinematic, np.hstack([stiff, damped])])[np.ix_(order.rows, order.columns)],
        np.vstack([np.zeros((p, len(inputs))), driven])[order.rows],
        seen[:, order.columns],
        through,
    )


def _solved(mass: mpmath.matrix, *right: mpmath.matrix) -> list[mpmath.matrix]:
    """Solve M X = R for each R."""
    inverse = mpmath.inverse(mass) if mass.rows else mass
    return [inverse * r if r.cols and r.rows else r for r in right]


def _doubles(rows: Sequence[Sequence[Mpf]], columns: int = 0) -> Matrix:
    """Round rows to doubles, shape (rows, columns)."""
    numbers = [[float(x) for x in row] for row in rows]
    return np.array(numbers).reshape(len(rows), len(numbers[0]) if numbers else columns)


def in_doubles(matrix: mpmath.matrix) -> Matrix:
    """Round a matrix to doubles."""
    return np.array([[float(x) for x in row] for row in matrix.tolist()]).reshape(
        matrix.rows, matrix.cols
    )


def require_doubles(mass: Matrix, *matrices: Matrix) -> None:
    """Refuse a linear system whose frequencies are found from numbers that doubles cannot hold.

    Raises
    ------
    InputError
        An entry is too large, or an inertia too small.
    """
    largest = max(np.abs(m).max(initial=0.0) for m in (mass, *matrices))
    least = np.abs(mass).max(axis=1, initial=0.0).min(initial=1.0)
    if not (largest < _LARGEST and least > 1 / _LARGEST):
        message = Phrase("numbers of the linear system are beyond double precision")
        hint = "units of another size, of mass, length or time, bring them nearer to 1"
        raise InputError(Problem(message, hint=hint, rule="analysis-doubles"))


def exact_matrices(system: RestSystem, at: Equilibrium) -> ExactMatrices | None:
    """Linearize in closed form; None beyond the budget, or at a place known in numbers alone."""
    equations = system.equations
    coordinates = equations.system.coordinates
    operations = sum(sp.count_ops(f) for f in equations.system.forcing)
    if at.exact is None or equations.system.closures or len(coordinates) > _MATRICES:
        return None
    if operations > _OPERATIONS:
        return None
    pairs = zip(coordinates, at.exact, strict=True)
    still = {c.v: sp.S.Zero for c in coordinates}
    place = {c.q: value for c, value in pairs}

    def here(expression: sp.Expr) -> sp.Expr:
        # Momenta hold the coordinates: their roots and angles come last.
        written = expression.xreplace(still)
        if not system.inputs.keys().isdisjoint(written.free_symbols):
            written = cancelled(written.xreplace(system.inputs))
        written = written.xreplace(place)
        return factored_form(cancelled(written)) if sp.count_ops(written) <= _PLACED else sp.nan

    def by(symbols: Sequence[sp.Symbol]) -> _Rows:
        slopes = [[derivative(f, s) for s in symbols] for f in equations.system.forcing]
        return tuple(tuple(here(-entry) for entry in row) for row in slopes)

    mass = tuple(tuple(here(entry) for entry in row) for row in equations.system.mass_matrix)
    damping = by([c.v for c in coordinates])
    stiffness = by([c.q for c in coordinates])
    entries = [e for rows in (mass, damping, stiffness) for row in rows for e in row]
    if any(sp.count_ops(e) > _LONGEST or e.has(sp.zoo, sp.nan) for e in entries):
        return None
    inputs = by([u.symbol for u in equations.system.inputs])
    a, b = _first_order(mass, damping, stiffness, inputs)
    n, k = len(coordinates), system.moving
    order = FirstOrder(n, n, k, k)
    if a is not None and b is not None:
        a = tuple(tuple(order.ordered(a[row])) for row in order.rows)
        b = tuple(b[row] for row in order.rows)
    mass, damping, stiffness = (
        tuple(row[:k] for row in rows[:k]) for rows in (mass, damping, stiffness)
    )
    return ExactMatrices(mass, damping, stiffness, a, b)


def _first_order(
    mass: _Rows, damping: _Rows, stiffness: _Rows, inputs: _Rows
) -> tuple[_Rows | None, _Rows | None]:
    """Solve for accelerations: A and B; None where they are long."""
    n = len(mass)
    if n > _STATE_SPACE:
        return None, None
    matrix = sp.Matrix(mass)
    determinant = matrix.det(method="berkowitz")
    if cancelled(determinant) == 0:
        return None, None
    # `inv` would simplify the determinant to see whether it is zero, which takes longer than this.
    inverse = matrix.adjugate() / determinant
    below = [-inverse * sp.Matrix(m) for m in (stiffness, damping)]
    driven = -inverse * sp.Matrix(n, len(inputs[0]), lambda i, j: inputs[i][j])
    blocks = [[factored_form(cancelled(e)) for e in matrix] for matrix in (*below, driven)]
    if any(sp.count_ops(e) > _LONGEST for block in blocks for e in block):
        return None, None
    zeros = (sp.S.Zero,) * n
    units = tuple((*zeros[:i], sp.S.One, *zeros[i + 1 :]) for i in range(n))
    stiff, damped = (tuple(tuple(b[i * n : (i + 1) * n]) for i in range(n)) for b in blocks[:2])
    width = len(inputs[0])
    lower = tuple(tuple(blocks[2][i * width : (i + 1) * width]) for i in range(n))
    return (
        (*(zeros + unit for unit in units), *(s + d for s, d in zip(stiff, damped, strict=True))),
        (*((sp.S.Zero,) * width for _ in range(n)), *lower),
    )
