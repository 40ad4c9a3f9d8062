"""How long the language server takes to answer, on a scene of some 100 lines.

A session over real streams: the scene is opened, and requests about random places of it follow,
each after a change of the text, so that nothing is answered from before. The first request of each
kind starts processes and is not counted. Beside it stands what the same answers take of a processor
where no other program runs between.

    python benchmarks/language_server.py --requests 50
"""

from __future__ import annotations

import argparse
import random
import statistics
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]

sys.path.insert(0, str(ROOT))

from lagrange_cli.editors.answers import answered  # noqa: E402
from tests.editors.session import Session  # noqa: E402

#: Request of the protocol → the answer that it needs.
REQUESTS = {
    "completion": "completions",
    "hover": "hover",
    "definition": "definition",
    "rename": "renamed",
}


def scene(lines: int) -> str:
    """A chain of masses on springs, written out, of so many lines."""
    number = max(2, (lines - 12) // 4)
    masses = range(1, number + 1)
    return "\n".join(
        [
            "title: A chain of masses on springs",
            "parameters:",
            "  k: {value: 100, unit: N/m}",
            *(f"  m{i}: {{value: {i}, unit: kg}}" for i in masses),
            "particles:",
            *(f"  b{i}: {{mass: m{i}, position: [x{i}, 0, 0]}}" for i in masses),
            f"coordinates: [{', '.join(f'x{i}' for i in masses)}]",
            "potentials:",
            "  first: k*x1^2/2",
            *(f"  s{i}: k*(x{i} - x{i - 1})^2/2" for i in masses[1:]),
            "initial:",
            *(f"  x{i}: {i}/10" for i in masses),
            "simulate: {until: 1}",
            "",
        ]
    )


def measured(session: Session, method: str, draw: random.Random) -> float:
    """Seconds from a change of the text to the answer about a place of it."""
    name = f"x{draw.randint(2, 9)}"
    session.replace(session.text.splitlines()[0], f"title: A chain, {draw.random()}")
    further = {"newName": "another_name"} if method == "rename" else {}
    started = time.perf_counter()
    session.about(method, f"({name}", **further)
    return time.perf_counter() - started


def of_processor(text: str, method: str, draw: random.Random) -> float:
    """Seconds of a processor that an answer takes, of a text that was not read before."""
    text = text.replace("A chain", f"A chain, {draw.random()},", 1)
    offset = text.index(f"(x{draw.randint(2, 9)}") + 3
    line, column = text.count("\n", 0, offset) + 1, offset - text.rindex("\n", 0, offset)
    place = {"offset": offset} if method == "completion" else {"line": line, "column": column}
    further = {"hover": {"derived": None}, "rename": {"name": "another_name"}}.get(method, {})
    started = time.process_time()
    answered({"ask": REQUESTS[method], "text": text, "file": "scene.yaml", **place, **further})
    return time.process_time() - started


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--lines", type=int, default=100)
    parser.add_argument("--requests", type=int, default=50, help="of each kind")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    draw, text = random.Random(given.seed), scene(given.lines)
    print(f"A scene of {text.count(chr(10))} lines; milliseconds of {given.requests} requests:\n")
    print("| request | median | nine of ten | longest | of a processor, median |")
    print("|---|---:|---:|---:|---:|")
    with tempfile.TemporaryDirectory() as folder:
        session = Session(Path(folder))
        session.open(text)
        for method in REQUESTS:
            measured(session, method, draw)
            times = [1e3 * measured(session, method, draw) for _ in range(given.requests)]
            ninth = statistics.quantiles(times, n=10)[-1]
            alone = [1e3 * of_processor(text, method, draw) for _ in range(given.requests)]
            cells = [statistics.median(times), ninth, max(times), statistics.median(alone)]
            print(f"| {method} | {' | '.join(f'{cell:.0f}' for cell in cells)} |")
        session.leave()
    return 0


if __name__ == "__main__":
    sys.exit(main())
