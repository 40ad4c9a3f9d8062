"""Farkas certificates: sums of constraints that are false for all values of names.

Every equation φ = 0 and inequality φ ≥ 0 is a row over its terms, as if terms were independent: x,
x² and sin x are three of them, and only their bounds are used. Multipliers with which the terms
cancel and a negative number is left show that the rows contradict each other (Farkas' lemma); at a
vertex of the set of such multipliers no row can be left out (Gleeson and Ryan, Identifying
minimally infeasible subsystems of inequalities, ORSA J. Computing 2, 1990). The vertex is computed
by linear programming in doubles and checked in high precision.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf
from numpy.typing import NDArray

from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE

# The budgets keep the linear program small; its vertex is checked in high precision, so that
# no number here decides the truth of a proof. None is tuned.

#: Terms that a row may be multiplied out to.
_TERM_BUDGET = 80
#: Terms of all rows.
_BUDGET = 20_000
#: Part of the largest multiplier below which one is zero.
_NOTHING = 1e-9
#: Relative size of a sum of products that is rounding.
_ROUNDING = mpf(10) ** -30
#: Sweeps over rows and columns that bring entries near 1.
_SWEEPS = 6

_ONE = mpf(1)

_Array = NDArray[np.float64]

#: Functions between −1 and 1.
_WITHIN_ONE = (sp.sin, sp.cos, sp.tanh)


@dataclass(frozen=True)
class FalseSum:
    """Σ share·φ = −shortfall < 0, or < 0 by terms that are positive.

    Attributes
    ----------
    shares
        Multiplier of each row that takes part, by number.
    shortfall
        Amount by which the sum misses zero; zero if a positive term proves it.
    bounds
        Bounds of terms that take part, as ``x^2 >= 0``.
    """

    shares: Mapping[int, mpf]
    shortfall: mpf
    bounds: tuple[str, ...]


@dataclass
class _Rows:
    """Rows Σ entry·term + constant, equations (= 0) or one-sided (≥ 0).

    Attributes
    ----------
    constants
        Values of parameters.
    terms
        Term → its column.
    entries
        Entries of each row by column.
    constant
        Constant of each row.
    one_sided
        True for each row that is ≥ 0.
    origin
        For each row, the number of the stated constraint or the text of a bound.
    strict
        Numbers of rows that are > 0.
    units
        Factor by which :meth:`equilibrate` divided each row.
    size
        Factor by which it divided the constants.
    """

    constants: Mapping[sp.Symbol, mpf]
    terms: dict[sp.Expr, int] = field(default_factory=dict)
    entries: list[dict[int, mpf]] = field(default_factory=list)
    constant: list[mpf] = field(default_factory=list)
    one_sided: list[bool] = field(default_factory=list)
    origin: list[int | str] = field(default_factory=list)
    strict: list[int] = field(default_factory=list)
    units: list[mpf] = field(default_factory=list)
    size: mpf = _ONE

    def add(self, number: int, phi: sp.Expr, one_sided: bool) -> None:
        """Add a row unless it is too long or not real."""
        parts = expand_terms(phi, _TERM_BUDGET)
        if parts is None:
            return
        row: dict[int, mpf] = {}
        constant = mpf(0)
        try:
            for part in parts:
                share, term = self._split(part)
                if term == 1:
                    constant += share
                    continue
                place = self.terms.setdefault(term, len(self.terms))
                row[place] = row.get(place, mpf(0)) + share
        except DomainError:
            return
        self._append({j: x for j, x in row.items() if x}, constant, one_sided, number)

    def _append(
        self, row: dict[int, mpf], constant: mpf, one_sided: bool, origin: int | str
    ) -> None:
        self.entries.append(row)
        self.constant.append(constant)
        self.one_sided.append(one_sided)
        self.origin.append(origin)

    def _split(self, part: sp.Expr) -> tuple[mpf, sp.Expr]:
        numbers, factors = list[sp.Expr](), list[sp.Expr]()
        for factor in sp.Mul.make_args(part):
            known = factor.free_symbols <= self.constants.keys()
            (numbers if known else factors).append(factor)
        number = sp.Mul(*numbers)
        known_values = {s: self.constants[s] for s in number.free_symbols}
        return evaluate([number], known_values)[0], sp.Mul(*factors)

    def bound(self) -> None:
        """Add the bounds of single terms."""
        for term, j in list(self.terms.items()):
            written = str(term).replace("**", "^")
            if term.is_positive:
                self.strict.append(len(self.entries))
                self._append({j: mpf(1)}, mpf(0), True, f"{written} > 0")
            elif term.is_nonnegative:
                self._append({j: mpf(1)}, mpf(0), True, f"{written} >= 0")
            base, exponent = term.as_base_exp()
            if base.func in _WITHIN_ONE and exponent.is_Integer and exponent > 0:
                self._append({j: mpf(-1)}, mpf(1), True, f"{written} <= 1")
                if exponent % 2:
                    self._append({j: mpf(1)}, mpf(1), True, f"{written} >= -1")

    def equilibrate(self) -> None:
        """Bring entries near 1 by factors for rows, terms and the constants in turn.

        Geometric means of the least and the largest entry (Curtis and Reid, On the automatic
        scaling of matrices for Gaussian elimination, IMA J. Appl. Math. 10, 1972, compare).
        """
        self.units = [mpf(1)] * len(self.entries)
        for _ in range(_SWEEPS):
            for k, row in enumerate(self.entries):
                unit = _middle([*row.values(), self.constant[k]])
                self.units[k] *= unit
                self.entries[k] = {j: x / unit for j, x in row.items()}
                self.constant[k] /= unit
            columns: dict[int, list[mpf]] = {}
            for row in self.entries:
                for j, x in row.items():
                    columns.setdefault(j, []).append(x)
            middle = {j: _middle(x) for j, x in columns.items()}
            self.entries = [{j: x / middle[j] for j, x in r.items()} for r in self.entries]
            size = _middle(self.constant)
            self.size *= size
            self.constant = [x / size for x in self.constant]


def _middle(numbers: Sequence[mpf]) -> mpf:
    """Give the geometric mean of the least and the largest magnitude that is not zero."""
    sizes = [abs(x) for x in numbers if x]
    return mpmath.sqrt(min(sizes) * max(sizes)) if sizes else mpf(1)


def false_sum(
    equations: Sequence[tuple[sp.Expr, bool]], constants: Mapping[sp.Symbol, mpf]
) -> FalseSum | None:
    """Find a sum of constraints that is negative although it should not be; None if there is none.

    Parameters
    ----------
    equations
        Each expression, with False for = 0 and True for ≥ 0.
    constants
        Values of the symbols that have one.
    """
    rows = _Rows(constants)
    for number, (phi, one_sided) in enumerate(equations):
        rows.add(number, phi, one_sided)
    rows.bound()
    rows.equilibrate()
    if not rows.terms or sum(map(len, rows.entries)) > _BUDGET:
        return None
    for strict in (False, True):
        if strict and not rows.strict:
            return None
        shares = _vertex(rows, strict)
        if shares is not None:
            return _checked(rows, shares, strict)
    return None


def _vertex(rows: _Rows, strict: bool) -> _Array | None:
    """Find multipliers of least sum with which all terms cancel and −1 is left.

    Shape (rows,), in doubles; None if there are none. ``strict``: the constant left is at most
    zero, and positive terms count for 1.
    """
    from scipy.optimize import linprog

    free = [k for k, one_sided in enumerate(rows.one_sided) if not one_sided]
    columns = [*((k, 1.0) for k in range(len(rows.entries))), *((k, -1.0) for k in free)]
    left = np.array([sign * float(rows.constant[k]) for k, sign in columns])
    counted = left
    if strict:
        counted = np.array([-float(k in rows.strict) for k, _ in columns])
    width = len(rows.terms)
    optimum = linprog(
        np.ones(len(columns)),
        A_ub=left.reshape(1, -1) if strict else None,
        b_ub=[0.0] if strict else None,
        A_eq=_balance(rows, columns, counted),
        b_eq=[*([0.0] * width), -1.0],
        method="highs-ds",
    )
    if optimum.status != 0:
        return None
    shares = np.zeros(len(rows.entries))
    for (k, sign), x in zip(columns, np.asarray(optimum.x).tolist(), strict=True):
        shares[k] += sign * x
    return shares


def _balance(rows: _Rows, columns: Sequence[tuple[int, float]], counted: _Array) -> Any:
    """Assemble the sparse matrix from multipliers to each term, and to ``counted``."""
    from scipy.sparse import csr_array

    width = len(rows.terms)
    numbers, places = [width] * len(columns), [*range(len(columns))]
    entries = counted.tolist()
    for place, (k, sign) in enumerate(columns):
        for j, x in rows.entries[k].items():
            numbers.append(j)
            places.append(place)
            entries.append(sign * float(x))
    return csr_array((entries, (numbers, places)), shape=(width + 1, len(columns)))


def _checked(rows: _Rows, shares: _Array, strict: bool) -> FalseSum | None:
    """Verify the sum in the digits carried; None if it does not hold there."""
    sizes = np.abs(shares)
    part = [k for k in range(len(shares)) if sizes[k] > _NOTHING * sizes.max()]
    first = max(part, key=lambda k: sizes[k])
    others = [k for k in part if k != first]
    involved = sorted({j for k in part for j in rows.entries[k]})
    exact = {first: mpf(float(shares[first]))}
    if others:
        matrix = mpmath.matrix([[rows.entries[k].get(j, mpf(0)) for k in others] for j in involved])
        target = mpmath.matrix(
            [-exact[first] * rows.entries[first].get(j, mpf(0)) for j in involved]
        )
        try:
            exact.update(zip(others, mpmath.lu_solve(matrix, target), strict=True))
        except (ZeroDivisionError, ValueError):
            return None
    for j in involved:
        products = [exact[k] * rows.entries[k].get(j, mpf(0)) for k in part]
        if abs(sum(products, mpf(0))) > _ROUNDING * sum(map(abs, products), mpf(0)):
            return None
    if any(rows.one_sided[k] and exact[k] <= 0 for k in part):
        return None
    products = [exact[k] * rows.constant[k] for k in part]
    deficit = -sum(products, mpf(0))
    size = sum(map(abs, products), mpf(0))
    holds = deficit >= -_ROUNDING * size if strict else deficit > RANK_TOLERANCE * size
    if not holds:
        return None
    named = {o: exact[k] / rows.units[k] for k in part if isinstance(o := rows.origin[k], int)}
    bounds = tuple(o for k in part if isinstance(o := rows.origin[k], str))
    return FalseSum(dict(sorted(named.items())), max(deficit, mpf(0)) * rows.size, bounds)
