"""Time to derive M(q) and f(q, v) of the n-link pendulum, side by side with peers.

n point masses on massless rods, absolute angles, every mass and length a
symbol of its own. Everything runs in one process with imports warm; SymPy's
cache is cleared and garbage collected before each timing, the methods take
turns, and medians of seconds of the processor are reported. What each method
yields is compared with the closed form of M and f at a random state. Garbage is
looked for as often as in a process of ``lagrange``, for every method alike.

    python benchmarks/derivation.py --json derivation.json

Peers besides SymPy (casadi, symengine) take part where they are installed.
"""

from __future__ import annotations

import argparse
import gc
import importlib.util
import math
import platform
import statistics
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import sympy
from numpy.typing import NDArray
from reporting import verdict
from sympy.core.cache import clear_cache
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from lagrange_cli.cli.main import COLLECTION
from lagrange_cli.mechanics import derive, derive_uncertified, reduce
from lagrange_cli.mechanics.dynamics.potential_forces import raw_terms
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.value_graph import ValueGraph
from lagrange_cli.program.systems.direct_derivation import DirectDerivation
from lagrange_cli.scene import read_text
from lagrange_cli.scene.model import Scene

Array = NDArray[np.float64]
Values = tuple[Array, Array]
GRAVITY = 9.81


@dataclass(frozen=True)
class State:
    """Angles, angular velocities, masses and lengths at which results are compared."""

    q: Array
    v: Array
    m: Array
    l: Array  # noqa: E741


@dataclass(frozen=True)
class Method:
    """``prepare(n)`` makes the input, ``run`` is timed, ``evaluate`` gives M and f as numbers."""

    name: str
    largest: int
    prepare: Callable[[int], Any]
    run: Callable[[Any], Any]
    evaluate: Callable[[Any, State], Values]


def pendulum_scene(n: int) -> str:
    """The n-link pendulum in the scene language."""
    bobs = range(1, n + 1)
    lines = [f"name: pendulum_{n}", "parameters:", f"  g: {GRAVITY}"]
    lines += [f"  m{i}: 1.0\n  l{i}: 1.0" for i in bobs]
    lines += ["plane: xz", "particles:"]
    lines += [f"  p{i}: {{mass: m{i}, position: [x{i}, y{i}, z{i}]}}" for i in bobs]
    lines += ["coordinates: [" + ", ".join(f"theta{i}" for i in bobs) + "]", "definitions:"]
    lines += ["  x1: l1*sin(theta1)\n  z1: -l1*cos(theta1)"]
    lines += [
        f"  x{i}: x{i - 1} + l{i}*sin(theta{i})\n  z{i}: z{i - 1} - l{i}*cos(theta{i})"
        for i in bobs[1:]
    ]
    lines += ["potentials:", "  weight: {gravity: g}"]
    return "\n".join(lines) + "\n"


def closed_form(s: State) -> Values:
    """M and f of the n-link pendulum, from the textbook sum over the masses below a joint."""
    below = np.cumsum(s.m[::-1])[::-1]
    index = np.arange(len(s.q))
    shared = below[np.maximum.outer(index, index)] * np.outer(s.l, s.l)
    difference = np.subtract.outer(s.q, s.q)
    weight = GRAVITY * below * s.l * np.sin(s.q)
    return shared * np.cos(difference), -(shared * np.sin(difference)) @ s.v**2 - weight


def random_state(n: int) -> State:
    random = np.random.default_rng(n)
    return State(
        random.uniform(-3, 3, n),
        random.uniform(-2, 2, n),
        random.uniform(0.5, 2, n),
        random.uniform(0.5, 2, n),
    )


Forms = tuple[list[Any], list[list[Any]], list[Any]]
"""Arguments q, v, m, l, g; M; f."""


def without_certificate(scene: Scene) -> Forms:
    """Reduction, and M and f collected: nothing is checked or put into textbook form."""
    found = derive_uncertified(reduce(scene))
    n = len(found.mass)
    matrix = [[sympy.Add(*row.get(k, ())) for k in range(n)] for row in found.mass]
    forcing = [sympy.Add(*terms) for terms in found.forcing]
    coordinates = found.reduced.coordinates
    return _arguments(coordinates, found.reduced.names.parameters), matrix, forcing


@dataclass(frozen=True)
class Executed:
    """M and f as values of a graph, and the equations whose parameters are among its inputs."""

    derivation: DirectDerivation
    equations: Equations


def scene_and_equations(n: int) -> tuple[Scene, Equations]:
    """A scene, and its equations for what is neither position nor energy."""
    scene = _scene(n)
    return scene, derive(scene)


def on_the_graph(given: tuple[Scene, Equations]) -> Executed:
    """Reduction, and M and f derived on the value graph, which is what code of many links computes.

    Positions and potentials come from this reduction, not from the one of the given equations.
    """
    scene, equations = given
    reduced = reduce(scene)
    terms = raw_terms(reduced)
    assert equations.derivation.sources is not None
    potentials = [*terms.velocity_dependent, *map(reduced.resolve, terms.positional)]
    rest = sympy.Add(*terms.kinetic, *(-u for u in potentials))
    bodies = zip(
        equations.system.particles, reduced.names.particle_symbols, reduced.masses, strict=True
    )
    particles = tuple(
        replace(p, mass=m, position=tuple(reduced.resolved[s] for s in body))
        for p, body, m in bodies
    )
    sources = replace(equations.derivation.sources, other_lagrangian=rest)
    equations = replace(
        equations,
        system=replace(equations.system, particles=particles),
        derivation=replace(equations.derivation, sources=sources),
    )
    inputs = [(p.symbol, f"p{k}", 1) for k, p in enumerate(equations.system.parameters)]
    inputs += [(reduced.names.t, "t", 2)]
    inputs += [(c.q, f"q{k}", 3) for k, c in enumerate(reduced.coordinates)]
    inputs += [(c.v, f"v{k}", 4) for k, c in enumerate(reduced.coordinates)]
    return Executed(DirectDerivation(ValueGraph(inputs), equations), equations)


def evaluate_graph(result: Executed, s: State) -> Values:
    derivation, equations = result.derivation, result.equations
    known = {"g": GRAVITY}
    for letter, values in (("m", s.m), ("l", s.l)):
        known |= {f"{letter}{k + 1}": float(x) for k, x in enumerate(values)}
    inputs = {f"p{k}": known[p.name] for k, p in enumerate(equations.system.parameters)}
    for letter, values in (("q", s.q), ("v", s.v)):
        inputs |= {f"{letter}{k}": float(x) for k, x in enumerate(values)}
    places = [(j, k) for j, row in enumerate(derivation.mass) for k in row]
    wanted = [*(derivation.mass[j][k] for j, k in places), *derivation.forcing]
    evaluation = Evaluation(derivation.values, wanted)
    found = evaluation.at(inputs, Arithmetic(vars(math), float))
    matrix = np.zeros((len(s.q), len(s.q)))
    matrix[tuple(np.transpose(places))] = found[: len(places)]
    return matrix, np.array(found[len(places) :])


def _arguments(coordinates: Any, parameters: Any) -> list[Any]:
    n = len(coordinates)
    masses = [parameters[f"m{i + 1}"] for i in range(n)]
    rods = [parameters[f"l{i + 1}"] for i in range(n)]
    return [[c.q for c in coordinates], [c.v for c in coordinates], masses, rods, parameters["g"]]


def evaluate_equations(equations: Equations, s: State) -> Values:
    parameters = {p.name: p.symbol for p in equations.system.parameters}
    matrix = [list(row) for row in equations.system.mass_matrix]
    arguments = _arguments(equations.system.coordinates, parameters)
    return evaluate_forms((arguments, matrix, list(equations.system.forcing)), s)


def evaluate_forms(result: Forms, s: State) -> Values:
    arguments, *forms = result
    compute = sympy.lambdify(arguments, forms, "numpy")
    matrix, forcing = compute(s.q, s.v, s.m, s.l, GRAVITY)
    return np.array(matrix, dtype=float), np.array(forcing, dtype=float)


def sympy_derivation(n: int) -> tuple[LagrangesMethod, list[Any]]:
    """LagrangesMethod from positions, as its documentation shows it."""
    q = dynamicsymbols(f"q:{n}")
    m, rods = sympy.symbols(f"m:{n}"), sympy.symbols(f"l:{n}")
    g = sympy.Symbol("g")
    x = z = sympy.Integer(0)
    lagrangian = sympy.Integer(0)
    for i in range(n):
        x, z = x + rods[i] * sympy.sin(q[i]), z - rods[i] * sympy.cos(q[i])
        speed = x.diff(dynamicsymbols._t) ** 2 + z.diff(dynamicsymbols._t) ** 2
        lagrangian += m[i] * speed / 2 - m[i] * g * z
    method = LagrangesMethod(lagrangian, q)
    method.form_lagranges_equations()
    forms = [method.mass_matrix, method.forcing]
    return method, [q, m, rods, g, forms]


def evaluate_sympy(result: tuple[LagrangesMethod, list[Any]], s: State) -> Values:
    _, (q, m, rods, g, forms) = result
    velocities = [f.diff(dynamicsymbols._t) for f in q]
    compute = sympy.lambdify([q, velocities, m, rods, g], forms, "numpy", cse=True)
    matrix, forcing = compute(s.q, s.v, s.m, s.l, GRAVITY)
    return np.array(matrix, dtype=float), np.array(forcing, dtype=float).ravel()


def casadi_derivation(n: int) -> Any:
    import casadi as ca

    q, v, m, rods = (ca.SX.sym(name, n) for name in "qvml")
    x = z = ca.SX(0)
    lagrangian = ca.SX(0)
    vx = vz = ca.SX(0)
    for i in range(n):
        x, z = x + rods[i] * ca.sin(q[i]), z - rods[i] * ca.cos(q[i])
        vx, vz = vx + rods[i] * ca.cos(q[i]) * v[i], vz + rods[i] * ca.sin(q[i]) * v[i]
        lagrangian += m[i] * (vx**2 + vz**2) / 2 - m[i] * GRAVITY * z
    momenta = ca.gradient(lagrangian, v)
    forcing = ca.gradient(lagrangian, q) - ca.jtimes(momenta, q, v)
    return ca.Function("pendulum", [q, v, m, rods], [ca.jacobian(momenta, v), forcing])


def evaluate_casadi(function: Any, s: State) -> Values:
    matrix, forcing = function(s.q, s.v, s.m, s.l)
    return np.array(matrix), np.array(forcing).ravel()


def symengine_derivation(n: int) -> Any:
    import symengine as se

    q, v, m, rods = (se.symbols(f"{name}:{n}") for name in "qvml")
    x = z = vx = vz = se.Integer(0)
    lagrangian = se.Integer(0)
    for i in range(n):
        x, z = x + rods[i] * se.sin(q[i]), z - rods[i] * se.cos(q[i])
        vx, vz = vx + rods[i] * se.cos(q[i]) * v[i], vz + rods[i] * se.sin(q[i]) * v[i]
        lagrangian += m[i] * (vx**2 + vz**2) / 2 - m[i] * se.Symbol("g") * z
    momenta = [lagrangian.diff(u) for u in v]
    matrix = [[p.diff(u) for u in v] for p in momenta]
    forcing = [
        lagrangian.diff(q[j]) - sum(momenta[j].diff(q[i]) * v[i] for i in range(n))
        for j in range(n)
    ]
    return [*q, *v, *m, *rods, se.Symbol("g")], matrix, forcing


def evaluate_symengine(result: Any, s: State) -> Values:
    import symengine as se

    arguments, matrix, forcing = result
    n = len(forcing)
    flat = [e for row in matrix for e in row] + list(forcing)
    compute = se.Lambdify(arguments, flat)
    values = np.array(compute(np.concatenate([s.q, s.v, s.m, s.l, [GRAVITY]])))
    return values[: n * n].reshape(n, n), values[n * n :]


def _scene(n: int) -> Scene:
    return read_text(pendulum_scene(n))


def _size(n: int) -> int:
    return n


def methods(largest_sympy: int) -> list[Method]:
    every = sys.maxsize
    found = [
        Method("lagrange, certified", every, _scene, derive, evaluate_equations),
        Method("lagrange, collected", every, _scene, without_certificate, evaluate_forms),
        Method("lagrange, graph", every, scene_and_equations, on_the_graph, evaluate_graph),
        Method("SymPy LagrangesMethod", largest_sympy, _size, sympy_derivation, evaluate_sympy),
    ]
    if importlib.util.find_spec("symengine"):
        found.append(
            Method("SymEngine", largest_sympy, _size, symengine_derivation, evaluate_symengine)
        )
    if importlib.util.find_spec("casadi"):
        found.append(Method("CasADi SX", every, _size, casadi_derivation, evaluate_casadi))
    return found


def timed(method: Method, n: int) -> tuple[float, Any]:
    """Seconds of the processor of one derivation from a clean cache, and its result."""
    given = method.prepare(n)
    clear_cache()
    gc.collect()
    start = time.process_time()
    result = method.run(given)
    return time.process_time() - start, result


def mismatch(method: Method, result: Any, n: int) -> float:
    """Largest difference from the closed form, relative to its largest entry."""
    state = random_state(n)
    found, expected = method.evaluate(result, state), closed_form(state)
    return max(
        float(np.abs(f - e).max() / np.abs(e).max()) for f, e in zip(found, expected, strict=True)
    )


def measure(n: int, candidates: list[Method], repetitions: int) -> list[dict[str, Any]]:
    """Median seconds and mismatch of every method at one size, the methods taking turns."""
    taking_part = [m for m in candidates if n <= m.largest]
    seconds: dict[str, list[float]] = {m.name: [] for m in taking_part}
    results: dict[str, Any] = {}
    for _ in range(repetitions):
        for method in taking_part:
            duration, results[method.name] = timed(method, n)
            seconds[method.name].append(duration)
    return [
        {
            "n": n,
            "method": m.name,
            "seconds": statistics.median(seconds[m.name]),
            "all_seconds": seconds[m.name],
            "mismatch": mismatch(m, results[m.name], n),
        }
        for m in taking_part
    ]


def table(rows: list[dict[str, Any]], names: list[str]) -> str:
    """Markdown: a row a size, a column a method, and ratios of ours and those of peers."""
    of = {(r["n"], r["method"]): r["seconds"] for r in rows}
    *ours, sympys = names[:4]
    ratios = ["SymPy/certified", "collected/CasADi", "graph/CasADi"]
    lines = ["| " + " | ".join(["n", *names, *ratios]) + " |"]
    lines.append("|---" * (len(names) + 4) + "|")
    for n in sorted({r["n"] for r in rows}):
        cells = [f"{of[n, name]:.3g}" if (n, name) in of else "–" for name in names]
        slow, fast = of.get((n, sympys)), of.get((n, "CasADi SX"))
        cells.append(f"{slow / of[n, ours[0]]:.0f}" if slow else "–")
        cells += [f"{of[n, name] / fast:.1f}" if fast else "–" for name in ours[1:]]
        lines.append(f"| {n} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def growth(rows: list[dict[str, Any]], names: list[str]) -> str:
    """How many times longer our ways take at twice the size, repetition by repetition."""
    of = {(r["n"], r["method"]): r["all_seconds"] for r in rows}
    lines = []
    for name in names[:3]:
        for n, small in sorted((n, times) for (n, other), times in of.items() if other == name):
            if large := of.get((2 * n, name)):
                ratio = statistics.median(b / a for a, b in zip(small, large, strict=True))
                lines.append(f"{name}: n = {2 * n} takes {ratio:.2f} times as long as n = {n}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[2, 4, 8, 16, 32, 64])
    parser.add_argument("--largest-sympy", type=int, default=16)
    parser.add_argument("--repetitions", type=int, default=3)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    gc.set_threshold(*COLLECTION)
    candidates = methods(options.largest_sympy)
    for method in candidates:  # imports and first-call costs
        timed(method, 2)
    rows: list[dict[str, Any]] = []
    for n in options.sizes:
        rows += measure(n, candidates, options.repetitions)
        print(f"n = {n} done", file=sys.stderr)
    names = [m.name for m in candidates]
    print(table(rows, names), growth(rows, names), sep="\n\n")
    about = {"python": platform.python_version(), "sympy": sympy.__version__}
    return verdict(rows, about, "the closed form", options.json)


if __name__ == "__main__":
    sys.exit(main())
