"""Time of one right-hand side of the n-link chain in Cartesian coordinates, beside Pinocchio's ABA.

n equal point masses on massless rods in a vertical plane. The scene names their places alone, so
that the equations keep a multiplier for each rod; the emitted C finds them from a band, in time
linear in n. Pinocchio's articulated-body algorithm works on the same chain in joint angles. Each
meets the same 64 states in turn, compared with each other at the first before anything is timed;
the methods take turns. What a scene costs until its right-hand side is compiled, in seconds of the
processor, and how many operations it has, is reported beside. Operations are counted for chains of
other sizes too, which are derived and not compiled.

    python benchmarks/chains.py --count 10 100 1000 10000 --json chains.json

With --pinocchio-cpp, Pinocchio is also compiled from its headers for this machine and called from
C++ (see right_hand_side.py).
"""

from __future__ import annotations

import argparse
import gc
import importlib.util
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from derivation import GRAVITY, Array, State
from reporting import verdict
from right_hand_side import (
    FEWEST,
    LENGTH,
    STATES,
    Method,
    about,
    compiled,
    pinocchio_cpp,
    pinocchio_object,
    pinocchio_python,
    summary,
    timed,
)

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import COLLECTION
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.program.operations import count_operations, elimination_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.scene import read_text

MASS, ROD = 0.5, 0.25

#: Joints up to which Pinocchio takes part: with 1000 its process ended without a word.
LARGEST_PINOCCHIO = 256

SCENE = """
name: chain
sizes: {{n: {n}}}
parameters: {{m: {mass}, l: {rod}, g: {gravity}}}
plane: xz
points: {{"p[0]": [0, 0, 0]}}
particles:
  p[i=1..n]: {{mass: m, position: ["x[i]", "y[i]", "z[i]"]}}
constraints:
  rod[i=1..n]: {{distance: ["p[i-1]", "p[i]"], equals: l}}
potentials:
  weight: {{gravity: g}}
initial:
  x[i=1..n]: l*i
  z[i=1..n]: 0
"""


def chain_scene(n: int) -> str:
    return SCENE.format(n=n, mass=MASS, rod=ROD, gravity=GRAVITY)


def angles(n: int) -> Array:
    """Angles and angular velocities, from the downward vertical, a row a state."""
    random = np.random.default_rng([n, 2])
    return np.hstack([random.uniform(-3, 3, (STATES, n)), random.uniform(-2, 2, (STATES, n))])


def places(states: Array, n: int) -> Array:
    """The same states in Cartesian coordinates: x, z of each mass, then their velocities."""
    sin, cos, rate = np.sin(states[:, :n]), np.cos(states[:, :n]), states[:, n:]
    parts = (ROD * sin, -ROD * cos, ROD * cos * rate, ROD * sin * rate)
    x, z, u, w = (np.cumsum(part, axis=1) for part in parts)
    halves = [np.stack(pair, axis=2).reshape(len(states), 2 * n) for pair in ((x, z), (u, w))]
    return np.hstack(halves)


def bends(accelerations: Array, state: Array, n: int) -> Array:
    """Angular accelerations of the rods, from accelerations of the masses."""
    apart = np.diff(accelerations.reshape(n, 2), axis=0, prepend=0.0)
    along = np.stack([np.cos(state[:n]), np.sin(state[:n])], axis=1)
    return np.asarray((apart * along).sum(axis=1) / ROD)


def lagrange_c(n: int, folder: Path) -> tuple[Method, Equations]:
    """The emitted C, with the seconds from the scene to its compiled right-hand side."""
    clock = [time.process_time()]
    scene = read_text(chain_scene(n))
    clock.append(time.process_time())
    equations = derive(scene)
    clock.append(time.process_time())
    files = EMITTERS["c"].emit(equations)
    clock.append(time.process_time())
    header, source = (next(t for f, t in files.items() if f.endswith(e)) for e in (".h", ".c"))
    (folder / "chain.h").write_text(header)
    (line,) = [x for x in header.splitlines() if x.startswith("#define chain_WORK ")]
    states = angles(n)
    method = compiled(
        *("lagrange, C", folder / "lagrange", [source, '#include "chain.h"\n']),
        "status |= chain_rhs(0.0, state, 0, (const chain_params *)given, work, out);",
        *(places(states, n), np.array([MASS, ROD, GRAVITY]), 4 * n),
        work=int(line.split()[-1]),
        after=lambda out: bends(out[2 * n :], states[0], n),
    )
    steps = np.diff(clock).tolist()
    method.seconds.update(zip(("read", "derive", "emit"), steps, strict=True))
    return method, equations


def count(equations: Equations) -> int:
    """Operations of one right-hand side, those of the elimination among them."""
    program = build_program(equations, ["acceleration"])
    return count_operations(program).total + elimination_operations(program)


def counted(sizes: Sequence[int]) -> str:
    """Markdown: operations of one right-hand side, and the seconds that its derivation takes."""
    lines = ["| n | operations | a link | seconds to derive |", "|---|---|---|---|"]
    for n in sizes:
        start = time.process_time()
        equations = derive(read_text(chain_scene(n)))
        seconds = time.process_time() - start
        total = count(equations)
        lines.append(f"| {n} | {total} | {total / n:.1f} | {seconds:.1f} |")
        print(f"n = {n} counted", file=sys.stderr)
    return "\n".join(lines)


def methods(n: int, folder: Path, pinocchio: Path | None) -> tuple[list[Method], int]:
    """The methods, and the operations of the first."""
    ours, equations = lagrange_c(n, folder)
    found, states = [ours], angles(n)
    given = np.r_[GRAVITY, np.tile([MASS, ROD], n)]
    if n <= LARGEST_PINOCCHIO and importlib.util.find_spec("pinocchio"):
        found.append(pinocchio_python(n, states, given))
        if pinocchio is not None:
            found.append(pinocchio_cpp(n, states, given, folder, pinocchio))
    return found, count(equations)


def reference(n: int) -> Array:
    """Angular accelerations at the first state from Newton's law: the forces in the rods are
    found by elimination in doubles."""
    state = State(angles(n)[0, :n], angles(n)[0, n:], np.full(n, MASS), np.full(n, ROD))
    direction = np.stack([np.sin(state.q), -np.cos(state.q)], axis=1)
    couplings = (direction[:-1] * direction[1:]).sum(axis=1) / MASS
    matrix = np.diag(np.r_[1, np.full(n - 1, 2)] / MASS)
    matrix -= np.diag(couplings, 1) + np.diag(couplings, -1)
    right = ROD * state.v**2
    right[0] += GRAVITY * np.cos(state.q[0])
    tension = np.linalg.solve(matrix, right)
    pull = np.vstack([tension[:, None] * direction, np.zeros((1, 2))])
    accelerations = (pull[1:] - pull[:-1]) / MASS - [0.0, GRAVITY]
    return bends(accelerations.ravel(), angles(n)[0], n)


def measure(n: int, found: list[Method], repetitions: int) -> list[dict[str, Any]]:
    """A row for each method at one size, the methods taking turns."""
    expected = reference(n)
    size = np.abs(expected).max()
    errors = [float(np.abs(m.run(1) - expected).max() / size) for m in found]
    counts = [max(FEWEST, int(1e6 * LENGTH / timed(m, FEWEST))) for m in found]
    times: list[list[float]] = [[] for _ in found]
    for _ in range(repetitions):
        for of, method, calls in zip(times, found, counts, strict=True):
            of.append(timed(method, calls))
    return [summary(n, *row) for row in zip(found, times, errors, strict=True)]


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: a row a size."""
    peers = list(dict.fromkeys(r["method"] for r in rows))
    heads = [
        "n",
        "count_operations",
        *(f"{p}, µs" for p in peers),
        "times faster",
        "seconds to compile",
    ]
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for n in dict.fromkeys(r["n"] for r in rows):
        of = {r["method"]: r for r in rows if r["n"] == n}
        ours, *others = of.values()
        ratios = [f"{r['microseconds'] / ours['microseconds']:.1f}" for r in others]
        seconds = sum(ours["seconds_to_make"].values())
        cells = [str(n), str(ours["count_operations"])]
        cells += [f"{of[p]['microseconds']:.3g}" if p in of else "–" for p in peers]
        lines.append(f"| {' | '.join([*cells, ' / '.join(ratios) or '–', f'{seconds:.1f}'])} |")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[16, 64, 256, 1000])
    parser.add_argument("--count", type=int, nargs="*", default=[10, 100, 1000])
    parser.add_argument("--repetitions", type=int, default=15)
    parser.add_argument("--pinocchio-cpp", action="store_true")
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    if shutil.which("cc") is None:
        print("a C compiler is needed (cc on the path)", file=sys.stderr)
        return 1
    gc.set_threshold(*COLLECTION)  # as the command line does
    rows: list[dict[str, Any]] = []
    with tempfile.TemporaryDirectory() as root:
        pinocchio = pinocchio_object(Path(root)) if options.pinocchio_cpp else None
        for n in options.sizes:
            folder = Path(root) / str(n)
            folder.mkdir()
            found, total = methods(n, folder, pinocchio)
            rows += [
                {**row, "count_operations": total} for row in measure(n, found, options.repetitions)
            ]
            print(f"n = {n} done", file=sys.stderr)
    print(table(rows), counted(options.count), sep="\n\n")
    return verdict(rows, about(), "Newton's law", options.json)


if __name__ == "__main__":
    sys.exit(main())
