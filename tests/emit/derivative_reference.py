"""Derivatives of accelerations by differences in 60 digits, of the equations themselves."""

from __future__ import annotations

import mpmath
import numpy as np
import sympy as sp

DIGITS = 60
STEP = mpmath.mpf(10) ** -20


class AccelerationReference:
    """Accelerations of equations, with some contacts closed, over mpmath numbers."""

    def __init__(self, equations, mode=()):
        e = self.equations = equations
        closed = [c.closure for c, flag in zip(e.system.contacts, mode, strict=False) if flag]
        self.closures = [*e.system.closures, *closed]
        n = self.n = len(e.system.coordinates)
        expressions = [e.system.mass_matrix[i][j] for i in range(n) for j in range(n)]
        expressions += [
            *e.system.forcing,
            *(x for c in self.closures for x in (*c.gradient, c.bias)),
        ]
        arguments = [
            e.system.t,
            *(c.q for c in e.system.coordinates),
            *(c.v for c in e.system.coordinates),
        ]
        arguments += [u.symbol for u in e.system.inputs] + [p.symbol for p in e.system.parameters]
        self._evaluate = sp.lambdify(
            arguments, expressions, modules="mpmath", dummify=True, cse=True
        )

    def _system(self, t, numbers):
        """K and r of K (a, lambda) = r; ``numbers``: y, then u, then p."""
        n, m = self.n, len(self.closures)
        values = [mpmath.mpf(x) for x in self._evaluate(mpmath.mpf(t), *numbers)]
        matrix, right = mpmath.zeros(n + m, n + m), mpmath.zeros(n + m, 1)
        for k, entry in enumerate(values[: n * n]):
            matrix[k // n, k % n] = entry
        for i, f in enumerate(values[n * n : n * n + n]):
            right[i] = f
        for k in range(m):
            start = n * n + n + k * (n + 1)
            *gradient, bias = values[start : start + n + 1]
            right[n + k] = -bias
            for i, g in enumerate(gradient):
                matrix[i, n + k], matrix[n + k, i] = -g, g
        return matrix, right

    def derivatives(self, t, y, u, p):
        """By y, by u and by p, shapes (n, 2n), (n, u), (n, p)."""
        with mpmath.workdps(DIGITS):
            numbers = [mpmath.mpf(float(x)) for x in (*y, *u, *p)]
            matrix, right = self._system(t, numbers)
            factors = mpmath.mp.LU_decomp(matrix)
            solved = _solution(factors, right)
            columns = [self._column(t, numbers, k, factors, solved) for k in range(len(numbers))]
        whole = np.array(columns).T.reshape(self.n, len(numbers))
        return np.split(whole, [len(y), len(y) + len(u)], axis=1)

    def _column(self, t, numbers, k, factors, solved):
        """K da = dr - dK a, with differences of K and r."""
        step = STEP * (abs(numbers[k]) or 1)
        moved = [[*numbers[:k], numbers[k] + s * step, *numbers[k + 1 :]] for s in (1, -1)]
        (up, right), (down, left) = (self._system(t, given) for given in moved)
        change = _solution(factors, right - left - (up - down) * solved)
        return [float(x / (2 * step)) for x in change[: self.n]]


def _solution(factors, right):
    triangles, rows = factors
    return mpmath.mp.U_solve(triangles, mpmath.mp.L_solve(triangles, right, rows))


def relative(found, exact):
    """The largest difference in each column over the largest derivative by that number, or over
    what rounding makes of the largest one of all."""
    sizes = np.maximum(np.abs(exact).max(axis=0), 1e-3 * np.abs(exact).max(initial=0.0))
    return np.abs(found - exact)[:, sizes > 0] / sizes[sizes > 0]
