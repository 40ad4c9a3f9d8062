"""Emitted functions of systems with closures, and what they are compared with."""

from __future__ import annotations

import ctypes

import mpmath
import numpy as np
import sympy as sp

from lagrange_cli.program.emitted_functions import constraint_programs
from lagrange_cli.program.program import build_program
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import DIGITS, Reference
from tests.emit.emitted_c import Compiled
from tests.parts import changed

TOLERANCE = {"float": 3e-5, "double": 1e-13, "long-double": 5e-17}


class Closed(Compiled):
    """Compiled functions with projection."""

    def project(self, t, y, p):
        y, p = (np.array(a, self.type) for a in (y, p))
        work = np.full(self.macro("WORK"), np.nan, self.type)
        c_type = {np.float32: ctypes.c_float, np.float64: ctypes.c_double}
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (y, p, work)]
        status = getattr(self.library, f"{self.prefix}_project")(
            c_type.get(self.type, ctypes.c_longdouble)(t), pointers[0], None, *pointers[1:]
        )
        return status, y


class Multipliers(Reference):
    """Accelerations and multipliers in mpmath."""

    def __init__(self, equations):
        super().__init__(equations)
        e = equations
        arguments = [
            e.system.t,
            *(c.q for c in e.system.coordinates),
            *(c.v for c in e.system.coordinates),
        ]
        arguments += [p.symbol for p in e.system.parameters]
        rows = [x for k in e.system.closures for x in (*k.gradient, k.bias, k.rate, k.expression)]
        self._rows = sp.lambdify(arguments, rows, modules="mpmath", dummify=True)

    def solve(self, t, y, p):
        n, m = self.n, len(self.equations.system.closures)
        rows = self._evaluate(self._rows, t, y, p)
        rows = [rows[k * (n + 3) : (k + 1) * (n + 3)] for k in range(m)]
        with mpmath.workdps(DIGITS):
            matrix, right = mpmath.zeros(n + m, n + m), mpmath.zeros(n + m, 1)
            for k, entry in enumerate(self.mass_matrix(t, y, p)):
                matrix[k // n, k % n] = entry
            for i, f in enumerate(self.forcing(t, y, p)):
                right[i] = f
            for k, (*gradient, bias, _, _) in enumerate(rows):
                right[n + k] = -bias
                for i, g in enumerate(gradient):
                    matrix[i, n + k], matrix[n + k, i] = -g, g
            found = list(mpmath.lu_solve(matrix, right))
            v = [mpmath.mpf(float(u)) for u in y[n:]]
            rates = [mpmath.fdot(row[:n], v) + row[n + 1] for row in rows]
        positions = [k.kind == "position" for k in self.equations.system.closures]
        phi = [row[-1] for row, of in zip(rows, positions, strict=True) if of]
        return [*v, *found[:n]], found[n:], [*phi, *rates]


CASES = {
    "pendulum": closures.pendulum,
    "sleigh": closures.sleigh,
    "moving_circle": closures.moving_circle,
    "chain2": lambda: closures.chain(2),
    "chain8": lambda: closures.chain(8),
}


def random_states(equations, count=5):
    generator = np.random.default_rng(3)
    n = len(equations.system.coordinates)
    for _ in range(count):
        t = float(np.float32(generator.uniform(0, 3)))
        y = np.float32(generator.uniform(-2, 2, 2 * n)).astype(float)
        p = np.float32(generator.uniform(0.5, 2, len(equations.system.parameters))).astype(float)
        yield t, y, p


def massless():
    """A mass that a pointer without inertia follows: θ = atan2(z, x), and another pointer."""
    equations = closures.pendulum()
    pointer, hand = systems.coordinate("theta"), systems.coordinate("phi")
    of = [*equations.system.coordinates, pointer, hand]
    x, z = (c.q for c in equations.system.coordinates)
    row = (sp.Integer(0),) * 4
    m = equations.system.parameters[0].symbol
    mass = [(*row[:i], m, *row[i + 1 :]) for i in range(2)]
    phi = [
        closures.closure("rod", equations.system.closures[0].expression, of),
        closures.closure("pointer", x * sp.sin(pointer.q) - z * sp.cos(pointer.q), of),
        closures.closure("hand", 1000 * sp.sin(hand.q) - sp.sin(systems.T), of),
    ]
    return changed(
        equations,
        name="pointer",
        coordinates=tuple(of),
        mass_matrix=(*mass, row, row),
        forcing=(*equations.system.forcing, sp.Integer(0), sp.Integer(0)),
        closures=tuple(phi),
    )


def simulation_programs(equations):
    return {
        "rhs": build_program(equations, ["acceleration"]),
        **constraint_programs(equations),
    }
