"""High-precision values of Equations, straight from SymPy's expressions."""

from __future__ import annotations

import functools

import mpmath
import numpy as np
import sympy as sp

DIGITS = 40


#: Functions of the program's own.
_OWN = {"Cases": lambda v, s, strict, w: v if s > 0 or (s == 0 and not strict) else w}


class Reference:
    """Functions of (t, y, p) in mpmath; results are lists of mpf."""

    def __init__(self, equations):
        self.equations, self.n = equations, len(equations.system.coordinates)

    def _function(self, expressions):
        e = self.equations
        arguments = [
            e.system.t,
            *(c.q for c in e.system.coordinates),
            *(c.v for c in e.system.coordinates),
        ]
        arguments += [p.symbol for p in e.system.parameters]
        compiled = sp.lambdify(
            arguments, list(expressions), modules=[_OWN, "mpmath"], cse=True, dummify=True
        )
        return functools.partial(self._evaluate, compiled)

    # Each is made when it is first asked for: few tests ask for all.

    @functools.cached_property
    def mass_matrix(self):
        return self._function(m for row in self.equations.system.mass_matrix for m in row)

    @functools.cached_property
    def forcing(self):
        return self._function(self.equations.system.forcing)

    @functools.cached_property
    def energy(self):
        e = self.equations
        return self._function([e.system.kinetic, e.system.potential, e.system.energy])

    @functools.cached_property
    def positions(self):
        return self._function(c.position for c in self.equations.system.cartesian_names)

    @functools.cached_property
    def velocities(self):
        return self._function(c.velocity for c in self.equations.system.cartesian_names)

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
    n = len(equations.system.coordinates)
    for _ in range(count):
        t = np.float32(generator.uniform(0, 3))
        y = np.float32(generator.uniform(-2, 2, 2 * n))
        p = np.float32(generator.uniform(0.5, 2, len(equations.system.parameters)))
        yield float(t), y.astype(float), p.astype(float)
