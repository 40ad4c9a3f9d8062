"""Integrability of velocity constraints (Frobenius, derived flag).

A constraint A(q, t) v + b(q, t) = 0 is the one-form ω = A dq + b dt. Forms that vanish along
motions are integrable where dω vanishes on all displacements on which they do (Frobenius; Bloch,
Nonholonomic Mechanics and Control, 2nd ed. 2015, section 2.4). Combinations with this property are
computed with constant coefficients, repeatedly, until no form is dropped any more (the derived
flag). A form that is closed itself is integrated term by term; its integral takes its constant from
the initial state.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import sympy as sp
from mpmath import mpf
from sympy.integrals.manualintegrate import manualintegrate

from lagrange_cli.mechanics.algebra.collect import fewest_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import RANK_TOLERANCE, Matrix, SymbolValues
from lagrange_cli.mechanics.numerics.sampling import to_double

#: Most terms that a coefficient may be multiplied out to; a form with a longer one counts as one
#: without a closed integral. Not tuned.
_TERM_BUDGET = 60
#: Most operations of a term that is integrated.
_OPERATION_BUDGET = 40


@dataclass(frozen=True)
class PfaffianForm:
    """ω = Σ coefficient·d(variable); the last variable is t."""

    variables: tuple[sp.Symbol, ...]
    coefficients: tuple[sp.Expr, ...]

    @cached_property
    def curl(self) -> dict[tuple[int, int], sp.Expr]:
        """dω: (i, j), i < j → ∂ᵢωⱼ − ∂ⱼωᵢ, zero ones absent."""
        entries = {}
        for j, y in enumerate(self.variables):
            for i, x in enumerate(self.variables[:j]):
                a, b = self.coefficients[j], self.coefficients[i]
                entry = derivative(a, x) - derivative(b, y)
                if entry != 0:
                    entries[i, j] = entry
        return entries


def integrate_form(form: PfaffianForm, points: Sequence[SymbolValues]) -> sp.Expr | None:
    """F with dF = ω; None if ω is not closed, or F has no known closed form.

    Parameters
    ----------
    points
        Configurations at which dω = 0 and dF = ω are checked.
    """
    if not all(_vanishes(sp.Add.make_args(e), points) for e in form.curl.values()):
        return None
    total = sp.Integer(0)
    for variable, coefficient in zip(form.variables, form.coefficients, strict=True):
        remainder = sp.expand(coefficient - derivative(total, variable))
        part = _antiderivative(remainder, variable)
        if part is None:
            return None
        total += part
    for variable, coefficient in zip(form.variables, form.coefficients, strict=True):
        if not _vanishes([derivative(total, variable), -coefficient], points):
            return None
    return total


def _antiderivative(expr: sp.Expr, variable: sp.Symbol) -> sp.Expr | None:
    terms = fewest_terms(expr, _TERM_BUDGET)
    if terms is None:
        return None
    # Positive symbols avoid case distinctions; other signs are checked later.
    generic = {s: sp.Dummy(s.name, positive=True) for s in sorted(expr.free_symbols, key=str)}
    original = {dummy: s for s, dummy in generic.items()}
    parts = []
    for term in terms:
        if sp.count_ops(term) > _OPERATION_BUDGET:
            return None
        if variable in term.free_symbols:
            part = manualintegrate(term.xreplace(generic), generic[variable]).xreplace(original)
        else:
            part = term * variable
        if part.has(sp.Integral, sp.Piecewise):
            return None
        parts.append(part)
    return sp.Add(*parts)


def _vanishes(terms: Sequence[sp.Expr], points: Sequence[SymbolValues]) -> bool:
    """Tell whether a sum is zero at every point, relative to the size of its terms."""
    for point in points:
        try:
            numbers = evaluate(list(terms), point)
        except DomainError:
            return False
        if abs(sum(numbers, mpf(0))) > RANK_TOLERANCE * sum(map(abs, numbers), mpf(0)):
            return False
    return True


def integrable_rank(
    forms: Sequence[PfaffianForm], points: Sequence[SymbolValues], scale: Sequence[float]
) -> int:
    """Dimension of the largest integrable system that constant combinations of the forms span.

    Parameters
    ----------
    forms
        Independent forms over the same variables.
    points
        Configurations; the dimension must be the same at each.
    scale
        The size of each variable, so that units do not matter.
    """
    if not forms:
        return 0
    sizes = np.array(scale)
    first, _ = _numbers(forms, points[0], sizes)
    weights = 1 / np.maximum(np.abs(first).max(axis=1), 1e-300)
    seen = [_weighted(_numbers(forms, p, sizes), weights) for p in points]
    spans = np.eye(len(forms))
    while len(spans):
        annulled = [_annulled(spans, rows, curls) for rows, curls in seen]
        smaller = annulled[0]
        if any(
            f.shape != smaller.shape or not np.allclose(f, smaller, atol=1e-7) for f in annulled
        ):
            return 0
        if len(smaller) == len(spans):
            return len(spans)
        spans = smaller @ spans
    return 0


_Numbers = tuple[Matrix, list[Matrix]]


def _weighted(numbers: _Numbers, weights: Matrix) -> _Numbers:
    rows, curls = numbers
    return weights[:, None] * rows, [w * d for w, d in zip(weights, curls, strict=True)]


def _numbers(forms: Sequence[PfaffianForm], point: SymbolValues, scale: Matrix) -> _Numbers:
    """Rows ω and matrices dω at a point, for variables in units of a scale."""
    n = len(forms[0].variables)
    rows, curls = np.zeros((len(forms), n)), []
    for k, form in enumerate(forms):
        rows[k] = [to_double(x) for x in evaluate(list(form.coefficients), point)]
        entries = form.curl
        matrix = np.zeros((n, n))
        for (i, j), value in zip(entries, evaluate(list(entries.values()), point), strict=True):
            matrix[i, j], matrix[j, i] = to_double(value), -to_double(value)
        curls.append(matrix * np.outer(scale, scale))
    return rows * scale, curls


def _annulled(spans: Matrix, rows: Matrix, curls: Sequence[Matrix]) -> Matrix:
    """Combinations of ``spans`` with zero dω where all ``spans`` vanish, in reduced row form."""
    combined = spans @ rows
    _, _, right = np.linalg.svd(combined)
    null = right[len(combined) :]
    restricted = [
        sum(c * (null @ d @ null.T) for c, d in zip(weights, curls, strict=True)).ravel()
        for weights in spans
    ]
    matrix = np.array(restricted).T
    size = max(max(np.abs(d).max(initial=0.0) for d in curls), 1e-300)
    if not matrix.size:
        return np.eye(len(spans))
    _, sizes, vectors = np.linalg.svd(matrix, full_matrices=True)
    rank = int(np.sum(sizes > RANK_TOLERANCE * size))
    return _reduced(vectors[rank:])


def _reduced(matrix: Matrix) -> Matrix:
    """Reduced row echelon form of independent rows: the same for every basis of their span."""
    rows = matrix.copy()
    done = 0
    for column in range(rows.shape[1]):
        if done == len(rows):
            break
        pivot = done + int(np.abs(rows[done:, column]).argmax())
        if abs(rows[pivot, column]) < RANK_TOLERANCE:
            continue
        rows[[done, pivot]] = rows[[pivot, done]]
        rows[done] /= rows[done, column]
        for k in range(len(rows)):
            if k != done:
                rows[k] -= rows[k, column] * rows[done]
        done += 1
    return rows
