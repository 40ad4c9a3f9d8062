"""High-precision values of Equations, straight from SymPy's expressions."""

from __future__ import annotations

import functools

import mpmath
import numpy as np
import sympy as sp

DIGITS = 40


class Reference:
    """Functions of (t, y, p) in mpmath; results are lists of mpf."""

    def __init__(self, equations):
        self.equations = equations
        e, n = equations, len(equations.coordinates)
        self.n = n
        arguments = [e.t, *(c.q for c in e.coordinates), *(c.v for c in e.coordinates)]
        arguments += [p.symbol for p in e.parameters]

        def function(expressions):
            compiled = sp.lambdify(
                arguments, list(expressions), modules="mpmath", cse=True, dummify=True
            )
            return functools.partial(self._evaluate, compiled)

        self.mass_matrix = function(m for row in e.mass_matrix for m in row)
        self.forcing = function(e.forcing)
        self.energy = function([e.kinetic, e.potential, e.energy])
        self.positions = function(c.position for c in e.cartesian_names)
        self.velocities = function(c.velocity for c in e.cartesian_names)

    @staticmethod
    def _evaluate(compiled, t, y, p):
        with mpmath.workdps(DIGITS):
            return [mpmath.mpf(x) for x in compiled(*map(mpmath.mpf, (t, *y, *p)))]

    def rhs(self, t, y, p):
        with mpmath.workdps(DIGITS):
            matrix = mpmath.matrix(self.n, self.n)
            for k, m in enumerate(self.mass_matrix(t, y, p)):
                matrix[k // self.n, k % self.n] = m
            a = mpmath.lu_solve(matrix, mpmath.matrix(self.forcing(t, y, p)))
            return [*map(mpmath.mpf, y[self.n :]), *a]

    def condition(self, t, y, p):
        entries = np.array([float(m) for m in self.mass_matrix(t, y, p)])
        return float(np.linalg.cond(entries.reshape(self.n, self.n)))


def exact(x):
    """A NumPy number of any precision as mpf."""
    with mpmath.workdps(DIGITS):
        return mpmath.mpf(np.format_float_scientific(x, unique=False, precision=35))


def difference(got, expected):
    """Largest difference, relative to the largest expected value."""
    assert len(got) == len(expected)
    with mpmath.workdps(DIGITS):
        scale = max([abs(x) for x in expected], default=0) or mpmath.mpf(1)
        errors = [abs(exact(a) - b) for a, b in zip(got, expected, strict=True)]
        return float(max(errors, default=0) / scale)


def states(equations, count=20, seed=1):
    """Random times, states and parameters, as doubles that single precision holds."""
    generator = np.random.default_rng(seed)
    n = len(equations.coordinates)
    for _ in range(count):
        t = np.float32(generator.uniform(0, 3))
        y = np.float32(generator.uniform(-2, 2, 2 * n))
        p = np.float32(generator.uniform(0.5, 2, len(equations.parameters)))
        yield float(t), y.astype(float), p.astype(float)
