"""Values of a scene's functions from its symbolic equations, with the sums of their magnitudes.

Numbers have 40 digits and carry a *size*: the first-order bound of the error of an evaluation in
rounded arithmetic, over the rounding error. The size of a sum is the sum of the sizes of its terms,
that of f(x) is |f(x)| + |f'(x)| size(x); see N. Higham, *Accuracy and Stability of Numerical
Algorithms* (2002), chapter 3.
"""

from __future__ import annotations

import json
import math
import os
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import mpmath
import numpy as np
import sympy as sp

from lagrange_cli.mechanics.tabulated import Tabulated, in_pieces
from lagrange_cli.simulate import simulate
from tests.emit.derivative_reference import AccelerationReference

DIGITS = 40

#: Distance of a difference that stands for a derivative, relative to its place.
_STEP = mpmath.mpf("1e-15")

#: Functions that modules have even where they return nothing.
_EVERYWHERE = ("positions", "velocities")

#: Random states of a scene, besides its start.
STATES = 3


class Sized:
    """A number of many digits with the size of its rounding error."""

    def __init__(self, value, size=None):
        self.value = mpmath.mpmathify(value)
        self.size = abs(self.value) if size is None else size

    def __add__(self, other):
        other = sized(other)
        return Sized(self.value + other.value, self.size + other.size)

    def __mul__(self, other):
        other = sized(other)
        size = abs(self.value) * other.size + abs(other.value) * self.size
        return Sized(self.value * other.value, size)

    def __truediv__(self, other):
        other = sized(other)
        value = self.value / other.value
        return Sized(value, (self.size + abs(value) * other.size) / abs(other.value))

    def __neg__(self):
        return Sized(-self.value, self.size)

    def __sub__(self, other):
        return self + (-sized(other))

    def __rsub__(self, other):
        return sized(other) - self

    def __rtruediv__(self, other):
        return sized(other) / self

    def __pow__(self, other):
        return _applied(lambda x, y: x**y)(self, other)

    def __rpow__(self, other):
        return sized(other) ** self

    __radd__, __rmul__ = __add__, __mul__


def sized(number):
    """A number with the size of its own rounding."""
    return number if isinstance(number, Sized) else Sized(number)


def _applied(function):
    """A function of mpmath's numbers as one of sized numbers."""

    def of_sized(*arguments):
        arguments = [sized(x) for x in arguments]
        values = [x.value for x in arguments]
        value = function(*values)
        size = abs(value)
        for k, x in enumerate(arguments):
            if x.size:
                step = _STEP * (abs(x.value) or 1)
                moved = function(*values[:k], x.value + step, *values[k + 1 :])
                size += abs(moved - value) / step * x.size
        return Sized(value, size)

    return of_sized


_NAMES = "sin cos tan asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp log sqrt"
_FUNCTIONS = {
    **{name: _applied(getattr(mpmath, name)) for name in _NAMES.split()},
    **{name: _applied(abs) for name in ("abs", "Abs")},
    "sign": _applied(mpmath.sign),
    **{name: _applied(min) for name in ("min", "Min")},
    **{name: _applied(max) for name in ("max", "Max")},
    "Cases": _applied(lambda v, s, strict, w: v if s > 0 or (s == 0 and not strict) else w),
    "Heaviside": _applied(lambda x, *_: (1 + mpmath.sign(x)) / 2),
}


@dataclass(frozen=True)
class Call:
    """A function at a state, and what it must return.

    Attributes
    ----------
    function
        Its name.
    t, y, p, u
        What it is given.
    expected, sizes
        Its results, each with the size of its rounding error.
    mode, event
        With contacts: the mode, all open if it is empty; event and bounce of a reset.
    """

    function: str
    t: float
    y: tuple[float, ...]
    p: tuple[float, ...]
    u: tuple[float, ...]
    expected: tuple[float, ...]
    sizes: tuple[float, ...]
    mode: tuple[int, ...] = ()
    event: tuple[float, ...] = ()

    def errors(self, results):
        """Return the errors of results, relative to their sizes; infinity for NaN."""
        assert len(results) == len(self.expected), self.function
        errors = []
        for x, exact, size in zip(results, self.expected, self.sizes, strict=True):
            error = abs(x - exact)
            errors.append(0.0 if error == 0 else error / size if size and error >= 0 else math.inf)
        return errors

    def wrong(self, results, tolerance):
        """Say which result is off; None if none is."""
        if len(results) != len(self.expected):
            return f"{self.function}: {len(results)} results, not {len(self.expected)}"
        for k, error in enumerate(self.errors(results)):
            if not error <= tolerance:
                place = f"{self.function}[{k}] at t = {self.t}"
                return f"{place}: {results[k]} is not {self.expected[k]}, off by {error:.1e}"
        return None


def calls(equations):
    """Every function of a scene at its start and at random states near it."""
    rows = _computed_once(equations, "calls", lambda: [vars(call) for call in _calls(equations)])
    return [Call(**{k: tuple(v) if type(v) is list else v for k, v in r.items()}) for r in rows]


def derivatives(equations):
    """Derivatives of the right-hand side near the start, from differences in 60 digits."""
    ((t, y, p),) = islice(_states(equations), 1, 2)
    u = (0.25,) * len(equations.system.inputs)
    exact = AccelerationReference(equations).derivatives(t, y, u, p)
    n = len(equations.system.coordinates)
    velocities = [np.eye(n, 2 * n, n), np.zeros((n, len(u))), np.zeros((n, len(p)))]
    rows = []
    for name, above, below in zip(
        ("jacobian", "jacobian_u", "jacobian_p"), velocities, exact, strict=True
    ):
        whole = np.vstack([above, below])
        largest = np.maximum(np.abs(whole).max(0, initial=0), 1e-3 * np.abs(whole).max(initial=0))
        sizes = np.broadcast_to(largest, whole.shape)
        if whole.size:
            expected = tuple(map(float, whole.ravel()))
            rows.append(Call(name, t, y, p, u, expected, tuple(map(float, sizes.ravel()))))
    return rows


def states_at(equations, times):
    """States of the simulation at some times."""
    return _computed_once(equations, "states", lambda: _simulated(equations, times))


def _computed_once(equations, what, compute):
    """Return what a function computes, once for all processes of a run."""
    folder = Path(os.environ["XDG_CACHE_HOME"]) / "test-references"
    system = equations.system
    kind = f"{len(system.coordinates)}-{len(system.closures)}-{len(system.parameters)}"
    name = f"{equations.presentation.name}-{equations.presentation.digest}"
    path = folder / f"{name}-{kind}-{what}.json"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        own = path.with_suffix(f".{os.getpid()}")
        own.write_text(json.dumps(compute()))
        own.replace(path)
    return json.loads(path.read_text())


def _simulated(equations, times):
    motion = simulate(equations, accuracy=1e-9, times=times)
    columns = [motion.columns[name] for name in equations.system.state_names]
    return [[float(column[k]) for column in columns] for k, _ in enumerate(times)]


def _calls(equations):
    with mpmath.workdps(DIGITS):
        values = _Values(equations)
        return [call for state in _states(equations) for call in _at(equations, values, *state)]


def _states(equations):
    """The start and random states: time, state, parameters."""
    system, random = equations.system, np.random.default_rng(7)
    size = system.layout.size
    start = [0.3] * size
    if system.initial is not None:
        start = [*system.initial.numbers]
    values = [1.0 if p.value is None else p.value for p in system.parameters]
    t = system.simulate.start
    yield float(t), tuple(start), tuple(values)
    for _ in range(STATES):
        y = np.array(start) + random.uniform(-0.2, 0.2, size)
        p = np.array(values) * random.uniform(0.97, 1.03, len(values))
        yield float(t + random.uniform(0, 3)), tuple(map(float, y)), tuple(map(float, p))


def _without_tables(expression):
    """The same with polynomials in cases for each function of a table."""
    return expression.xreplace({f: in_pieces(f) for f in expression.atoms(Tabulated)})


class _Values:
    """Everything that the functions of a scene are made of, as sized numbers."""

    def __init__(self, equations):
        s = equations.system
        recorded = any(u.expression is None for u in s.inputs)
        parts = {
            "mass_matrix": [m for row in s.mass_matrix for m in row],
            "forcing": s.forcing,
            "energy": [s.energy],
            "positions": [c.position for c in s.cartesian_names],
            "velocities": [c.velocity for c in s.cartesian_names],
            "outputs": [expression for _, expression in s.outputs],
            "gradients": [g for c in s.closures for g in c.gradient],
            "biases": [c.bias for c in s.closures],
            "closures": [c.expression for c in s.closures if c.kind == "position"],
            "rates": [c.rate for c in s.closures],
            "state_rates": [state.rate for state in s.states],
            "switches": [z.switch.until(z.symbol) for z in s.switches],
            "inputs": [] if recorded else [u.expression for u in s.inputs],
        }
        arguments = [s.t, *s.state_symbols]
        arguments += [x.symbol for x in (*s.parameters, *s.inputs)]
        arguments += [*(c.a for c in s.coordinates), *(c.multiplier for c in s.closures)]
        plain = {symbol: sp.Symbol(f"x{k}", real=True) for k, symbol in enumerate(arguments)}
        expressions = [sp.sympify(x) for part in parts.values() for x in part]
        self.present = [k for k, x in enumerate(expressions) if x != 0]
        expressions = [_without_tables(expressions[k]).xreplace(plain) for k in self.present]
        modules = [_FUNCTIONS, "mpmath"]
        self.counts = {name: len(part) for name, part in parts.items()}
        self.unknowns = len(s.coordinates) + len(s.closures)
        self.function = sp.lambdify(list(plain.values()), expressions, modules, cse=True)

    def __call__(self, t, y, p, u, unknowns=None):
        given = (t, *y, *p, *u, *(unknowns or [0.0] * self.unknowns))
        everything = [sized(0)] * sum(self.counts.values())
        for k, x in zip(self.present, self.function(*map(sized, given)), strict=True):
            everything[k] = sized(x)
        values = iter(everything)
        return {name: [next(values) for _ in range(k)] for name, k in self.counts.items()}


def _at(equations, values_at, t, y, p):
    """Yield the calls at a state, but those that are not real or not finite there."""
    s = equations.system
    n, m = len(s.coordinates), len(s.closures)
    inputs = values_at(t, y, p, [0.0] * len(s.inputs))["inputs"] if s.inputs else []
    # Those from a file are any numbers.
    u = tuple(float(x.value) + 0.25 for x in inputs) or (0.25,) * len(s.inputs)
    values = values_at(t, y, p, u)
    solution = _solved(values, n, m)
    if solution is None:
        del values["outputs"]
    else:
        values["rhs"] = [*map(Sized, y[n : 2 * n]), *solution[:n], *values["state_rates"]]
        values["multipliers"] = solution[n:]
        if s.outputs:
            values["outputs"] = values_at(t, y, p, u, solution)["outputs"]
    gradients = [values["gradients"][k * n : (k + 1) * n] for k in range(m)]
    rates = [
        sum((g * x for g, x in zip(row, map(Sized, y[n : 2 * n]), strict=True)), rate)
        for row, rate in zip(gradients, values["rates"], strict=True)
    ]
    values["constraints"] = [*values["closures"], *rates]
    for name in ("gradients", "biases", "closures", "rates", "state_rates"):
        del values[name]
    for name, results in values.items():
        if (results or name in _EVERYWHERE) and all(_is_real(x) for x in results):
            expected = tuple(float(x.value) for x in results)
            sizes = tuple(float(x.size) for x in results)
            yield Call(name, t, y, p, u, expected, sizes)


def _is_real(x):
    return all(isinstance(z, mpmath.mpf) and mpmath.isfinite(z) for z in (x.value, x.size))


def _solved(values, n, m):
    """Accelerations and multipliers, None where they are not determined.

    Rounding of the matrix and of the right-hand side changes them by no more than
    |A⁻¹| (size(A) |x| + size(b)) (Higham, theorem 7.4).
    """
    entries, right = values["mass_matrix"], [*values["forcing"], *(-b for b in values["biases"])]
    size, zero = n + m, Sized(0)
    matrix = [[zero] * size for _ in range(size)]
    for i in range(n):
        matrix[i][:n] = entries[i * n : (i + 1) * n]
    for k in range(m):
        for i, g in enumerate(values["gradients"][k * n : (k + 1) * n]):
            matrix[n + k][i], matrix[i][n + k] = g, -g
    if not all(_is_real(x) for x in (*right, *(x for row in matrix for x in row))):
        return None
    a = np.array([[x.value for x in row] for row in matrix])
    b = np.array([x.value for x in right])
    inverse = _inverse(a.astype(float))
    if inverse is None:
        return None
    x = np.array([mpmath.mpf(0)] * size)
    for _ in range(6):
        x = x + inverse @ (b - a @ x)
    sizes_of_a = np.array([[float(x.size) for x in row] for row in matrix])
    sizes_of_b = np.array([float(x.size) for x in right])
    bound = np.abs(inverse) @ (sizes_of_a @ np.abs(x.astype(float)) + sizes_of_b)
    return [
        Sized(value, abs(value) + mpmath.mpf(extra)) for value, extra in zip(x, bound, strict=True)
    ]


def _inverse(a):
    """The inverse of a matrix that is regular once its rows and columns are scaled, else None."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rows = 1 / np.abs(a).max(1, initial=0)
        columns = 1 / np.abs(a * rows[:, None]).max(0, initial=0)
        scaled = a * rows[:, None] * columns
    if not np.isfinite(scaled).all() or np.linalg.cond(scaled) > 1e12:
        return None
    return np.linalg.inv(scaled) * columns[:, None] * rows
