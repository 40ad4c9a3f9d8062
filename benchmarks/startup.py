"""Time of whole commands, from starting the process to its end, side by side with imports.

Each command is run on the double pendulum of systems/pendulums: cold, with a
cache that is empty each time, and warm, with one that knows the answer. The
programs take turns; medians and quartiles are reported, and ratios to
``python -c "import numpy"``. Beside them stands the least processor time of a
process and its children, which other work on the machine disturbs less. What a
command prints warm must be what it prints cold, byte for byte.

Byte code of the package is kept, as pip installs it: the first turn, which does
not count, writes what is missing, even if PYTHONDONTWRITEBYTECODE is set here.

    python benchmarks/startup.py --json startup.json

MechanicsDSL (PyPI: mechanicsdsl-core) takes part where its command
``mechanicsdsl`` is found, or given by --mechanicsdsl: it is best installed in
a virtual environment of its own.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

SCENE = str(Path(__file__).resolve().parents[1] / "systems/pendulums/double_pendulum.yaml")
REFERENCE = "import numpy"
COMMANDS = {
    "derive": ["derive", SCENE],
    "emit --to c": ["emit", SCENE, "--to", "c", "-o"],
    "simulate": ["simulate", SCENE],
}

#: The same system for MechanicsDSL.
MECHANICSDSL = r"""\system{double_pendulum}
\defvar{theta1}{angle}{rad}
\defvar{theta2}{angle}{rad}
\parameter{m1}{1.0}{kg}
\parameter{m2}{1.0}{kg}
\parameter{l1}{1.0}{m}
\parameter{l2}{1.0}{m}
\parameter{g}{9.81}{m/s^2}
\lagrangian{
    \frac{1}{2}*(m1+m2)*l1^2*\dot{theta1}^2
    + \frac{1}{2}*m2*l2^2*\dot{theta2}^2
    + m2*l1*l2*\dot{theta1}*\dot{theta2}*\cos{theta1-theta2}
    + (m1+m2)*g*l1*\cos{theta1}
    + m2*g*l2*\cos{theta2}
}
\initial{theta1=1.5, theta2=2.0}
"""


@dataclass(frozen=True)
class Program:
    """A command line; ``cache`` is ``cold``, ``warm`` or, where it matters not, empty."""

    name: str
    words: tuple[str, ...]
    cache: str = ""


def programs(work: Path, mechanicsdsl: str | None) -> list[Program]:
    python = sys.executable
    found = [
        Program("python -c pass", (python, "-c", "pass")),
        Program("import click", (python, "-c", "import click")),
        Program(REFERENCE, (python, "-c", REFERENCE)),
        Program("import sympy", (python, "-c", "import sympy")),
        Program("lagrange --help", (python, "-m", "lagrange_cli", "--help")),
    ]
    for name, words in COMMANDS.items():
        output = [str(work / "out")] if words[-1] == "-o" else []
        command = (python, "-m", "lagrange_cli", *words, *output)
        found += [Program(f"lagrange {name}", command, cache) for cache in ("cold", "warm")]
    if mechanicsdsl:
        scene = work / "double_pendulum.mdsl"
        scene.write_text(MECHANICSDSL)
        found.append(Program("mechanicsdsl run", (mechanicsdsl, "run", str(scene))))
    return found


def caches(work: Path) -> Iterator[Path]:
    """Folders that are not there yet."""
    return (work / f"cache{number}" for number in count())


class Seconds(NamedTuple):
    """Seconds that a process took: by the clock, and those of processors, with its children's."""

    wall: float
    processor: float


def children_seconds() -> float:
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def timed(program: Program, cache: Path) -> tuple[Seconds, bytes]:
    """Seconds that a process took, and what it printed."""
    environment = os.environ | {"XDG_CACHE_HOME": str(cache), "PYTHONIOENCODING": "utf-8"}
    for name in ("LAGRANGE_CACHE", "PYTHONDONTWRITEBYTECODE"):
        environment.pop(name, None)
    before, start = children_seconds(), time.perf_counter()
    done = subprocess.run(program.words, env=environment, capture_output=True, check=False)
    seconds = Seconds(time.perf_counter() - start, children_seconds() - before)
    if done.returncode != 0:
        raise SystemExit(f"{program.name} failed:\n{done.stderr.decode()}")
    return seconds, done.stdout


def measure(candidates: Sequence[Program], repetitions: int, work: Path) -> list[dict[str, Any]]:
    """Seconds of every program, the programs taking turns; the first turn does not count."""
    fresh = caches(work)
    warm = next(fresh)
    seconds: dict[Program, list[Seconds]] = {program: [] for program in candidates}
    printed: dict[str, set[bytes]] = {program.name: set() for program in candidates}
    for turn in range(repetitions + 1):
        for program in candidates:
            cache = next(fresh) if program.cache == "cold" else warm
            duration, output = timed(program, cache)
            if program.cache:
                printed[program.name].add(output)
            if turn:
                seconds[program].append(duration)
        print(f"turn {turn} of {repetitions} done", file=sys.stderr)
    reference = statistics.median(
        next(
            [taken.wall for taken in times]
            for program, times in seconds.items()
            if program.name == REFERENCE
        )
    )
    return [
        row(program, times, reference, len(printed[program.name]) <= 1)
        for program, times in seconds.items()
    ]


def row(program: Program, measured: list[Seconds], reference: float, same: bool) -> dict[str, Any]:
    times = [taken.wall for taken in measured]
    median = statistics.median(times)
    quartiles = statistics.quantiles(times, n=4) if len(times) > 1 else [median] * 3
    return {
        "program": program.name,
        "cache": program.cache,
        "seconds": median,
        "quartiles": [quartiles[0], quartiles[2]],
        "ratio": median / reference,
        "processor_seconds": min(taken.processor for taken in measured),
        "same_output": same,
        "all_seconds": times,
    }


def table(rows: Sequence[dict[str, Any]]) -> str:
    """Markdown: milliseconds and the ratio to importing NumPy."""
    heads = ["program", "cache", "median, ms", "quartiles, ms", "ratio to `import numpy`"]
    heads.append("processor, least, ms")
    lines = [f"| {' | '.join(heads)} |", "|" + "---|" * len(heads)]
    for found in rows:
        low, high = (f"{1e3 * quartile:.0f}" for quartile in found["quartiles"])
        lines.append(
            f"| `{found['program']}` | {found['cache'] or '–'} | {1e3 * found['seconds']:.0f} "
            f"| {low} to {high} | {found['ratio']:.2f} | {1e3 * found['processor_seconds']:.0f} |"
        )
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repetitions", type=int, default=15)
    parser.add_argument("--mechanicsdsl", metavar="COMMAND", default=shutil.which("mechanicsdsl"))
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        rows = measure(programs(work, options.mechanicsdsl), options.repetitions, work)
    print(table(rows))
    if options.json:
        libraries = ("click", "numpy", "scipy", "sympy")
        about = {"python": platform.python_version()} | {n: version(n) for n in libraries}
        with open(options.json, "w", encoding="utf-8") as file:
            json.dump({"about": about, "rows": rows}, file, indent=1)
    different = sorted({found["program"] for found in rows if not found["same_output"]})
    print("\nprinted the same cold and warm:", f"all but {different}" if different else "all")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
