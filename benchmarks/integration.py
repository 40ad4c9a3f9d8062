"""Time to integrate the double pendulum at equal measured error, side by side with peers.

All parameters 1, g = 9.81, released at (1.5, 2.0), 10 s. The error is the
largest over 501 samples of any angle in radians and of any angular velocity
over its largest value, against a Taylor series in 30 decimal digits (mpmath).
Each solver is run over a range of tolerances, atol = rtol/100, in one
process, the solvers taking turns and garbage collection off; compilation is
not timed. The time at an error is interpolated between the runs that enclose
it, on the logarithms.

    python benchmarks/integration.py --json integration.json

heyoka takes part where it is installed.
"""

from __future__ import annotations

import argparse
import gc
import importlib.util
import itertools
import json
import math
import platform
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from lagrange_cli import loads
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.modelling import model_of
from lagrange_cli.simulate.problem import InitialValueProblem
from lagrange_cli.simulate.right_hand_side import right_hand_side
from lagrange_cli.simulate.run import Run

Array = NDArray[np.float64]
GRAVITY = 9.81
START = (1.5, 2.0, 0.0, 0.0)
ERRORS = (1e-6, 1e-9, 1e-12)
SCENE = f"""
name: double_pendulum
parameters: {{m1: 1, m2: 1, l1: 1, l2: 1, g: {GRAVITY}}}
plane: xz
particles:
  upper: {{mass: m1, position: [x1, y1, z1]}}
  lower: {{mass: m2, position: [x2, y2, z2]}}
coordinates: [theta1, theta2]
definitions:
  x1: l1*sin(theta1)
  z1: -l1*cos(theta1)
  x2: x1 + l2*sin(theta2)
  z2: z1 - l2*cos(theta2)
potentials: {{weight: {{gravity: g}}}}
initial: {{theta1: {START[0]}, theta2: {START[1]}}}
"""


@dataclass(frozen=True)
class Solver:
    """``run(tolerance)`` gives the states at the samples, shape (samples, 4)."""

    name: str
    tolerances: tuple[float, ...]
    run: Callable[[float], Array]


def acceleration(y: Sequence[Any], sin: Callable[..., Any], cos: Callable[..., Any]) -> list[Any]:
    """The double pendulum's equations, written by hand."""
    a, b, u, v = y
    s, c = sin(a - b), cos(a - b)
    f = -(v**2) * s - 2 * GRAVITY * sin(a)
    g = u**2 * s - GRAVITY * sin(b)
    determinant = 1 + s**2
    return [u, v, (f - c * g) / determinant, (2 * g - c * f) / determinant]


def reference(times: Array) -> Array:
    """The exact states to all digits of a double."""
    with mpmath.workdps(30):
        solution = mpmath.odefun(
            lambda t, y: acceleration(y, mpmath.sin, mpmath.cos),
            0,
            [mpmath.mpf(value) for value in START],
        )
        return np.array([[float(value) for value in solution(mpmath.mpf(t))] for t in times])


def powers(first: int, last: int, *, halves: bool = False) -> tuple[float, ...]:
    """Powers of ten from 10^first down to 10^last."""
    step = 0.5 if halves else 1.0
    return tuple(10.0**x for x in np.arange(first, last - step / 2, -step))


def lagrange_solver(times: Array, method: str) -> Solver:
    functions = right_hand_side(model_of(loads(SCENE).derive().equations))
    if not functions.implementation.startswith("compiled"):
        raise SystemExit(functions.implementation)
    problem = InitialValueProblem(functions.rhs, np.array(START), times, ("angle", "angle"))

    def run(tolerance: float) -> Array:
        control = Control(np.full(4, tolerance), np.full(4, tolerance / 100), 1e-3, 10.0)
        ours = Run(INTEGRATORS[method], problem, control)
        ours.advance(len(times), sys.maxsize)
        return ours.states

    # Steps of the implicit method do not converge to less than rounding.
    last = -13 if method == "Gauss16" else -16
    return Solver(f"lagrange, {method}", powers(-3, last, halves=True), run)


def lambdified() -> Callable[[float, Array], Array]:
    """SymPy's equations through lambdify, solved by NumPy at every evaluation."""
    a, b, u, v = sympy.symbols("a b u v")
    matrix = [[2, sympy.cos(a - b)], [sympy.cos(a - b), 1]]
    forcing = [
        -(v**2) * sympy.sin(a - b) - 2 * GRAVITY * sympy.sin(a),
        u**2 * sympy.sin(a - b) - GRAVITY * sympy.sin(b),
    ]
    compute = sympy.lambdify([a, b, u, v], [matrix, forcing], "numpy", cse=True)

    def rhs(t: float, y: Array) -> Array:
        m, f = compute(*y)
        return np.concatenate([y[2:], np.linalg.solve(m, f)])

    return rhs


def scipy_solver(times: Array, method: str, last: int) -> Solver:
    rhs = lambdified()

    def run(tolerance: float) -> Array:
        how = {"rtol": tolerance, "atol": tolerance / 100}
        found = solve_ivp(rhs, (0, times[-1]), START, method=method, t_eval=times, **how)
        return np.asarray(found.y.T)

    return Solver(f"SciPy {method} over lambdify", powers(-5, last), run)


def heyoka_solver(times: Array) -> Solver:
    import heyoka

    names = heyoka.make_vars("a", "b", "u", "v")
    rates = acceleration(names, heyoka.sin, heyoka.cos)
    system = list(zip(names, rates, strict=True))
    compiled: dict[float, Any] = {}

    def run(tolerance: float) -> Array:
        if tolerance not in compiled:
            compiled[tolerance] = heyoka.taylor_adaptive(system, list(START), tol=tolerance)
        integrator = compiled[tolerance]
        integrator.time = 0.0
        integrator.state[:] = START
        return np.asarray(integrator.propagate_grid(times)[-1])

    return Solver("heyoka", (*powers(-4, -15), 2.3e-16), run)


def solvers(times: Array) -> list[Solver]:
    found = [lagrange_solver(times, "Gauss16"), lagrange_solver(times, "DOP853")]
    found.append(scipy_solver(times, "DOP853", -13))
    found.append(scipy_solver(times, "LSODA", -12))
    if importlib.util.find_spec("heyoka"):
        found.append(heyoka_solver(times))
    return found


def timed(run: Callable[[float], Array], tolerance: float) -> float:
    """Seconds of one run with warm caches."""
    gc.collect()
    gc.disable()
    run(tolerance)
    started = time.perf_counter()
    run(tolerance)
    seconds = time.perf_counter() - started
    gc.enable()
    return seconds


def measure(candidates: list[Solver], exact: Array, repetitions: int) -> list[dict[str, Any]]:
    """Error and median seconds of every solver at each of its tolerances."""
    scales = np.concatenate([np.ones(2), np.abs(exact[:, 2:]).max(axis=0)])
    jobs = [(solver, tolerance) for solver in candidates for tolerance in solver.tolerances]
    errors = [float((np.abs(s.run(x) - exact) / scales).max()) for s, x in jobs]
    seconds: list[list[float]] = [[] for _ in jobs]
    for turn in range(repetitions):
        for number, (solver, tolerance) in enumerate(jobs):
            # What takes long is repeated less often.
            if turn < 3 or seconds[number][0] < 0.02:
                seconds[number].append(timed(solver.run, tolerance))
    return [
        {
            "solver": solver.name,
            "rtol": tolerance,
            "error": error,
            "seconds": statistics.median(of),
            "fastest": min(of),
            "slowest": max(of),
        }
        for (solver, tolerance), error, of in zip(jobs, errors, seconds, strict=True)
    ]


def seconds_at(rows: Iterable[dict[str, Any]], error: float) -> float | None:
    """Least time at an error, between two runs that enclose it; None where none does."""
    points = sorted((row["error"], row["seconds"]) for row in rows)
    found = []
    for (e0, s0), (e1, s1) in itertools.pairwise(points):
        if e0 <= error <= e1:
            part = math.log(error / e0) / math.log(e1 / e0) if e1 > e0 else 0.0
            found.append(s0 * (s1 / s0) ** part)
    return min(found, default=None)


def table(rows: list[dict[str, Any]], names: list[str]) -> str:
    """Markdown: a row a solver, milliseconds at each error, and how many times ours that is."""
    of = {name: [row for row in rows if row["solver"] == name] for name in names}
    lines = ["| solver | smallest error | " + " | ".join(f"{e:g}" for e in ERRORS) + " |"]
    lines.append("|---" * (len(ERRORS) + 2) + "|")
    ours = [seconds_at(of[names[0]], error) for error in ERRORS]
    for name in names:
        cells = []
        for error, own in zip(ERRORS, ours, strict=True):
            found = seconds_at(of[name], error)
            if found is None:
                cells.append("–")
            else:
                ratio = f" ({found / own:.3g}×)" if own else ""
                cells.append(f"{1e3 * found:.3g} ms{ratio}")
        smallest = min(row["error"] for row in of[name])
        lines.append(f"| {name} | {smallest:.1e} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=31)
    parser.add_argument("--until", type=float, default=10.0)
    parser.add_argument("--samples", type=int, default=501)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    times = np.linspace(0.0, options.until, options.samples)
    candidates = solvers(times)
    rows = measure(candidates, reference(times), options.repetitions)
    print(table(rows, [solver.name for solver in candidates]))
    if options.json:
        about = {"python": platform.python_version(), "machine": platform.machine()}
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"about": about, "rows": rows}, file, indent=1)
    return 0


if __name__ == "__main__":
    sys.exit(main())
