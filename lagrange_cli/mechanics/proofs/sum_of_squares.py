"""Sum-of-squares proofs that equations have no common real solution.

Multipliers cₖ for which Σ cₖ φₖ is a positive number plus a sum of squares show that the
φₖ are not all zero anywhere (Parrilo, Semidefinite programming relaxations for semialgebraic
problems, Math. Program. 96 (2003), section 4; for rods they are a stress that no lengths
balance). The search is numerical, by an interior-point method, over quadratic forms
(:mod:`.quadratic_forms`), and checked in high precision.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE
from lagrange_cli.mechanics.proofs.quadratic_forms import (
    FormBudgetError,
    QuadraticForm,
    QuadraticForms,
)
from lagrange_cli.stages import announce

# The search is in doubles and only proposes; each proof is checked in high precision, so that these
# numbers decide which proofs are found and how long it takes, never their truth. None is tuned.

#: Most forms, those of relations included.
_FORM_BUDGET = 160
#: Most equations, and most symbols, whose products are tried as well.
_SMALL = 5
#: Relative size of a difference that is rounding.
_ROUNDING = mpf(10) ** -30
#: Part of the largest multiplier below which one is zero.
_NOTHING = 1e-9
#: Least eigenvalue that counts as positive, of forms with entries up to 1.
_POSITIVE = 1e-8
#: Newton steps for one weight of the barrier.
_NEWTON = 12
#: Growth of the weight.
_GROWTH = 8.0
#: Number of weights.
_WEIGHTS = 11
#: Newton decrement at which the method stops.
_SETTLED = 1e-6
#: Length of a damped step at which the method stops, relative to the full one.
_SHORTEST = 1e-12

_Array = NDArray[np.float64]


def contradicting_equations(
    equations: Sequence[sp.Expr],
    constants: Mapping[sp.Symbol, mpf],
    products: Sequence[bool] = (False, True),
) -> list[int] | None:
    """Number the expressions that are proven not to vanish together; None without proof.

    Parameters
    ----------
    constants
        Values of the symbols that have one; others may have any.
    products
        Without, then with products of equations and symbols (of few of them).
    """
    for multiplied in products:
        try:
            combinations = _forms(equations, constants, multiplied)
        except FormBudgetError:
            return None
        owners = _number(combinations) or _squares(combinations)
        if owners is not None:
            return sorted(k for k in owners if k >= 0)
    return None


@dataclass(frozen=True)
class _Combination:
    """A combination of equations, as a form that vanishes.

    Attributes
    ----------
    owners
        Numbers of the equations in it; −1 for a relation of generators.
    size
        Sum of the magnitudes of the terms of its constant.
    """

    form: QuadraticForm
    owners: frozenset[int]
    size: mpf


def _combination(form: QuadraticForm, owner: int) -> _Combination:
    return _Combination(form, frozenset([owner]), abs(form.get((0, 0), mpf(0))))


def _forms(
    equations: Sequence[sp.Expr], constants: Mapping[sp.Symbol, mpf], products: bool
) -> list[_Combination]:
    quadrics = QuadraticForms(constants)
    forms, combinations = [], list[_Combination]()
    for k, equation in enumerate(equations):
        forms.append(quadrics.form(equation))
        combinations += [_combination(f, k) for f in (forms[-1], *quadrics.domains)]
        quadrics.domains.clear()
    if products:
        atoms = [i for i, m in enumerate(quadrics.monomials) if len(m) == 1]
        if max(len(equations), len(atoms)) > _SMALL:
            raise FormBudgetError
        quadrics.products_of_two()
        generators = range(1, len(quadrics.monomials))
        combinations += [
            _combination(quadrics.multiply(f, g), k)
            for k, f in enumerate(forms)
            for g in generators
        ]
        quadrics.relations += quadrics.coincidences()
    combinations += [_combination(f, -1) for f in quadrics.relations]
    if len(combinations) > _FORM_BUDGET:
        raise FormBudgetError
    return combinations


def _number(combinations: Sequence[_Combination]) -> frozenset[int] | None:
    """Find equations with a combination that is a nonzero number; None if there are none."""
    left = [c for c in combinations if c.form]
    while lone := {p for c in left for p in c.form} - {(0, 0)}:
        left = _without(left, min(lone))
    for c in left:
        if abs(c.form[0, 0]) > RANK_TOLERANCE * c.size:
            return c.owners
    return None


def _squares(combinations: Sequence[_Combination]) -> frozenset[int] | None:
    """Find equations with a combination that is a positive number plus a sum of squares."""
    combinations = _faced(combinations)
    pivots = _pivots([c.form for c in combinations])
    if 0 not in pivots:
        return None
    forms = [_restricted(c.form, pivots) for c in combinations]
    scaled, weights = _equilibrated(forms, len(pivots))
    multipliers = _interior(scaled)
    if multipliers is None:
        return None
    multipliers[np.abs(multipliers) < _NOTHING * np.abs(multipliers).max()] = 0.0
    shares = [mpf(x) * w for x, w in zip(multipliers.tolist(), weights, strict=True)]
    size = sum((abs(x) * c.size for c, x in zip(combinations, shares, strict=True)), mpf(0))
    if not _is_proof(forms, shares, len(pivots), RANK_TOLERANCE * size):
        return None
    return frozenset().union(*(c.owners for c, x in zip(combinations, shares, strict=True) if x))


def _faced(combinations: Sequence[_Combination]) -> list[_Combination]:
    """Eliminate generators whose square no form holds: they admit no sum of squares."""
    left = [c for c in combinations if c.form]
    while True:
        squared = {i for c in left for i, j in c.form if i == j}
        lone = [p for c in left for p in c.form if not set(p) <= squared | {0}]
        if not lone:
            return left
        left = _without(left, min(lone))


def _without(combinations: Sequence[_Combination], pair: tuple[int, int]) -> list[_Combination]:
    """Combine so that a product of generators cancels."""
    holding = [c for c in combinations if pair in c.form]
    pivot = max(holding, key=lambda c: abs(c.form[pair]) / max(map(abs, c.form.values())))
    reduced = []
    for c in combinations:
        if pair not in c.form:
            reduced.append(c)
        elif c is not pivot:
            ratio = c.form[pair] / pivot.form[pair]
            form = _difference(c.form, ratio, pivot.form, pair)
            size = c.size + abs(ratio) * pivot.size
            if form is not None:
                reduced.append(_Combination(form, c.owners | pivot.owners, size))
    return reduced


def _difference(
    form: QuadraticForm, ratio: mpf, pivot: QuadraticForm, gone: tuple[int, int]
) -> QuadraticForm | None:
    """Subtract ratio·pivot from a form; None if nothing is left, or only within the tolerance."""
    difference = dict(form)
    for p, x in pivot.items():
        left = difference.pop(p, mpf(0)) - ratio * x
        if p == gone or abs(left) <= _ROUNDING * abs(ratio * x):
            continue
        if abs(left) <= RANK_TOLERANCE * abs(ratio * x):
            return None
        difference[p] = left
    return difference or None


def _pivots(forms: Sequence[QuadraticForm]) -> list[int]:
    """Find pivot generators; the others span directions along which no form changes.

    Sparse elimination on the rows of all forms. With the other generators set to zero the
    forms say as much as the whole.
    """
    rows: dict[int, dict[int, mpf]] = {}
    for form in forms:
        for i in sorted({k for pair in form for k in pair}):
            row = {}
            for (a, b), x in form.items():
                if i in (a, b):
                    row[b if a == i else a] = x * (2 if a == b else 1)
            _reduce(rows, row)
    return sorted(rows)


def _reduce(rows: dict[int, dict[int, mpf]], row: dict[int, mpf]) -> None:
    """Add a row to an echelon form, kept by the column that it begins with."""
    size = max(abs(x) for x in row.values())
    while row:
        column = min(row)
        if abs(row[column]) <= _ROUNDING * size:
            del row[column]
        elif column in rows:
            pivot = rows[column]
            ratio = row.pop(column) / pivot[column]
            for j, x in pivot.items():
                if j != column:
                    row[j] = row.get(j, mpf(0)) - ratio * x
        else:
            rows[column] = row
            return


def _restricted(form: QuadraticForm, pivots: Sequence[int]) -> QuadraticForm:
    places = {k: n for n, k in enumerate(pivots)}
    return {(places[i], places[j]): x for (i, j), x in form.items() if i in places and j in places}


def _equilibrated(forms: Sequence[QuadraticForm], size: int) -> tuple[_Array, list[mpf]]:
    """Scale the forms to entries near 1: matrices, shape (forms, n, n), and a factor for each.

    Logarithms of units and factors by least squares (Curtis and Reid, On the automatic scaling
    of matrices for Gaussian elimination, IMA J. Appl. Math. 10 (1972)).
    """
    entries = [(k, i, j, x) for k, f in enumerate(forms) for (i, j), x in f.items()]
    system = np.zeros((len(entries), len(forms) + size))
    for row, (k, i, j, _) in enumerate(entries):
        for column in (k, len(forms) + i, len(forms) + j):
            system[row, column] += 1.0
    logarithms = [-float(mpmath.log(abs(x))) for *_, x in entries]
    solution, *_ = np.linalg.lstsq(system, np.array(logarithms), rcond=1e-10)
    scales = [mpmath.exp(x) for x in solution.tolist()]
    weights, units = scales[: len(forms)], scales[len(forms) :]
    matrices = np.zeros((len(forms), size, size))
    for k, i, j, x in entries:
        entry = float(x * weights[k] * units[i] * units[j]) / (1 if i == j else 2)
        matrices[k, i, j] = matrices[k, j, i] = entry
    return matrices, weights


def _interior(matrices: _Array) -> _Array | None:
    """Find c in [−1, 1] with Σ c·matrix positive definite; None if there is none.

    The largest least eigenvalue τ is found by Newton's method on a logarithmic barrier (Boyd and
    Vandenberghe, Convex Optimization, 2004, section 11.3), which stops as soon as τ is positive,
    or the gap of the barrier shows that it is not.
    """
    count, size, _ = matrices.shape
    c, tau, weight = np.zeros(count), -1.0, 1.0
    for _ in range(_WEIGHTS):
        announce("looking for a proof that constraints contradict each other")
        for _ in range(_NEWTON):
            try:
                c, tau, decrement = _newton(matrices, c, tau, weight)
            except np.linalg.LinAlgError:
                return None  # doubles are exhausted
            if decrement < _SETTLED:
                break
        gap = (size + 2 * count) / weight
        if tau > max(_POSITIVE, gap):
            return c
        if tau + gap < _POSITIVE:
            return None
        weight *= _GROWTH
    return c if tau > _POSITIVE else None


def _least(matrices: _Array, c: _Array) -> float:
    return float(np.linalg.eigvalsh(np.tensordot(c, matrices, 1))[0])


def _newton(matrices: _Array, c: _Array, tau: float, weight: float) -> tuple[_Array, float, float]:
    """Take a damped step for weight·τ + log det(Σ c·matrix − τ) + Σ log(1 − c²).

    Returns c, τ and the Newton decrement.
    """
    count, size, _ = matrices.shape
    inverse = np.linalg.inv(np.tensordot(c, matrices, 1) - tau * np.eye(size))
    # Direction by direction: the forms, then −1 for τ.
    moved = np.concatenate([inverse @ matrices, -inverse[None]])
    gradient = np.trace(moved, axis1=1, axis2=2)
    flat = moved.reshape(count + 1, -1)
    hessian = flat @ moved.transpose(0, 2, 1).reshape(count + 1, -1).T
    above, below = 1 / (1 - c), 1 / (1 + c)
    gradient[:count] += below - above
    gradient[count] += weight
    hessian[np.arange(count), np.arange(count)] += above**2 + below**2
    step = np.linalg.solve(hessian, gradient)
    decrement = float(gradient @ step)
    if not decrement >= 0:
        raise np.linalg.LinAlgError
    length = 1.0 if decrement < 0.25 else 1 / (1 + np.sqrt(decrement))
    while not _inside(matrices, c + length * step[:-1], tau + length * step[-1]):
        length /= 2
        if length < _SHORTEST:
            return c, tau, 0.0
    return c + length * step[:-1], float(tau + length * step[-1]), decrement


def _inside(matrices: _Array, c: _Array, tau: float) -> bool:
    return bool((np.abs(c) < 1).all() and _least(matrices, c) > tau)


def _is_proof(forms: Sequence[QuadraticForm], c: Sequence[mpf], size: int, least: mpf) -> bool:
    """Say whether Σ c·form is a sum of squares plus a number greater than ``least``.

    Gaussian elimination in the digits carried; the constant is the last pivot.
    """
    matrix = [[mpf(0)] * size for _ in range(size)]
    sizes = [mpf(0)] * size
    for form, x in zip(forms, c, strict=True):
        for (i, j), entry in form.items():
            for a, b in {(i, j), (j, i)}:
                matrix[a][b] += x * entry / (1 if i == j else 2)
            if i == j:
                sizes[i] += abs(x * entry)
    for k in range(size - 1, 0, -1):
        if matrix[k][k] <= _ROUNDING * sizes[k]:
            return False
        for i in range(k):
            ratio = matrix[i][k] / matrix[k][k]
            for j in range(k):
                matrix[i][j] -= ratio * matrix[k][j]
    return bool(matrix[0][0] > least)
