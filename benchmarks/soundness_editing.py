"""Scenes in the making through `fmt` and the language server: an answer or a located refusal.

The scenes of soundness_mutants.py, half of them with a part cut out as it is while somebody types,
are laid out and given to each answer of the server at a random place. Counted are exceptions,
answers that take 20 seconds of a processor, problems without a place in the text, layouts that are
laid out anew, and other names after which a scene is refused that was not. All is drawn from the
seed.

    python benchmarks/soundness_editing.py --scenes 20000 --seed 1 -j 2
"""

from __future__ import annotations

import argparse
import multiprocessing
import random
import re
import signal
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

from mutants import mutant, sources

from lagrange_cli.editors.answers import answered
from lagrange_cli.errors import InputError
from lagrange_cli.scene import laid_out
from lagrange_cli.scene.reader import read_partly

#: Seconds of a processor that one answer may take.
PATIENCE = 20

ASKED = ("fmt", "problems", "completions", "hover", "definition", "renamed")

_trees: list[Any] = []


class LateError(BaseException):
    """An answer has taken :data:`PATIENCE` seconds."""


def _late(number: int, frame: FrameType | None) -> None:
    raise LateError


def drawn(number: int, seed: int, trees: list[Any]) -> tuple[str, int]:
    """A text and an offset in it; the same everywhere."""
    draw = random.Random(f"editing {seed}/{number}")
    text = mutant(number, seed, trees).text
    if draw.random() < 0.5:
        start = draw.randint(0, len(text))
        text = text[:start] + text[min(len(text), start + draw.randint(0, 40)) :]
    words = [match.start() for match in re.finditer(r"[A-Za-z_]\w*", text)]
    at_word = words and draw.random() < 0.7
    return text, draw.choice(words) if at_word else draw.randint(0, len(text))


def layout(text: str) -> str:
    """Lay a text out, twice; return what is wrong, or ""."""
    once = laid_out(text.encode("utf-8", "replace"), "f")
    return "" if laid_out(once.encode(), "f") == once else "another layout the second time"


def answer(asked: str, text: str, offset: int) -> str:
    """Ask the server about a place; return what is wrong, or ""."""
    line = text.count("\n", 0, offset) + 1
    column = offset - (text.rfind("\n", 0, offset) + 1) + 1
    places: dict[str, dict[str, Any]] = {
        "problems": {},
        "completions": {"offset": offset},
        "hover": {"line": line, "column": column, "derived": None},
        "definition": {"line": line, "column": column},
        "renamed": {"line": line, "column": column, "name": "another_name"},
    }
    found = answered({"ask": asked, "text": text, "file": "f", **places[asked]})
    if asked == "problems":
        lines = len(text.splitlines()) + 1
        beyond = [p for p in found if not 0 <= p["range"]["line"] <= lines]
        return f"no place: {beyond[0]['message']}" if beyond else ""
    if asked == "renamed" and "edits" in found:
        return _renamed(text, found["edits"])
    return ""


def _renamed(text: str, edits: list[dict[str, Any]]) -> str:
    """Whether a text with another name is refused where it was not."""
    lines = text.splitlines(keepends=True)
    for edit in sorted(edits, key=lambda e: e["range"]["start"], reverse=True):
        place = edit["range"]
        old = lines[place["line"]]
        lines[place["line"]] = old[: place["start"]] + edit["text"] + old[place["end"] :]
    before, after = (
        any(p.severity == "error" for p in read_partly(t, "f")[1]) for t in (text, "".join(lines))
    )
    return "refused with another name" if after and not before else ""


def judged(work: Callable[[], str]) -> str:
    """Do some work within its time; return what is wrong, ``refused``, or ""."""
    signal.signal(signal.SIGPROF, _late)
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    try:
        return work()
    except InputError as error:
        bare = [p for p in error.problems if p.mark is None]
        return f"no place: {bare[0].message}" if bare else "refused"
    except LateError:
        return f"late: more than {PATIENCE} s"
    except Exception as error:
        return f"raised {type(error).__name__}: {error}"
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


@dataclass
class Tally:
    """Outcomes by what was asked, the longest time, and what is wrong."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    longest: float = 0.0
    wrong: list[tuple[int, str, str]] = field(default_factory=list)

    def add(self, number: int, asked: str, outcome: str, seconds: float) -> None:
        self.longest = max(self.longest, seconds)
        self.counts[asked, "wrong" if outcome not in ("", "refused") else outcome] += 1
        if outcome not in ("", "refused"):
            self.wrong.append((number, asked, outcome))

    def join(self, other: Tally) -> None:
        self.counts += other.counts
        self.longest = max(self.longest, other.longest)
        self.wrong += other.wrong


def _prepare() -> None:
    _trees[:] = sources()


def _part(job: tuple[int, int, int]) -> Tally:
    first, behind, seed = job
    tally = Tally()
    for number in range(first, behind):
        text, offset = drawn(number, seed, _trees)
        for asked in ASKED:
            started = time.process_time()
            if asked == "fmt":
                outcome = judged(lambda text=text: layout(text))  # type: ignore[misc]
            else:
                outcome = judged(lambda a=asked, t=text, o=offset: answer(a, t, o))  # type: ignore[misc]
            tally.add(number, asked, outcome, time.process_time() - started)
    return tally


def tallies(count: int, first: int, seed: int, jobs: int) -> Iterator[Tally]:
    """The counts of parts of the scenes, as they come."""
    size = 200
    end = first + count
    work = [(start, min(start + size, end), seed) for start in range(first, end, size)]
    if jobs == 0:
        _prepare()
        yield from map(_part, work)
        return
    with multiprocessing.get_context("spawn").Pool(jobs, _prepare) as pool:
        yield from pool.imap_unordered(_part, work)


def table(tally: Tally) -> str:
    """The counts as Markdown."""
    lines = ["| asked | scenes | answered | refused | wrong |", "|---|---:|---:|---:|---:|"]
    for asked in ASKED:
        ends = [tally.counts[asked, outcome] for outcome in ("", "refused", "wrong")]
        lines.append(f"| {asked} | {sum(ends):,} | {' | '.join(f'{end:,}' for end in ends)} |")
    return "\n".join([*lines, "", f"The longest took {tally.longest:.2f} s of a processor."])


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--scenes", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-j", "--jobs", type=int, default=2)
    given = parser.parse_args()
    tally = Tally()
    for done in tallies(given.scenes, given.first, given.seed, given.jobs):
        tally.join(done)
        for number, asked, outcome in done.wrong:
            print(f"{number}: {asked}: {outcome}", file=sys.stderr)
    print(table(tally))
    return int(bool(tally.wrong))


if __name__ == "__main__":
    sys.exit(main())
