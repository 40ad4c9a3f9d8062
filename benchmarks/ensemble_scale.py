"""A sweep as a user runs it, beside its integration alone and heyoka's batch mode.

Double pendulums are drawn around (1.5, 2.0) and integrated for 10 s to 1e-6; their ends are kept.

* integration alone: runs, estimates of errors and checks of energies, on numbers that are there;
  nothing is kept. Its seconds are what the others are divided by;
* lagrange simulate --final -o out.zarr, and out.npz: the command, in a process of its own, whose
  largest memory is measured. Its seconds are those from the first block to the finished file;
* heyoka: batch mode to the end, a thousand batches at a time, at several tolerances: whether these
  reach 1e-6 is what their errors say.

With ``--on-cluster`` the command alone, here and on a Dask cluster of this machine with as many
workers, one thread each.

Errors are the largest of a few members, as in ensemble.py. The seconds of the processors, which
other work on the machine changes less, are for the command those of all its process, with its start
and the derivation.
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from double_pendulum import GRAVITY, Array, reference, slopes

from lagrange_cli.scene import SceneText
from lagrange_cli.simulate.ensemble.plan.plan import Selection
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
from lagrange_cli.simulate.ensemble.plan.sampling import SampledMembers, sampled
from lagrange_cli.simulate.ensemble.run.batched_results import batched_results
from lagrange_cli.simulate.options import SimulationOptions

ACCURACY, UNTIL = 1e-6, 10.0
CENTRE, WIDTH = (1.5, 2.0), 0.2
NAMES = ("theta1", "theta2")
STATE = (*NAMES, "dot(theta1)", "dot(theta2)")
SEED = 7

#: Members that are integrated at a time, alone and by heyoka, so that memory is bounded.
AT_A_TIME = 8192

#: Members whose error is measured.
CHECKED = 4

TOLERANCES = (1e-7, 1e-8, 1e-9)


def distributions() -> list[str]:
    return [
        f"{name} ~ uniform({c - WIDTH / 2!r}, {c + WIDTH / 2!r})"
        for name, c in zip(NAMES, CENTRE, strict=True)
    ]


def members(number: int) -> SampledMembers:
    drawn = sampled(distributions(), number, SEED)
    assert isinstance(drawn, SampledMembers)
    return drawn


def parts(number: int) -> Iterator[tuple[int, Array]]:
    """Number of the first of some members, and their releases, shape (m, 2)."""
    drawn = members(number)
    for first in range(0, number, AT_A_TIME):
        yield first, np.transpose(drawn.numbers(first, first + AT_A_TIME))


# -- ways ---------------------------------------------------------------------


def alone(scene: str, number: int, jobs: int) -> dict[str, Any]:
    """Integrate numbers that are there, and keep nothing."""
    model = Recipe(SceneText("double_pendulum", scene.encode())).model(MemberValues())
    options = SimulationOptions(until=UNTIL, accuracy=ACCURACY)
    batched = batched_results(model, options, (), Selection(()))
    assert batched is not None
    values = np.array([p.value for p in model.parameters], dtype=float)

    def run(releases: Array) -> None:
        starts = np.hstack([releases, np.zeros_like(releases)])
        for _ in batched.run(starts, np.tile(values, (len(starts), 1))):
            pass

    run(next(parts(1))[1])  # compiles
    started, used = time.perf_counter(), time.process_time()
    with ThreadPoolExecutor(jobs) as pool:
        list(pool.map(run, (releases for _, releases in parts(number))))
    return {
        "way": "integration alone",
        "seconds": time.perf_counter() - started,
        "processor": time.process_time() - used,
    }


def command(
    scene: str, number: int, jobs: int, ending: str, scheduler: str | None = None
) -> dict[str, Any]:
    """Run the command, here or on a cluster; seconds, the largest memory of its process, and the
    ends of some members."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scene.yaml")
        path.write_text(scene, encoding="utf-8")
        output = Path(folder, f"out{ending}")
        drawn = [word for text in distributions() for word in ("--sample", text)]
        options = ["--members", str(number), "--seed", str(SEED), "--until", str(UNTIL)]
        kept = ["--accuracy", str(ACCURACY), "--final", "-o", str(output)]
        engine = ["-j", str(jobs)] if scheduler is None else ["--on", scheduler]
        words = ["simulate", str(path), *drawn, *options, *kept, *engine, "--json"]
        with tempfile.TemporaryFile() as printed:
            process = subprocess.Popen(
                [sys.executable, "-m", "lagrange_cli", *words], stdout=printed
            )
            _, _, used = os.wait4(process.pid, 0)
            process.returncode = 0
            printed.seek(0)
            report = json.loads(printed.read())
        return {
            "way": f"lagrange simulate --final -o out{ending}{' --on cluster' * bool(scheduler)}",
            "seconds": report["seconds"]["integrate"],
            "processor": used.ru_utime + used.ru_stime,
            "memory": used.ru_maxrss * 1024,
            "not_held": number - report["counts"].get("ok", 0),
            "ends": ends_in(output, number),
        }


def on_cluster(scene: str, number: int, jobs: int) -> list[dict[str, Any]]:
    """Run the command here and on a cluster of as many workers, in turn; rows as of measured.

    Seconds are those from the first block to the finished file; on the cluster that its workers are
    asked for their versions, and load what is compiled, is among them.
    """
    from distributed import Client, LocalCluster

    options = {"n_workers": jobs, "threads_per_worker": 1, "processes": True}
    rows = []
    with LocalCluster(**options, dashboard_address=None) as cluster, Client(cluster):
        for ending in (".npz", ".zarr"):
            command(scene, 100 * jobs, jobs, ending, cluster.scheduler_address)  # imports
            pair = [
                command(scene, number, jobs, ending, scheduler)
                for scheduler in (None, cluster.scheduler_address)
            ]
            same = np.array_equal(*(row.pop("ends") for row in pair))
            here, there = (row["seconds"] for row in pair)
            rows += [row | {"throughput": here / row["seconds"], "same": same} for row in pair]
            print(f"out{ending}: {here / there:.2f} of the throughput here, same ends: {same}")
    return rows


def ends_in(output: Path, number: int) -> Array:
    """The ends of the checked members in a result, shape (members, 4)."""
    if output.suffix == ".npz":
        with np.load(output) as arrays:
            return np.array([arrays[f"final/{name}"][checked(number)] for name in STATE]).T
    import zarr

    group = zarr.open_group(str(output), mode="r")
    return np.array([group[f"final.{name}"][:][checked(number)] for name in STATE]).T


def heyoka(number: int, jobs: int, tolerance: float) -> dict[str, Any]:
    """The same motions by heyoka, whose threads are limited to as many."""
    import heyoka as hy

    width, names = hy.recommended_simd_size(), hy.make_vars("a", "b", "u", "v")
    system = list(zip(names, slopes(names, hy.sin, hy.cos), strict=True))
    template = hy.taylor_adaptive_batch(system, np.zeros((4, width)), tol=tolerance)
    wanted, ends = checked(number), {}
    started, used = time.perf_counter(), time.process_time()
    for first, releases in parts(number):
        count = -(-len(releases) // width)
        padded = np.resize(releases, (count * width, 2)).reshape(count, width, 2)

        def begin(integrator: Any, k: int, padded: Array = padded) -> Any:
            integrator.set_time(0.0)
            integrator.state[:] = np.vstack([padded[k].T, np.zeros((2, width))])
            return integrator

        found = hy.ensemble_propagate_until_batch(template, UNTIL, count, begin)
        states = np.concatenate([of[0].state.T for of in found])
        ends |= {k: states[k - first] for k in wanted if first <= k < first + len(releases)}
    seconds, processor = time.perf_counter() - started, time.process_time() - used
    found_ends = np.array([ends[k] for k in wanted])
    return {
        "way": f"heyoka, batches of {width}, tol {tolerance:g}",
        "seconds": seconds,
        "processor": processor,
        "ends": found_ends,
    }


# -- measuring ----------------------------------------------------------------


def checked(number: int) -> list[int]:
    found: list[int] = np.linspace(0, number - 1, min(CHECKED, number)).astype(int).tolist()
    return found


def error(ends: Array, number: int) -> float:
    """The largest error of some members' ends, over the scales of the promise."""
    drawn, worst = members(number), 0.0
    for k, end in zip(checked(number), ends, strict=True):
        a, b = (float(x[0]) for x in drawn.numbers(k, k + 1))
        exact = np.array(
            [[float(x) for x in y] for y in reference(np.linspace(0, UNTIL, 101), (a, b))]
        )
        scales = np.concatenate([np.ones(2), np.abs(exact[:, 2:]).max(axis=0)])
        worst = max(worst, float(np.abs((end - exact[-1]) / scales).max()))
    return worst


def measured(scene: str, number: int, jobs: int) -> list[dict[str, Any]]:
    """Run all ways, one after the other."""
    found: list[Callable[[], dict[str, Any]]] = [
        lambda: alone(scene, number, jobs),
        lambda: command(scene, number, jobs, ".zarr"),
        lambda: command(scene, number, jobs, ".npz"),
    ]
    if importlib.util.find_spec("heyoka"):
        found += [lambda tol=tol: heyoka(number, jobs, tol) for tol in TOLERANCES]
    rows = []
    for way in found:
        row = way()
        ends = row.pop("ends", None)
        row["error"] = None if ends is None else error(ends, number)
        row["load"] = os.getloadavg()[0]
        rows.append(row)
    return rows


def table(rows: list[dict[str, Any]], number: int) -> str:
    """Markdown: a row a way."""
    head = (
        "way",
        "µs a member",
        "times the integration alone",
        "processor, µs",
        "times the same",
        "memory, MB",
        "error",
        "not held",
        "load",
    )
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for row in rows:
        memory, off = row.get("memory"), row["error"]
        cells = [
            f"{1e6 * row['seconds'] / number:.1f}",
            f"{row['seconds'] / rows[0]['seconds']:.2f}",
            f"{1e6 * row['processor'] / number:.1f}",
            f"{row['processor'] / rows[0]['processor']:.2f}",
            "" if memory is None else f"{memory / 1e6:.0f}",
            "" if off is None else f"{off:.1e}",
            str(row.get("not_held", "")),
            f"{row['load']:.1f}",
        ]
        lines.append(f"| {' | '.join([row['way'], *cells])} |")
    return "\n".join(lines)


def scene_of(text: str) -> str:
    """The scene of ensemble.py, released from the centre."""
    return text % (GRAVITY, *CENTRE)
