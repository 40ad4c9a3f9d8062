"""Derivatives of right-hand sides in emitted C, in right-hand sides, scene by scene.

Each scene's emitted C is compiled as its users compile it, and ``NAME_jacobian`` (2n rates by 2n
numbers of the state; where few can differ from zero, ``NAME_jacobian_entries``) takes turns with
``NAME_rhs`` at 64 states around the scene's start.
Forward differences take 2n + 1 right-hand sides for the same numbers, to half the digits; the bar
is n + 3.

    python benchmarks/jacobians.py
    python benchmarks/jacobians.py systems/pendulums systems/chains/pendulum_chain.yaml -p n=16
"""

from __future__ import annotations

import argparse
import ctypes
import statistics
import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from reporting import scene_files

from lagrange_cli import load
from lagrange_cli.errors import LagrangeError

FLAGS = ["-std=c99", "-O2", "-march=native", "-fno-math-errno", "-ffp-contract=off"]

#: States around the start that are met in turn.
STATES = 64

#: Calls of one function before the other has its turn take about this many seconds.
TURN = 0.0005

LOOP = """
#include "@NAME@.h"
#include <time.h>
static double work[@NAME@_WORK];
static double out[@SIZE@];
double run(int which, long calls, const double *y, const double *u, const @NAME@_params *p)
{
    struct timespec a, b;
    long k;
    double sum = 0.0;
    clock_gettime(CLOCK_MONOTONIC, &a);
    for (k = 0; k < calls; ++k) {
        const double *const state = y + (k % @STATES@)*@WIDTH@;
        const int status = which ? @NAME@_@FUNCTION@(0.1, state, u, p, work, out)
                                 : @NAME@_rhs(0.1, state, u, p, work, out);
        sum += out[0] + status;
    }
    clock_gettime(CLOCK_MONOTONIC, &b);
    out[0] = sum;
    return (double)(b.tv_sec - a.tv_sec) + 1e-9*(double)(b.tv_nsec - a.tv_nsec);
}
void fill(@NAME@_params *p) { @NAME@_defaults(p); }
"""


def measure(path: str, parameters: dict[str, str], rounds: int) -> dict[str, Any] | None:
    """Measure one scene; None where there is nothing to measure."""
    try:
        derivation = load(path, parameters=parameters).derive()
        equations = derivation.equations
        if (
            not equations.system.coordinates
            or equations.system.contacts
            or equations.system.initial is None
        ):
            return None
        started = time.perf_counter()
        files = derivation.emit("c", jacobian=True)
    except LagrangeError:
        return None
    emitted = time.perf_counter() - started
    n = len(equations.system.coordinates)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for file, text in files.items():
            (folder / file).write_text(text, encoding="utf-8")
        (source,) = [folder / file for file in files if file.endswith(".c")]
        sparse = "_jacobian_entries" in source.with_suffix(".h").read_text(encoding="utf-8")
        replacements = {
            "@NAME@": source.stem,
            "@FUNCTION@": "jacobian_entries" if sparse else "jacobian",
            "@SIZE@": str(4 * n * n + 2),
            "@WIDTH@": str(2 * n),
        }
        loop = LOOP.replace("@STATES@", str(STATES))
        for token, text in replacements.items():
            loop = loop.replace(token, text)
        (folder / "loop.c").write_text("#define _POSIX_C_SOURCE 199309L\n" + loop)
        library = folder / "library.so"
        words = ["gcc", *FLAGS, "-shared", "-fPIC", str(source), str(folder / "loop.c")]
        subprocess.run([*words, "-o", str(library), "-lm"], check=True)
        code = ctypes.CDLL(str(library))
        seconds = _seconds(code, derivation, rounds)
    # Others on the machine add to times and never take away.
    rhs, jacobian = (min(times) for times in zip(*seconds, strict=True))
    return {
        "scene": Path(path).stem,
        "n": n,
        "rhs": rhs,
        "jacobian": jacobian,
        "ratio": jacobian / rhs,
        "emitted": emitted,
    }


def _seconds(code: ctypes.CDLL, derivation: Any, rounds: int) -> list[tuple[float, float]]:
    """Seconds of one call of both functions, round by round."""
    equations = derivation.equations
    start = np.array([*equations.system.initial.positions, *equations.system.initial.velocities])
    moves = np.random.default_rng(1).uniform(0.0, 0.01, (STATES, len(start)))
    states = np.ascontiguousarray(start + moves * (np.abs(start).max() or 1.0))
    inputs = np.zeros(max(1, len(equations.system.inputs)))
    parameters = np.zeros(max(1, len(equations.system.parameters)))
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (states, inputs, parameters)]
    code.fill(pointers[2])
    run = code.run
    run.restype, run.argtypes = (
        ctypes.c_double,
        [ctypes.c_int, ctypes.c_long, *[ctypes.c_void_p] * 3],
    )
    # The first calls are slower, and others may be interrupted.
    fastest = [min(run(which, 200, *pointers) for _ in range(9)) for which in (0, 1)]
    calls = [max(1, int(200 * TURN / seconds)) for seconds in fastest]
    return [
        tuple(run(which, calls[which], *pointers) / calls[which] for which in (0, 1))
        for _ in range(rounds)
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["systems"])
    parser.add_argument("-p", dest="parameters", action="append", default=[], metavar="NAME=VALUE")
    parser.add_argument("--rounds", type=int, default=25)
    options = parser.parse_args()
    parameters = dict(text.split("=", 1) for text in options.parameters)
    rows = []
    print("| scene | n | right-hand side, µs | jacobian, µs | in right-hand sides | n + 3 |")
    print("|---|---|---|---|---|---|")
    for path in scene_files(options.scenes):
        row = measure(str(path), parameters, options.rounds)
        if row is not None:
            rows.append(row)
            print(
                f"| {row['scene']} | {row['n']} | {1e6 * row['rhs']:.3f} |"
                f" {1e6 * row['jacobian']:.3f} | {row['ratio']:.1f} | {row['n'] + 3} |",
                flush=True,
            )
    beyond = [row["scene"] for row in rows if row["ratio"] > row["n"] + 3]
    ratios = [row["ratio"] for row in rows]
    print(
        f"\n{len(rows)} scenes, median {statistics.median(ratios):.1f}; beyond: {beyond or 'none'}"
    )


if __name__ == "__main__":
    main()
