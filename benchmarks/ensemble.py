"""Double pendulums a second on all cores, side by side with heyoka's batch mode.

Members differ in their release, a square grid around (1.5, 2.0); each is integrated for
10 s and its state sampled 501 times. Three ways:

* lagrange with ``accuracy``: what ``simulate --vary`` does, each member with an estimate of
  its error (two runs or three). A few members, whose accuracy the last place of their start
  decides, are not held to the end;
* lagrange with a tolerance: one run each, nothing estimated;
* heyoka: batch mode, as many members in a vector as it recommends, divided over threads.

Compilation is not timed. Beside the time that passes stands that of the processors, children
included, which other work on the machine changes less. All ways run in turn, several times;
medians are reported, and ratios are taken within a turn. The error of each way is the largest
over the samples of a few members, against a Taylor series in 30 decimal digits, angles in
radians and angular velocities over their largest value.

    python benchmarks/ensemble.py --members 10000 --json ensemble.json

With ``--scale`` a sweep of a million members, of which ends are kept, as the command runs it: what
that costs beside the integration alone, and its memory (ensemble_scale.py).

    python benchmarks/ensemble.py --scale --members 100000

With ``--scale --on-cluster`` on a Dask cluster of this machine, beside the command without it.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import math
import os
import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import ensemble_scale
import numpy as np
from double_pendulum import GRAVITY, Array, Release, reference, slopes
from integration import about

from lagrange_cli.errors import Mark
from lagrange_cli.scene import SceneText
from lagrange_cli.simulate.ensemble.plan.enumeration import listed
from lagrange_cli.simulate.ensemble.plan.plan import Plan, Task, blocks_of
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
from lagrange_cli.simulate.ensemble.plan.variants import differ_in_numbers
from lagrange_cli.simulate.ensemble.run.run import run_block, run_blocks
from lagrange_cli.simulate.options import SimulationOptions

#: Positions without names, so that the columns are those that heyoka returns.
SCENE = """
name: double_pendulum
parameters: {m1: 1, m2: 1, l1: 1, l2: 1, g: %r}
particles:
  upper: {mass: m1, position: [l1*sin(theta1), 0, -l1*cos(theta1)]}
  lower:
    mass: m2
    position: [l1*sin(theta1) + l2*sin(theta2), 0, -l1*cos(theta1) - l2*cos(theta2)]
coordinates: [theta1, theta2]
potentials: {weight: {gravity: g}}
initial: {theta1: %r, theta2: %r}
"""

UNTIL, SAMPLES = 10.0, 501
CENTRE, WIDTH = (1.5, 2.0), 0.2
NAMES = ("theta1", "theta2")
STATE = (*NAMES, "dot(theta1)", "dot(theta2)")

#: Members whose error is measured.
CHECKED = 4


@dataclass(frozen=True)
class Way:
    """``run()`` gives the states of all members, shape (members, samples, 4)."""

    name: str
    run: Callable[[], Array]


def releases(members: int) -> list[Release]:
    """Angles on a square grid, the first ``members`` of it."""
    side = math.ceil(math.sqrt(members))
    axes = [np.linspace(c - WIDTH / 2, c + WIDTH / 2, side).tolist() for c in CENTRE]
    return list(itertools.islice(itertools.product(*axes), members))


# -- ways ---------------------------------------------------------------------


def plan(how: dict[str, Any]) -> Plan:
    text = SceneText("double_pendulum", (SCENE % (GRAVITY, *CENTRE)).encode())
    recipe = Recipe(text)
    own = MemberValues({}, dict(zip(NAMES, map(repr, CENTRE), strict=True)))
    model = recipe.model(own)
    alone = differ_in_numbers(recipe, own, model)
    options = SimulationOptions(until=UNTIL, samples=SAMPLES, **how)
    return Plan(str(how), recipe, NAMES, own, model, alone, SAMPLES, options)


def lagrange(starts: Sequence[Release], jobs: int, how: dict[str, Any]) -> Way:
    shared = plan(how)
    mark = Mark("benchmark", 1, 1)
    cells = [[(repr(x), mark) for x in start] for start in starts]
    blocks = blocks_of(shared, listed(NAMES, [mark] * len(NAMES), cells))
    tasks = [blocks.task(number) for number in range(len(blocks))]
    run_block(Task(shared, 0, tasks[0].rows[:1]))  # compiles

    def run() -> Array:
        states = np.empty((len(starts), SAMPLES, len(STATE)))
        for block in run_blocks(shared, tasks, jobs, lambda block: block):
            first = blocks.first(block.number)
            members = slice(first, first + blocks.length(block.number))
            for i, name in enumerate(STATE):
                states[members, :, i] = block.columns[name]
        return states

    said = ", ".join(f"{name} {value}" for name, value in how.items() if name != "atol")
    return Way(f"lagrange, {said}", run)


def heyoka(starts: Sequence[Release], tolerance: float) -> Way:
    import heyoka as hy

    width, names = hy.recommended_simd_size(), hy.make_vars("a", "b", "u", "v")
    system = list(zip(names, slopes(names, hy.sin, hy.cos), strict=True))
    # The last vector is filled with copies of its first member.
    batches = [list(starts[k : k + width]) for k in range(0, len(starts), width)]
    batches[-1] += [batches[-1][0]] * (width - len(batches[-1]))
    at_rest = [np.vstack([np.transpose(batch), np.zeros((2, width))]) for batch in batches]
    template = hy.taylor_adaptive_batch(system, at_rest[0].copy(), tol=tolerance)

    def begin(integrator: Any, number: int) -> Any:
        integrator.set_time(0.0)
        integrator.state[:] = at_rest[number]
        return integrator

    def run() -> Array:
        times = np.linspace(0.0, UNTIL, SAMPLES)
        found = hy.ensemble_propagate_grid_batch(template, times, len(batches), begin)
        states = [np.moveaxis(of[-1], 2, 0) for of in found]
        return np.concatenate(states)[: len(starts)]

    return Way(f"heyoka, batches of {width}, tol {tolerance:g}", run)


def ways(starts: Sequence[Release], jobs: int) -> list[Way]:
    chosen = [{"accuracy": 1e-9}]
    chosen += [{"method": "auto", "rtol": x} for x in (1e-12, 1e-13)]
    found = [lagrange(starts, jobs, how) for how in chosen]
    if importlib.util.find_spec("heyoka"):
        found += [heyoka(starts, tolerance) for tolerance in (1e-9, 1e-10, 1e-12)]
    return found


# -- measuring ----------------------------------------------------------------


@cache
def exact_states(release: Release) -> Array:
    """The samples of one member, to 30 digits rounded."""
    found = reference(np.linspace(0.0, UNTIL, SAMPLES), release)
    return np.array([[float(x) for x in state] for state in found])


def error(states: Array, starts: Sequence[Release]) -> float:
    """The largest error of some members spread over all."""
    worst = 0.0
    for k in np.linspace(0, len(starts) - 1, min(CHECKED, len(starts))).astype(int).tolist():
        exact = exact_states(starts[k])
        scales = np.concatenate([np.ones(2), np.abs(exact[:, 2:]).max(axis=0)])
        worst = max(worst, float(np.nanmax(np.abs(states[k] - exact) / scales)))
    return worst


def processor_seconds() -> float:
    """Of this process and of those it has waited for."""
    found = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(of.ru_utime + of.ru_stime for of in found)


def measure(candidates: Sequence[Way], starts: Sequence[Release], turns: int) -> list[dict]:
    """Of each way its error, and its seconds in each turn."""
    rows: list[dict[str, Any]] = [
        {"way": of.name, "seconds": [], "processor": []} for of in candidates
    ]
    for turn in range(turns):
        for way, row in zip(candidates, rows, strict=True):
            started, used = time.perf_counter(), processor_seconds()
            states = way.run()
            row["seconds"].append(time.perf_counter() - started)
            row["processor"].append(processor_seconds() - used)
            if turn == 0:
                row["error"] = error(states, starts)
                row["not_held"] = int(np.isnan(states[:, -1]).any(axis=1).sum())
    for row in rows:
        for kind in ("seconds", "processor"):
            row[f"{kind}_a_member"] = statistics.median(row[kind]) / len(starts)
            pairs = zip(row[kind], rows[-1][kind], strict=True)
            row[f"{kind}_ratio"] = statistics.median(own / last for own, last in pairs)
    return rows


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown: a row a way; times those of the last one."""
    head = (
        "way",
        "ms a member",
        "times the last",
        "processor, ms",
        "times the last",
        "error",
        "not held",
    )
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for row in rows:
        cells = [
            f"{scale * row[name]:.3g}"
            for kind in ("seconds", "processor")
            for name, scale in ((f"{kind}_a_member", 1e3), (f"{kind}_ratio", 1))
        ]
        lines.append(
            f"| {' | '.join([row['way'], *cells])} | {row['error']:.1e} | {row['not_held']} |"
        )
    return "\n".join(lines)


def write(options: argparse.Namespace, rows: Sequence[dict[str, Any]]) -> None:
    """Write the file of --json, if there is to be one."""
    if options.json:
        counts = {"members": options.members, "jobs": options.jobs, "turns": options.turns}
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"about": {**about(), **counts}, "rows": rows}, file, indent=1)


def scale(options: argparse.Namespace) -> int:
    """Measure a sweep as the command runs it; 1 if its error is above its accuracy."""
    scene = ensemble_scale.scene_of(SCENE)
    if options.on_cluster:
        rows = ensemble_scale.on_cluster(scene, options.members, options.jobs)
        write(options, rows)
        return 0 if all(row["same"] for row in rows) else 1
    rows = ensemble_scale.measured(scene, options.members, options.jobs)
    print(f"{options.members} members, {options.jobs} cores\n")
    print(ensemble_scale.table(rows, options.members))
    write(options, rows)
    return 0 if rows[1]["error"] < ensemble_scale.ACCURACY else 1


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--members", type=int, help="10,000; with --scale 1,000,000")
    parser.add_argument("--scale", action="store_true", help="a sweep as the command runs it")
    parser.add_argument("--on-cluster", action="store_true", help="with --scale: on Dask workers")
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    if options.members is None:
        options.members = 1_000_000 if options.scale else 10_000
    if options.scale:
        return scale(options)
    starts = releases(options.members)
    rows = measure(ways(starts, options.jobs), starts, options.turns)
    print(f"{options.members} members, {options.jobs} cores\n")
    print(table(rows))
    write(options, rows)
    return 0 if rows[0]["error"] < 1e-9 else 1


if __name__ == "__main__":
    sys.exit(main())
