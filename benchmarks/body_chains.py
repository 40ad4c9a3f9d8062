"""Chains of rigid bodies in space: seconds from the scene to C, and one right-hand side of an arm.

Joints turn about y and x in turn, or about z and y as those of an arm, whose bodies have three
moments. M and f of chains of seven and more joints follow by recursion over the frames. Seconds are
of the processor, without imports; operations are those of one right-hand side, the solution of
M a = f among them.

    python benchmarks/body_chains.py --count 25 50 100 200 --json body_chains.json
"""

from __future__ import annotations

import argparse
import gc
import json
import tempfile
import time
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from right_hand_side import FEWEST, LENGTH, compiled, timed

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import COLLECTION
from lagrange_cli.mechanics import derive
from lagrange_cli.program.operations import count_operations, elimination_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.scene import read_text

ARM = 7


def chain(n: int) -> str:
    """A scene of n equal rods."""
    lines = ["name: chain", "parameters: {m: 1.0, l: 0.5, g: 9.81}", "bodies:"]
    for k in range(n):
        on = f"on: b{k - 1}, at: [0, 0, -l], " if k else ""
        turn = f"turn: {{{'xy'[k % 2]}: q{k}}}"
        lines.append(f"  b{k}: {{{on}{turn}, centre: [0, 0, -l/2], mass: m, inertia: {{rod: l}}}}")
    return "\n".join([*lines, _end(n)])


def arm(n: int) -> str:
    """A scene of n bodies with moments of their own."""
    lines = ["name: arm", "bodies:"]
    for k in range(n):
        on = f"on: b{k - 1}, at: [0, 0, {0.22 + 0.02 * k:.2f}], " if k else ""
        moments = f"[{0.03 + 0.01 * k:.3f}, {0.032 + 0.012 * k:.3f}, {0.028 + 0.008 * k:.3f}]"
        lines.append(
            f"  b{k}: {{{on}turn: {{{'zy'[k % 2]}: q{k}}}, centre: [0, 0, {0.11 + 0.01 * k:.2f}],"
            f" mass: {1.1 + 0.1 * k:.1f}, inertia: {moments}}}"
        )
    return "\n".join([*lines, "parameters: {g: 9.81}", _end(n)])


def _end(n: int) -> str:
    names = ", ".join(f"q{k}" for k in range(n))
    return f"coordinates: [{names}]\npotentials: {{weight: {{gravity: g}}}}\n"


def measured(text: str, kind: str, n: int) -> tuple[dict[str, Any], dict[str, str]]:
    """Return seconds and operations of a scene, and its C."""
    clock = [time.process_time()]
    scene = read_text(text)
    clock.append(time.process_time())
    equations = derive(scene)
    clock.append(time.process_time())
    files = EMITTERS["c"].emit(equations)
    clock.append(time.process_time())
    program = build_program(equations, ["acceleration"])
    operations = count_operations(program).total + elimination_operations(program)
    seconds = dict(zip(("read", "derive", "emit"), np.diff(clock).tolist(), strict=True))
    row = {"kind": kind, "n": n, "seconds": seconds, "operations": operations}
    return row, {"header": files[f"{kind}.h"], "source": files[f"{kind}.c"]}


def measured_chain(n: int) -> dict[str, Any]:
    """Return seconds and operations of a chain; called in a process of its own.

    SymPy keeps expressions of a chain before, and compares equal ones of the next part by part.
    """
    gc.set_threshold(*COLLECTION)  # as the command line does
    return measured(chain(n), "chain", n)[0]


def right_hand_side(files: dict[str, str], n: int, folder: Path) -> float:
    """Return the microseconds of one right-hand side, the least of several rounds."""
    (folder / "arm.h").write_text(files["header"])
    (line,) = [x for x in files["header"].splitlines() if x.startswith("#define arm_WORK ")]
    random = np.random.default_rng(n)
    states = np.hstack([random.uniform(-3, 3, (64, n)), random.uniform(-2, 2, (64, n))])
    method = compiled(
        *("lagrange, C", folder / "arm", [files["source"], '#include "arm.h"\n']),
        "status |= arm_rhs(0.0, state, 0, (const arm_params *)given, work, out);",
        *(states, np.array([9.81]), 2 * n),
        work=int(line.split()[-1]),
        after=lambda out: out[n:],
    )
    calls = max(FEWEST, int(1e6 * LENGTH / timed(method, FEWEST)))
    return min(timed(method, calls) for _ in range(15))


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: a row a scene."""
    lines = [
        "| scene | joints | read, s | derive, s | emit, s | operations | right-hand side, µs |",
        "|" + "---|" * 7,
    ]
    for row in rows:
        seconds = " | ".join(f"{row['seconds'][k]:.2f}" for k in ("read", "derive", "emit"))
        time_of_one = f"{row['microseconds']:.2f}" if "microseconds" in row else "–"
        lines.append(
            f"| {row['kind']} | {row['n']} | {seconds} | {row['operations']} | {time_of_one} |"
        )
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--count", type=int, nargs="*", default=[4, 8, 16, 32])
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    rows = []
    row, files = measured(arm(ARM), "arm", ARM)
    with tempfile.TemporaryDirectory() as folder:
        row["microseconds"] = right_hand_side(files, ARM, Path(folder))
    rows.append(row)
    with get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        rows += [pool.apply(measured_chain, (n,)) for n in options.count]
    print(table(rows))
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
