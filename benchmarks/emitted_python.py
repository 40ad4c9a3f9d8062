"""Time of a right-hand side of emitted Python: one state, many, by hand, compiled, and in C.

    python -m benchmarks.emitted_python [--states 1000]

The double pendulum as ``emit --to python`` writes it, NumPy code that a person wrote for it, the
same module under Numba, and ``emit --to c``. Numba and C call the function in a loop of their own,
each state in turn. Each time is the smallest of several runs.
"""

from __future__ import annotations

import argparse
import ctypes
import shutil
import subprocess
import tempfile
import timeit
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from lagrange_cli import load

SCENE = Path(__file__).parents[1] / "systems" / "pendulums" / "double_pendulum.yaml"

#: Calls in a loop that is compiled.
CALLS = 100_000

LOOP = """
#include "double_pendulum.h"
int loop(long calls, long states, const double *y, const double *p, double *total)
{
    double work[double_pendulum_WORK + 1], out[4];
    long k;
    for (k = 0; k < calls; ++k) {
        const double_pendulum_params *q = (const double_pendulum_params *)p;
        if (double_pendulum_rhs(0.0, y + 4*(k % states), 0, q, work, out)) {
            return 1;
        }
        *total += out[2];
    }
    return 0;
}
"""


def by_hand(t: float, y: Any, p: Any) -> Any:
    """Return the right-hand side as a person writes it."""
    m1, m2, l1, l2, g = p
    a, b, u, v = y
    sin, cos = np.sin(a - b), np.cos(a - b)
    mass = m1 + m2 * sin * sin
    dydt = np.empty(y.shape)
    dydt[0] = u
    dydt[1] = v
    sin_a, sin_b = np.sin(a), np.sin(b)
    pull = m2 * l2 * v * v * sin + (m1 + m2) * g * sin_a
    turn = l1 * u * u * sin - g * sin_b
    dydt[2] = -(pull + m2 * cos * turn) / (l1 * mass)
    dydt[3] = (pull * cos + (m1 + m2) * turn) / (l2 * mass)
    return dydt


def module_of(style: str, folder: Path) -> dict[str, Any]:
    """Return the names that an emitted module defines."""
    (text,) = load(SCENE).derive().emit("python", style=style).values()
    names: dict[str, Any] = {"__name__": style}
    exec(compile(text, str(folder / style), "exec"), names)
    return names


def seconds(calls: dict[str, tuple[Callable[[], object], int]]) -> dict[str, float]:
    """Return the smallest times of calls, which take turns, over the states that each evaluates."""
    timers = {label: timeit.Timer(call) for label, (call, _) in calls.items()}
    repeats = {label: max(1, timer.autorange()[0] // 10) for label, timer in timers.items()}
    best = dict.fromkeys(calls, float("inf"))
    for _ in range(60):
        for label, timer in timers.items():
            best[label] = min(best[label], timer.timeit(repeats[label]) / repeats[label])
    return {label: best[label] / states for label, (_, states) in calls.items()}


def c_loop(folder: Path) -> Any:
    """Return the loop of calls in C."""
    for name, text in load(SCENE).derive().emit("c").items():
        (folder / name).write_text(text, encoding="utf-8")
    (folder / "loop.c").write_text(LOOP, encoding="utf-8")
    compiler = shutil.which("gcc") or shutil.which("cc")
    assert compiler is not None, "a compiler of C is needed"
    sources = [folder / "loop.c", folder / "double_pendulum.c"]
    command = [compiler, "-O3", "-shared", "-fPIC", *sources, "-o", folder / "loop.so", "-lm"]
    subprocess.run([str(word) for word in command], check=True)
    return ctypes.CDLL(str(folder / "loop.so")).loop


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--states", type=int, default=1000)
    states = parser.parse_args().states
    with tempfile.TemporaryDirectory() as name:
        table(states, Path(name))


def table(states: int, folder: Path) -> None:
    """Print the table."""
    import numba

    numpy, jitted = (module_of(style, folder) for style in ("numpy", "numba"))
    y = np.random.default_rng(1).uniform(-1, 1, (4, states))
    one, p = y[:, 0].copy(), numpy["DEFAULTS"]
    assert np.allclose(numpy["rhs"](0.0, y), by_hand(0.0, y, p), rtol=1e-12)

    rhs = jitted["rhs"]

    @numba.njit
    def numba_loop(calls: int, rows: Any, p: Any) -> float:
        total = 0.0
        for k in range(calls):
            total += rhs(0.0, rows[k % len(rows)], p)[2]
        return total

    rows, numbers = np.ascontiguousarray(y.T), np.array(p)
    loop, total = c_loop(folder), ctypes.c_double()
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (rows, numbers)]

    def run_c() -> None:
        assert not loop(ctypes.c_long(CALLS), ctypes.c_long(states), *pointers, ctypes.byref(total))

    numba_loop(1, rows, jitted["DEFAULTS"])
    measured = seconds(
        {
            "NumPy, one state": (lambda: numpy["rhs"](0.0, one), 1),
            "by hand, one state": (lambda: by_hand(0.0, one, p), 1),
            f"NumPy, {states} states": (lambda: numpy["rhs"](0.0, y), states),
            f"by hand, {states} states": (lambda: by_hand(0.0, y, p), states),
            "Numba, a loop": (lambda: numba_loop(CALLS, rows, jitted["DEFAULTS"]), CALLS),
            "C, a loop": (run_c, CALLS),
        }
    )
    print("right-hand side of a double pendulum        ns a state")
    for label, time in measured.items():
        print(f"  {label:<40}{time * 1e9:>12.1f}")


if __name__ == "__main__":
    main()
