"""The whole promise of an accuracy, beside SciPy's DOP853 without any estimate, at equal error.

Five systems at two accuracies, from Python. What is timed of lagrange is everything between the
call and the trajectory, estimate included, compiled and warm. SciPy's ``solve_ivp`` runs DOP853
over the same equations through SymPy's ``lambdify`` (mass matrix, forces and what closes loops as
NumPy arrays, solved at every evaluation; Kepler and Pleiades in closed form, the latter as
vectorised NumPy), at tolerances from loose to tight with atol = rtol/100. Of its runs the fastest
one counts whose measured error is no larger than that of lagrange. Both take turns in one process
and are counted in its seconds of the processor.

    python benchmarks/promise_peers.py
"""

from __future__ import annotations

import argparse
import gc
import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from lagrange_cli import Derivation, load
from lagrange_cli.simulate import Trajectory

SYSTEMS = Path(__file__).resolve().parents[1] / "systems"
SCENES = (
    "pendulums/double_pendulum",
    "celestial/kepler",
    "pendulums/triple_pendulum",
    "celestial/pleiades",
    "constraints/four_bar_linkage",
)
ACCURACIES = (1e-6, 1e-9)
TOLERANCES = tuple(10.0 ** (-k / 2) for k in range(6, 28))

#: Accuracy of the reference.
EXACT = 1e-11

Array = NDArray[np.float64]
Rhs = Callable[[float, Array], Array]


def lambdified(derivation: Derivation) -> Rhs:
    """The equations of a scene through ``lambdify``, solved by NumPy at every evaluation."""
    equations = derivation.equations
    values = {p.symbol: sympy.Float(p.value, 17) for p in equations.system.parameters if p.value}
    state = [c.q for c in equations.system.coordinates] + [
        c.v for c in equations.system.coordinates
    ]
    n, closures = len(equations.system.coordinates), equations.system.closures
    matrix = sympy.zeros(n + len(closures))
    matrix[:n, :n] = sympy.Matrix(n, n, lambda i, j: equations.system.mass_matrix[i][j])
    for k, closure in enumerate(closures):
        for j in range(n):
            matrix[n + k, j] = closure.gradient[j]
            matrix[j, n + k] = -closure.gradient[j]
    right = [*equations.system.forcing, *(-closure.bias for closure in closures)]
    both = [matrix.subs(values).tolist(), [x.subs(values) for x in right]]
    compute = sympy.lambdify(state, both, "numpy", cse=True)

    def rhs(t: float, y: Array) -> Array:
        m, f = compute(*y)
        return np.concatenate([y[n:], np.linalg.solve(m, f)[:n]])

    return rhs


def kepler(derivation: Derivation) -> Rhs:
    """The closed form, through ``lambdify``."""
    equations = derivation.equations
    values = {p.symbol: sympy.Float(p.value, 17) for p in equations.system.parameters if p.value}
    state = [c.q for c in equations.system.coordinates] + [
        c.v for c in equations.system.coordinates
    ]
    n = len(equations.system.coordinates)
    rates = [
        *state[n:],
        *(f / equations.system.mass_matrix[i][i] for i, f in enumerate(equations.system.forcing)),
    ]
    compute = sympy.lambdify(state, [x.subs(values) for x in rates], "math", cse=True)
    return lambda t, y: np.array(compute(*y.tolist()))


def pleiades(derivation: Derivation) -> Rhs:
    """Seven stars as vectorised NumPy."""
    masses = np.arange(1.0, 8.0)

    def rhs(t: float, y: Array) -> Array:
        positions = y[:14].reshape(2, 7)
        apart = positions[:, None, :] - positions[:, :, None]
        squares = (apart**2).sum(axis=0)
        np.fill_diagonal(squares, 1.0)
        pull = (apart * (masses / (squares * np.sqrt(squares)))).sum(axis=2)
        return np.concatenate([y[14:], pull.ravel()])

    return rhs


PEERS: dict[str, Callable[[Derivation], Rhs]] = {"kepler": kepler, "pleiades": pleiades}


def states(trajectory: Trajectory, names: list[str]) -> Array:
    """The state at each sample, shape (samples, 2n)."""
    return np.column_stack([trajectory.columns[name] for name in names])


def compare(scene: str, accuracy: float, turns: int) -> dict[str, Any]:
    """Measure one scene at one accuracy."""
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    exact = derivation.simulate(accuracy=EXACT)
    names = list(exact.scales)
    right, scales = states(exact, names), np.array(list(exact.scales.values()))

    def error(rows: Array) -> float:
        return float((np.abs(rows - right) / scales).max())

    ours = derivation.simulate(accuracy=accuracy)
    error_made = error(states(ours, names))
    rhs = PEERS.get(Path(scene).name, lambdified)(derivation)

    def theirs(tolerance: float) -> Array:
        how: dict[str, Any] = {"method": "DOP853", "rtol": tolerance, "atol": tolerance / 100}
        solved = solve_ivp(rhs, (exact.t[0], exact.t[-1]), right[0], t_eval=exact.t, **how)
        return np.asarray(solved.y.T)

    errors = {tolerance: error(theirs(tolerance)) for tolerance in TOLERANCES}
    good = [tolerance for tolerance, made in errors.items() if made <= error_made]
    tolerance = max(good) if good else min(errors, key=lambda tolerance: errors[tolerance])
    seconds: dict[str, list[float]] = {"ours": [], "theirs": []}
    gc.collect()
    gc.disable()
    for _ in range(turns):
        for name, run in (
            ("ours", lambda: derivation.simulate(accuracy=accuracy)),
            ("theirs", lambda: theirs(tolerance)),
        ):
            started = time.process_time()
            run()
            seconds[name].append(time.process_time() - started)
    gc.enable()
    median = {name: statistics.median(values) for name, values in seconds.items()}
    return {
        "scene": Path(scene).name,
        "accuracy": accuracy,
        "error": error_made,
        "ours": median["ours"],
        "run": ours.seconds["integrate"],
        "theirs": median["theirs"],
        "their_error": errors[tolerance],
        "ratio": median["theirs"] / median["ours"],
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turns", type=int, default=9)
    parser.add_argument("--scenes", nargs="+", choices=SCENES, default=SCENES)
    options = parser.parse_args()
    print("| scene | accuracy | error | whole promise, ms | SciPy, ms | its error | times |")
    print("|---|---|---|---|---|---|---|")
    for scene in options.scenes:
        for accuracy in ACCURACIES:
            row = compare(scene, accuracy, options.turns)
            print(
                f"| {row['scene']} | {accuracy:.0e} | {row['error']:.1e} |"
                f" {1e3 * row['ours']:.2f} |"
                f" {1e3 * row['theirs']:.1f} | {row['their_error']:.1e} | {row['ratio']:.0f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
