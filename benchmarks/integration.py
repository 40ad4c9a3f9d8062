"""Time to integrate the double pendulum at equal measured error, side by side with peers.

All parameters 1, g = 9.81, released at (1.5, 2.0), 10 s. The error is the
largest over 501 samples of any angle in radians and of any angular velocity
over its largest value, against a Taylor series in 30 decimal digits. Each
solver is run at a range of tolerances, atol = rtol/100, in one process, garbage
collection off, all in another order each turn; compilation is not timed. Errors
wander; they are made to fall with the tolerance (monotone regression of their
logarithms), and the time at an error is interpolated, on logarithms, between
the two that enclose it. That and its ratio to the first solver's are found in
every turn.

    python benchmarks/integration.py --json integration.json

heyoka takes part where it is installed, as it comes and with its fast_math.
"""

from __future__ import annotations

import argparse
import gc
import importlib.util
import itertools
import json
import math
import os
import platform
import random
import shutil
import statistics
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import sympy
from double_pendulum import GRAVITY, SCENE, Array, Release, reference, reference_error, slopes
from scipy.integrate import solve_ivp

from lagrange_cli import loads
from lagrange_cli.simulate.integrators import INTEGRATORS, Control
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.runs.run import Run
from lagrange_cli.simulate.system.functions import right_hand_side
from lagrange_cli.toolchain.compiler import processor

ERRORS = (1e-6, 1e-9, 1e-12)

#: A run that needs more right-hand sides, or a twentieth of that in Taylor steps, is cut.
MOST_EVALUATIONS = 200_000
EVALUATIONS_OF_A_STEP = 20

#: Seconds of one timing: shorter runs are repeated within it. What takes longer than SLOW is
#: timed in one turn of SELDOM.
LENGTH, SLOW, SELDOM = 2e-3, 1e-2, 10


class CutError(Exception):
    """A run came to the bound of its work before its end."""


@dataclass(frozen=True)
class Solver:
    """``run(tolerance)`` gives the states at the samples, shape (samples, 4).

    It raises CutError where it would take too long.
    """

    name: str
    tolerances: tuple[float, ...]
    run: Callable[[float], Array]


# -- solvers ------------------------------------------------------------------


def powers(first: float, last: float, part: float) -> tuple[float, ...]:
    """Powers of ten from 10^first down to 10^last in steps of a ``part`` of a decade."""
    return tuple(10.0**x for x in np.arange(first, last - part / 2, -part))


def lagrange_solver(times: Array, release: Release, method: str) -> Solver:
    equations = loads(SCENE % (GRAVITY, *release)).derive().equations
    rhs = right_hand_side(model_of(equations)).rhs
    problem = InitialValueProblem(rhs, np.array([*release, 0.0, 0.0]), times, ("angle", "angle"))

    def run(tolerance: float) -> Array:
        control = Control(np.full(4, tolerance), np.full(4, tolerance / 100), 1e-3, times[-1])
        ours = Run(INTEGRATORS[method], problem, control)
        ours.advance(len(times), sys.maxsize, MOST_EVALUATIONS)
        if len(ours.states) < len(times):
            raise CutError
        return ours.states

    return Solver(f"lagrange, {method}", powers(-4, -14, 0.25), run)


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


def scipy_solver(times: Array, release: Release, method: str) -> Solver:
    plain, start = lambdified(), (*release, 0.0, 0.0)

    def run(tolerance: float) -> Array:
        calls = itertools.count(1)

        def rhs(t: float, y: Array) -> Array:
            if next(calls) > MOST_EVALUATIONS:
                raise CutError
            return plain(t, y)

        how: dict[str, Any] = {"method": method, "rtol": tolerance, "atol": tolerance / 100}
        found = solve_ivp(rhs, (0.0, times[-1]), start, t_eval=times, **how)
        if not found.success:
            raise CutError
        return np.asarray(found.y.T)

    return Solver(f"SciPy {method} over lambdify", powers(-5, -13, 0.5), run)


def heyoka_solver(times: Array, release: Release, **options: Any) -> Solver:
    import heyoka

    names = heyoka.make_vars("a", "b", "u", "v")
    rates = slopes(names, heyoka.sin, heyoka.cos)
    system, start = list(zip(names, rates, strict=True)), [*release, 0.0, 0.0]
    compiled: dict[float, Any] = {}

    def run(tolerance: float) -> Array:
        if tolerance not in compiled:
            compiled[tolerance] = heyoka.taylor_adaptive(system, start, tol=tolerance, **options)
        integrator = compiled[tolerance]
        integrator.time = 0.0
        integrator.state[:] = start
        most = MOST_EVALUATIONS // EVALUATIONS_OF_A_STEP
        outcome, *_, states = integrator.propagate_grid(times, max_steps=most)
        if outcome != heyoka.taylor_outcome.time_limit:
            raise CutError
        return np.asarray(states)

    name = ", ".join(["heyoka", *options])
    return Solver(name, powers(-4, -15, 0.25), run)


def solvers(times: Array, release: Release) -> list[Solver]:
    found = [lagrange_solver(times, release, method) for method in ("Gauss16", "DOP853")]
    found += [scipy_solver(times, release, method) for method in ("DOP853", "LSODA")]
    if importlib.util.find_spec("heyoka"):
        found.append(heyoka_solver(times, release))
        found.append(heyoka_solver(times, release, fast_math=True))
    return found


# -- measuring ----------------------------------------------------------------


def timed(run: Callable[[float], Array], tolerance: float, count: int) -> float:
    """Seconds of one run of ``count``, after one to warm the caches where runs are short."""
    if count > 1:
        run(tolerance)
    started = time.perf_counter()
    for _ in range(count):
        run(tolerance)
    return (time.perf_counter() - started) / count


def error_row(solver: Solver, tolerance: float, exact: Array) -> dict[str, Any]:
    """The error of a solver at one tolerance, None where the run was cut."""
    scales = np.concatenate([np.ones(2), np.abs(exact[:, 2:]).max(axis=0)])
    row = {"solver": solver.name, "rtol": tolerance, "error": None, "seconds": {}}
    try:
        row["error"] = float((np.abs(solver.run(tolerance) - exact) / scales).max())
    except CutError:
        print(f"{solver.name} at rtol {tolerance:.1e} was cut", file=sys.stderr)
    return row


def measure(candidates: list[Solver], exact: Array, turns: int) -> list[dict[str, Any]]:
    """Error of every solver at each of its tolerances, and its seconds: turn → s."""
    jobs = [
        (solver.run, error_row(solver, tolerance, exact))
        for solver in candidates
        for tolerance in solver.tolerances
    ]
    complete = [(run, row) for run, row in jobs if row["error"] is not None]
    once = [min(timed(run, row["rtol"], 1) for _ in range(2)) for run, row in complete]
    order = list(range(len(complete)))
    gc.collect()
    gc.disable()
    for turn in range(turns):
        random.Random(turn).shuffle(order)
        for number in order:
            run, row = complete[number]
            if once[number] < SLOW or turn % SELDOM == 0:
                count = max(1, round(LENGTH / once[number]))
                row["seconds"][turn] = timed(run, row["rtol"], count)
    gc.enable()
    return [row for _, row in jobs]


def falling(errors: Sequence[float]) -> list[float]:
    """Errors at ever smaller tolerances made to fall: where they do not, neighbours share their
    geometric mean. It is the monotone regression of the logarithms (pool adjacent violators)."""
    pools: list[tuple[float, int]] = []
    for error in errors:
        mean, count = math.log(error), 1
        while pools and pools[-1][0] <= mean:
            before, many = pools.pop()
            mean, count = (before * many + mean * count) / (many + count), many + count
        pools.append((mean, count))
    return [math.exp(mean) for mean, count in pools for _ in range(count)]


def seconds_at(points: Sequence[tuple[float, float]], error: float) -> float | None:
    """Seconds at an error, between the two of ``points`` (error, seconds) that enclose it."""
    for (e0, s0), (e1, s1) in itertools.pairwise(points):
        if e0 > e1 and e0 >= error >= e1:
            return float(s0 * (s1 / s0) ** (math.log(error / e0) / math.log(e1 / e0)))
    return None


def spread(values: Sequence[float]) -> dict[str, Any]:
    """Median and quartiles."""
    low, median, high = statistics.quantiles(values, n=4) if len(values) > 1 else [values[0]] * 3
    return {"median": median, "quartiles": [low, high]}


@dataclass(frozen=True)
class Curve:
    """Errors of one solver, made to fall, and the seconds of each: turn → s."""

    errors: list[float]
    seconds: list[dict[int, float]]

    def at(self, error: float) -> dict[int, float]:
        """Seconds at an error: turn → s, of those in which all was timed."""
        common = set.intersection(*map(set, self.seconds)) if self.seconds else set()
        found = {turn: self._between([s[turn] for s in self.seconds], error) for turn in common}
        return {turn: seconds for turn, seconds in sorted(found.items()) if seconds is not None}

    def fastest_at(self, error: float) -> float | None:
        """Seconds at an error, of the fastest run at each tolerance."""
        return self._between([min(s.values()) for s in self.seconds], error)

    def _between(self, seconds: list[float], error: float) -> float | None:
        return seconds_at(list(zip(self.errors, seconds, strict=True)), error)


def curves(rows: Iterable[dict[str, Any]]) -> dict[str, Curve]:
    """Of each solver, from the runs that were not cut."""
    complete: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        complete.setdefault(row["solver"], []).extend([row] if row["seconds"] else [])
    return {
        name: Curve(falling([r["error"] for r in own]), [r["seconds"] for r in own])
        for name, own in complete.items()
    }


def summarized(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Seconds of each solver at each error, and how many times those of the first solver."""
    of, found = curves(rows), []
    first = next(iter(of.values()))
    for error, (name, curve) in itertools.product(ERRORS, of.items()):
        smallest = curve.errors[-1] if curve.errors else math.inf
        entry: dict[str, Any] = {"solver": name, "error": error, "reached": smallest <= error}
        entry["smallest_error"] = smallest if curve.errors else None
        own, ours = curve.at(error), first.at(error)
        fastest, our_fastest = curve.fastest_at(error), first.fastest_at(error)
        if own:
            entry |= {"seconds": spread(list(own.values())), "fastest": fastest}
        both = [own[turn] / ours[turn] for turn in own if turn in ours]
        if both and fastest and our_fastest:
            entry |= {"ratio": spread(both), "fastest_ratio": fastest / our_fastest}
        found.append(entry)
    return found


# -- the answer ---------------------------------------------------------------


def table(summary: list[dict[str, Any]], cell: Callable[[dict[str, Any]], str]) -> str:
    """Markdown: a row a solver, a column an error."""
    lines = ["| solver | " + " | ".join(f"{error:g}" for error in ERRORS) + " |"]
    lines.append("|---" * (len(ERRORS) + 1) + "|")
    for name in dict.fromkeys(entry["solver"] for entry in summary):
        cells = [cell(entry) for entry in summary if entry["solver"] == name]
        lines.append("| " + " | ".join([name, *cells]) + " |")
    return "\n".join(lines)


def milliseconds(entry: dict[str, Any]) -> str:
    if "seconds" not in entry and entry["reached"]:
        return "smaller at every rtol"
    if "seconds" not in entry:
        smallest = entry["smallest_error"]
        return "not reached" + (f" ({smallest:.1e})" if smallest else "")
    return f"{1e3 * entry['seconds']['median']:.3g} (fastest {1e3 * entry['fastest']:.3g})"


def ratios(entry: dict[str, Any]) -> str:
    if "ratio" not in entry:
        return "–"
    median, (low, high) = entry["ratio"]["median"], entry["ratio"]["quartiles"]
    return f"{median:.3g} ({low:.3g} to {high:.3g}; fastest {entry['fastest_ratio']:.3g})"


def about() -> dict[str, Any]:
    """What the figures depend on."""
    peers = ("numpy", "scipy", "sympy", "mpmath", "heyoka")
    models = [line for line in processor().splitlines() if line.startswith("model name")]
    return {
        "python": platform.python_version(),
        "machine": platform.machine(),
        "processor": models[0].split(":")[1].strip() if models else platform.processor(),
        "cores": os.cpu_count(),
        **{name: version(name) for name in peers if importlib.util.find_spec(name)},
    }


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=61)
    parser.add_argument("--until", type=float, default=10.0, help="s")
    parser.add_argument("--samples", type=int, default=501)
    parser.add_argument("--release", type=float, nargs=2, default=(1.5, 2.0), help="rad")
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    if shutil.which("cc") is None:
        print("a C compiler is needed (cc on the path)", file=sys.stderr)
        return 1
    times, release = np.linspace(0.0, options.until, options.samples), tuple(options.release)
    exact = reference(times, release)
    wrong = reference_error(times, exact)
    states = np.array([[float(x) for x in state] for state in exact])
    rows = measure(solvers(times, release), states, options.turns)
    summary = summarized(rows)
    first = summary[0]["solver"]
    print("Milliseconds (median; between the fastest runs)\n")
    print(table(summary, milliseconds))
    print(f"\nTimes as long as {first} (median, quartiles; between the fastest runs)\n")
    print(table(summary, ratios))
    print(f"\nlargest error of the reference: {wrong:.1e}")
    if options.json:
        found = {"about": about(), "reference_error": wrong, "summary": summary, "rows": rows}
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump(found, file, indent=1)
    return 0 if wrong < 1e-25 else 1


if __name__ == "__main__":
    sys.exit(main())
