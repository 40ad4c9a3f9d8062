"""Mutated scenes and expressions through the command line: no internal error, no silent hang.

Scenes that are shipped, and some small ones, are changed at random: their YAML, their numbers
(to extremes), their expressions (functions exchanged, kinks, towers, primes), names and sections;
with ``--structured`` a grammar makes them (structured.py). Each runs through the entry of the
command line, in a process that works many off. One that says nothing for 20 seconds of a processor,
where a terminal would show where it stands, is ended and counted; one that goes on for 45 seconds
is ended. Counted are exit codes, refusals of a scene without a place, what raised, and files that
no option named. All is drawn from the seed.

    python benchmarks/soundness_mutants.py --mutants 30000 --seed 1 -j 2
    python benchmarks/soundness_mutants.py --structured --mutants 20000 --longest 10
"""

from __future__ import annotations

import argparse
import contextlib
import io
import json
import multiprocessing
import os
import re
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from mutants import Mutant, mutant, sources
from structured import structured

#: Seconds of a processor after which a run has said nothing for too long.
PATIENCE = 20

#: Stands for the exit code of a run that was ended.
ENDED = 124

#: Seconds after which a run that goes on is ended: it said all the time where it stood.
LONGEST = 45

#: Bytes of memory that a worker may take.
MEMORY = 6 * 2**30

_PLACE = re.compile(r"^\S[^\n]*?:\d+:\d+: ", re.MULTILINE)

#: Beginnings of refusals that are about the command, the machine or a file, not about a scene.
_WITHOUT_PLACE = ("cannot ", "there are no constraint forces of ")

#: Words of commands that refuse also what they find, such as no equilibrium, which has no place.
_SEARCHES = {"analyze", "path", "fit", "--section", "virtual-work"}


# The runs.


class LateError(BaseException):
    """A run has said nothing for :data:`PATIENCE` seconds."""


class EndedError(BaseException):
    """A run has taken :data:`LONGEST` seconds."""


@dataclass(frozen=True)
class Outcome:
    """What one run did."""

    number: int
    command: str
    code: int
    seconds: float
    problem: str = ""
    text: str = ""


def _late(number: int, frame: FrameType | None) -> None:
    where = traceback.extract_stack(frame)
    inner = [f"{Path(f.filename).name}:{f.lineno}" for f in where if "lagrange_cli" in f.filename]
    raise LateError(" < ".join(reversed(inner[-6:])))


def run_mutant(one: Mutant, folder: Path) -> Outcome:
    """Run a mutant through the entry of the command line."""
    from lagrange_cli.cli.main import run
    from lagrange_cli.stages import Listener, heard_by

    scene = folder / "scene.yaml"
    text = one.text.encode("utf-8", errors="replace")
    scene.write_bytes(text)
    (folder / "data").write_text(one.measured, encoding="utf-8", errors="replace")
    words = [str(folder / word[1:]) if word.startswith("@") else word for word in one.words]
    said, errors = io.StringIO(), io.StringIO()
    before = _names_in(folder, Path.cwd())
    started = time.process_time()
    code, problem = -1, ""

    def hears(stage: str) -> None:
        if time.process_time() - started > LONGEST:
            raise EndedError
        signal.setitimer(signal.ITIMER_PROF, PATIENCE)

    signal.signal(signal.SIGPROF, _late)
    signal.setitimer(signal.ITIMER_PROF, PATIENCE)
    try:
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(errors),
            heard_by(Listener(hears=hears)),
        ):
            code = run([words[0], str(scene), *words[1:]])
    except LateError as late:
        problem = f"late: {late}"
    except EndedError:
        code = ENDED
    except SystemExit as end:
        code = int(end.code or 0)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
    seconds = time.process_time() - started
    problem = problem or judged(code, said.getvalue(), errors.getvalue())
    if problem.startswith("no place") and not _SEARCHES.isdisjoint(words):
        problem = ""
    named = {word[1:] for word in one.words if word.startswith("@")}
    others = _names_in(folder, Path.cwd()) - named - before
    if one.words[0] != "fmt" and scene.read_bytes() != text:
        others.add(scene.name)
    problem = problem or (f"foreign: {sorted(others)}" if others else "")
    return Outcome(one.number, " ".join(one.words), code, seconds, problem, one.text)


def _names_in(*folders: Path) -> set[str]:
    return {path.name for folder in folders for path in folder.iterdir()}


def judged(code: int, said: str, errors: str) -> str:
    """What is wrong with the end of a run, or ""."""
    if code == 3 or "internal error" in errors or "internal error" in said:
        lines = [line for line in (errors + said).splitlines() if line.strip()]
        return f"internal: {' / '.join(lines[:3])[:300]}"
    if code == 2 and not _PLACE.search(errors) and not errors.startswith(_WITHOUT_PLACE):
        return f"no place: {errors[:300]}"
    if _has_no_place(said):
        return f"no place: {said[:300]}"
    if code not in (0, 1, 2, ENDED):
        return f"exit {code}: {errors[:200]}"
    return ""


def _has_no_place(report: str) -> bool:
    """Whether a report of ``check`` calls a scene invalid without saying where."""
    _, invalid, reasons = report.partition("invalid  ")
    lines = reasons.splitlines()[1:2] if invalid else []
    return any(_PLACE.match(line.strip()) is None for line in lines)


@dataclass
class Tally:
    """What is counted over all runs."""

    codes: Counter[tuple[str, int]] = field(default_factory=Counter)
    seconds: float = 0.0
    longest: float = 0.0
    wrong: list[Outcome] = field(default_factory=list)

    def add(self, outcome: Outcome) -> None:
        self.codes[outcome.command.split()[0], outcome.code] += 1
        self.seconds += outcome.seconds
        self.longest = max(self.longest, outcome.seconds)
        if outcome.problem:
            self.wrong.append(outcome)

    def count(self, kind: str) -> int:
        return sum(outcome.problem.startswith(kind) for outcome in self.wrong)


_trees: list[Any] = []

#: The folder that a worker stands in, which is also its user's: nothing is to be written there.
_home: list[tempfile.TemporaryDirectory[str]] = []


def _prepare(memory: int | None, longest: float) -> None:
    """Make a worker ready: no cache, bounded memory and time, an empty folder to work in."""
    global LONGEST
    LONGEST = longest
    os.environ["LAGRANGE_CACHE"] = "off"
    _home.append(tempfile.TemporaryDirectory(prefix="lagrange-mutants-home-"))
    os.environ["HOME"] = _home[-1].name
    os.environ["MPLCONFIGDIR"] = tempfile.gettempdir()  # Matplotlib keeps its list of fonts.
    os.chdir(_home[-1].name)
    if memory is not None:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
    _trees[:] = sources()


def _numbered(job: tuple[int, int, bool]) -> Outcome:
    number, seed, of_grammar = job
    one = structured(number, seed) if of_grammar else mutant(number, seed, _trees)
    with tempfile.TemporaryDirectory(prefix="lagrange-mutants-") as folder:
        return run_mutant(one, Path(folder))


def outcomes(
    numbers: Sequence[int], seed: int, jobs: int, longest: float, of_grammar: bool = False
) -> Iterator[Outcome]:
    """The outcomes of mutants, or of scenes that a grammar makes, as they come."""
    work = [(number, seed, of_grammar) for number in numbers]
    if jobs == 0:
        _prepare(None, longest)
        yield from map(_numbered, work)
        return
    # Memory that SymPy's caches have taken is given back with the process.
    with multiprocessing.get_context("spawn").Pool(jobs, _prepare, (MEMORY, longest), 500) as pool:
        yield from pool.imap_unordered(_numbered, work, chunksize=8)


def table(tally: Tally) -> str:
    """The counts as Markdown."""
    commands = sorted({command for command, _ in tally.codes})
    total = sum(tally.codes.values())
    goes_on = sum(number for (_, code), number in tally.codes.items() if code == ENDED)
    lines = [
        "| command | mutants | exit 0 | exit 1 | exit 2 | exit 3 | other |",
        "|---|---:|---:|---:|---:|---:|---:|",
    ]
    for command in [*commands, "all"]:
        counts = Counter[int]()
        for (of, code), number in tally.codes.items():
            if command in (of, "all"):
                counts[code] += number
        ends = [counts[code] for code in range(4)]
        cells = [sum(counts.values()), *ends, sum(counts.values()) - sum(ends)]
        lines.append(f"| {command} | {' | '.join(f'{cell:,}' for cell in cells)} |")
    lines += [
        "",
        f"internal errors: {tally.count('internal')}; more than {PATIENCE} s without a word:"
        f" {tally.count('late')}; refusals of a scene without a place: {tally.count('no place')};"
        f" other files written: {tally.count('foreign')};"
        f" other ends: {tally.count('exit')}; ended while they said where they stood: {goes_on}",
        f"{total / max(tally.seconds, 1e-9):.1f} mutants a second of a core,"
        f" the longest {tally.longest:.1f} s",
    ]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--mutants", type=int, default=30_000)
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--longest", type=float, default=LONGEST, help="seconds of a run")
    parser.add_argument("-j", "--jobs", type=int, default=2)
    parser.add_argument("--structured", action="store_true", help="scenes that a grammar makes")
    parser.add_argument("--show", type=int, help="print one mutant and stop")
    parser.add_argument("--failures", type=Path, help="write what is wrong, as lines of JSON")
    given = parser.parse_args()
    if given.show is not None:
        shown = given.show, given.seed
        one = structured(*shown) if given.structured else mutant(*shown, sources())
        print(f"# lagrange {' '.join(one.words)}\n{one.text}\n{one.measured}")
        return 0
    tally, started = Tally(), time.perf_counter()
    numbers = range(given.first, given.first + given.mutants)
    work = outcomes(numbers, given.seed, given.jobs, given.longest, given.structured)
    for done, outcome in enumerate(work, 1):
        tally.add(outcome)
        if outcome.problem:
            print(f"{outcome.number}: {outcome.command}: {outcome.problem}", file=sys.stderr)
            if given.failures is not None:
                with given.failures.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(asdict(outcome)) + "\n")
        if done % 500 == 0:
            rate = done / (time.perf_counter() - started)
            print(f"{done} of {given.mutants}, {rate:.1f} a second", file=sys.stderr)
    print(table(tally))
    return int(bool(tally.wrong))


if __name__ == "__main__":
    sys.exit(main())
