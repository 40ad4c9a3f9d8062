"""Outputs of two versions of lagrange, compared byte for byte over every shipped scene.

    python benchmarks/same_output.py COMMIT
    python benchmarks/same_output.py COMMIT --scenes 'pendulums/*' --no-simulate
    python benchmarks/same_output.py COMMIT OTHER --keep differences

COMMIT is what the working tree (or OTHER) is compared with: anything that git names, or a
folder with a checkout. Both read the scenes of the working tree. Each scene is derived in all
formats and forms, emitted in all formats with all options, and simulated; the exit code, the
streams and the files of every command are compared. Of the reports of simulations the seconds
are left out. Differences are shown as excerpts, ``--keep`` writes both sides of each to a
folder, and the command exits with 1 where there are any.

The cache is off: nothing of one side can answer for the other.
"""

from __future__ import annotations

import argparse
import difflib
import itertools
import json
import os
import subprocess
import sys
import tarfile
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
WORKER = Path(__file__).resolve().with_name("same_output_worker.py")
RESULTS = "results.json"

#: Lines of a difference that are shown, and characters of each.
EXCERPT, WIDTH = 12, 160

#: Every choice of `derive` but those of the arithmetic of the certificate.
DERIVE_FORMATS = ("text", "latex", "markdown", "typst", "html", "json")
FORMS = ("lagrange", "explicit", "first-order", "hamiltonian", "routhian", "small-oscillations")
DERIVE_FORMS = (*FORMS, "multiplier")

#: Every choice of `emit`, by format; `minimal` is for the most part what `auto` chooses, and is
#: tried once for each format.
EMIT_OPTIONS: dict[str, dict[str, tuple[str | None, ...]]] = {
    "latex": {
        "--style": ("document", "snippet"),
        "--form": FORMS,
        "--by": (None, "lagrange"),
    },
    "markdown": {
        "--form": FORMS,
        "--steps": (None, ""),
        "--by": (None, "dalembert"),
    },
    "typst": {
        "--form": FORMS,
        "--by": (None, "lagrange", "dalembert"),
    },
    "html": {
        "--form": FORMS,
        "--by": (None, "lagrange"),
    },
    "c": {
        "--real": ("float", "double", "long-double"),
        "--main": (None, ""),
        "--with": (None, "canonical", "jacobian,linearization"),
    },
    "python": {
        "--with": (None, "canonical", "jacobian,linearization"),
        "--style": ("numpy", "jax", "casadi"),
    },
    "fmu": {
        "--fmi": ("2", "3"),
    },
    "tikz": {},
    "svg": {},
}

_PARTS = ("--sections", "system,constraints,energies,result,forces,initial")

#: Further options by format, of ``derive`` and ``emit``; each line is tried once.
ONCE: dict[str, tuple[tuple[str, ...], ...]] = {
    "text": (("--written-out",), ("--language", "de"), (*_PARTS, "--language", "fr")),
    "latex": (
        ("--written-out",),
        ("--style", "beamer", "--numbers", "on", "--language", "en", "--macros"),
        ("--style", "document", "--width", "column", "--numbers", "off", "--language", "fr"),
        ("--style", "snippet", "--width", "8.6cm", *_PARTS, "--language", "de"),
    ),
    "markdown": (("--written-out",), ("--language", "de"), _PARTS),
    "typst": (("--written-out",), ("--language", "fr"), _PARTS),
    "html": (("--written-out",), ("--language", "de"), _PARTS),
    "json": (("--with", "latex"),),
    "c": (("--header-only", "--with", "step,midpoint"),),
}

FORMULATIONS = ("auto", "multiplier")


@dataclass(frozen=True)
class Difference:
    """One output of one command that is not the same on both sides.

    Attributes
    ----------
    kind
        The row of the table that counts it.
    command
        The words after ``lagrange``.
    output
        ``exit code``, a stream, or the name of a file.
    before, after
        The texts; None where a side has no such output.
    """

    kind: str
    command: str
    output: str
    before: str | None
    after: str | None

    def excerpt(self) -> str:
        """The first lines of a unified difference."""
        lines = [(text or "").splitlines() for text in (self.before, self.after)]
        unified = list(difflib.unified_diff(*lines, "before", "after", lineterm="", n=1))[2:]
        shown = [line[:WIDTH] for line in unified[:EXCERPT]]
        more = len(unified) - len(shown)
        return "\n".join(["    " + line for line in (*shown, *[f"... {more} more"] * (more > 0))])


@dataclass
class Tally:
    """Commands that were compared, and what differed."""

    commands: Counter[str] = field(default_factory=Counter)
    differing: Counter[str] = field(default_factory=Counter)
    refused: Counter[str] = field(default_factory=Counter)
    differences: list[Difference] = field(default_factory=list)


def _flag(name: str, value: str | None) -> list[str]:
    """An option as words: a choice, a switch (""), or nothing (None)."""
    return [] if value is None else [name, value] if value else [name]


def derivations(scene: str) -> Iterator[list[str]]:
    for forces, form, format_ in itertools.product((None, ""), DERIVE_FORMS, DERIVE_FORMATS):
        words = ["derive", scene, "--format", format_, "--form", form, *_flag("--forces", forces)]
        yield words
        if format_ == "text":
            yield [*words, "--ascii"]
        if form == "lagrange":
            yield [*words, "--steps"]
            yield from ([*words, "--by", way] for way in ("lagrange", "dalembert"))
            yield from ([*words, *options] for options in ONCE.get(format_, ()))
    yield ["derive", scene, "--form", "routhian", "--plot", "out/potential.tex"]
    yield ["derive", scene, "--form", "hamiltonian", "--bracket", "H, H"]


def emissions(scene: str) -> Iterator[list[str]]:
    for to, options in EMIT_OPTIONS.items():
        base = ["emit", scene, "--to", to, "-o", "out"]
        for formulation, *values in itertools.product(FORMULATIONS, *options.values()):
            chosen = zip(options, values, strict=True)
            flags = [word for name, value in chosen for word in _flag(name, value)]
            yield [*base, "--formulation", formulation, *flags]
        yield [*base, "--formulation", "minimal"]
        yield from ([*base, *options] for options in ONCE.get(to, ()))


def commands(scene: str, *, simulate: bool, until: str | None) -> list[list[str]]:
    """Everything that is asked about a scene, as words after ``lagrange``."""
    simulation = ["simulate", scene, "--json", "--with", "energy", "-o", "out/run.csv"]
    simulations = [[*simulation, *_flag("--until", until)]] if simulate else []
    return [*derivations(scene), *emissions(scene), *simulations]


def kind_of(words: Sequence[str]) -> str:
    """The row of the table of a command."""
    subcommand = words[0]
    for option in ("--format", "--to"):
        if option in words:
            return f"{subcommand} {words[words.index(option) + 1]}"
    return subcommand


def without_seconds(report: Any) -> Any:
    """A JSON value without what a clock measured."""
    if isinstance(report, dict):
        return {key: without_seconds(v) for key, v in report.items() if key != "seconds"}
    return [without_seconds(v) for v in report] if isinstance(report, list) else report


def comparable(words: Sequence[str], outputs: dict[str, str]) -> dict[str, str]:
    """The outputs of a command without those that differ from one run to the next."""
    if words[0] != "simulate" or not outputs["standard output"].startswith("{"):
        return outputs
    report = without_seconds(json.loads(outputs["standard output"]))
    text = json.dumps(report, indent=2, ensure_ascii=False) + "\n"
    return {**outputs, "standard output": text}


class Side:
    """A long-lived process that runs the commands of one checkout.

    It is started again where it ended while it was at work.
    """

    def __init__(self, checkout: Path, work: Path) -> None:
        self.checkout, self.work = checkout, work
        self.process: subprocess.Popen[str] | None = None

    def _started(self) -> subprocess.Popen[str]:
        if self.process is not None and self.process.poll() is None:
            return self.process
        environment = os.environ | {
            "LAGRANGE_CACHE": "off",
            "PYTHONPATH": str(self.checkout),
            "PYTHONHASHSEED": "0",
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        self.process = subprocess.Popen(
            [sys.executable, str(WORKER), str(self.checkout)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=environment,
            cwd=self.work,
        )
        return self.process

    def run(self, name: str, words: Sequence[Sequence[str]]) -> list[dict[str, str]]:
        """Return what came of each command, run in a folder of this name."""
        folder = self.work / name
        folder.mkdir(parents=True)
        (folder / "systems").symlink_to(ROOT / "systems")
        process = self._started()
        assert process.stdin is not None
        assert process.stdout is not None
        print(
            json.dumps({"folder": str(folder), "commands": words}), file=process.stdin, flush=True
        )
        answer = process.stdout.readline().strip()
        if answer != "0":
            # Worded by side: it is a difference even where both end.
            return [{"process": f"{self.work.name}: ended with {answer or 'no answer'}"}]
        results: list[dict[str, str]] = json.loads((folder / RESULTS).read_text("utf-8"))
        return results

    def close(self) -> None:
        if self.process is not None and self.process.stdin is not None:
            self.process.stdin.close()
            self.process.wait()


def compared(
    words: Sequence[str], before: dict[str, str], after: dict[str, str]
) -> Iterator[Difference]:
    """Every output of a command that differs."""
    first, second = comparable(words, before), comparable(words, after)
    for output in dict.fromkeys([*first, *second]):
        texts = first.get(output), second.get(output)
        if texts[0] != texts[1]:
            yield Difference(kind_of(words), " ".join(words), output, *texts)


class Comparison:
    """Two checkouts, scene by scene, with a pair of processes for each thread."""

    def __init__(self, before: Path, after: Path, work: Path) -> None:
        self.checkouts = {"before": before, "after": after}
        self.work = work
        self.tally = Tally()
        self.sides: list[Side] = []
        self._lock = threading.Lock()
        self._own = threading.local()

    def _pair(self) -> list[Side]:
        if not hasattr(self._own, "pair"):
            self._own.pair = [Side(path, self.work / n) for n, path in self.checkouts.items()]
            for name in self.checkouts:
                (self.work / name).mkdir(exist_ok=True)
            with self._lock:
                self.sides += self._own.pair
        pair: list[Side] = self._own.pair
        return pair

    def scene(self, scene: str, words: Sequence[Sequence[str]]) -> None:
        """Run the commands of a scene on both sides and count what differs."""
        name = scene.replace("/", "+")
        before, after = (side.run(name, words) for side in self._pair())
        if len(before) != len(after) or len(before) != len(words):
            words = [["process", scene]]
            before, after = before[:1], after[:1]
        with self._lock:
            for command, *results in zip(words, before, after, strict=True):
                differences = list(compared(command, *results))
                kind = kind_of(command)
                self.tally.commands[kind] += 1
                self.tally.differing[kind] += bool(differences)
                self.tally.refused[kind] += results[0].get("exit code") == "2"
                self.tally.differences += differences

    def close(self) -> None:
        for side in self.sides:
            side.close()


def checkout(what: str, work: Path) -> Path:
    """A folder with a checkout: the one that is named, or a commit's files unpacked.

    Raises
    ------
    SystemExit
        There is neither such a folder nor such a commit.
    """
    if (Path(what) / "lagrange_cli").is_dir():
        return Path(what).resolve()
    git = ["git", "-C", str(ROOT), "archive", "--format=tar", what, "lagrange_cli"]
    done = subprocess.run(git, capture_output=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"'{what}' is no folder and no commit: {done.stderr.decode().strip()}")
    work.mkdir()
    with tarfile.open(fileobj=BytesIO(done.stdout)) as archive:
        archive.extractall(work, filter="data")
    return work


def scenes(pattern: str) -> list[str]:
    """Shipped scenes whose path below ``systems`` matches, by paths from the root."""
    paths = sorted((ROOT / "systems").rglob("*.yaml"))
    systems = ROOT / "systems"
    matching = [p for p in paths if p.relative_to(systems).match(pattern)]
    return [str(path.relative_to(ROOT)) for path in matching]


def table(tally: Tally) -> str:
    """Counts of each kind of command."""
    rows = [
        f"| {kind} | {count} | {tally.refused[kind]} | {tally.differing[kind]} |"
        for kind, count in sorted(tally.commands.items())
    ]
    total = sum(tally.commands.values()), tally.refused.total(), tally.differing.total()
    head = ["| command | compared | of these refused | differ |", "|---|---|---|---|"]
    return "\n".join([*head, *rows, "| all | {} | {} | {} |".format(*total)])


def keep(differences: Sequence[Difference], folder: Path) -> None:
    """Write both sides of every difference, and which command each is of."""
    folder.mkdir(parents=True, exist_ok=True)
    index = []
    for number, difference in enumerate(differences):
        name = f"{number:04} {difference.output.replace('/', '+')}"
        index.append(f"{name}: lagrange {difference.command}")
        for side, text in (("before", difference.before), ("after", difference.after)):
            if text is not None:
                (folder / f"{name}.{side}").write_text(text, encoding="utf-8")
    (folder / "index.txt").write_text("\n".join([*index, ""]), encoding="utf-8")


def show(tally: Tally, most: int) -> None:
    """Print the table and excerpts of the first differences."""
    for difference in tally.differences[:most]:
        print(f"lagrange {difference.command}: {difference.output}")
        print(difference.excerpt() + "\n")
    if len(tally.differences) > most:
        print(f"... and {len(tally.differences) - most} more differences\n")
    print(table(tally))


def arguments(words: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("commit", help="a commit, or a folder with a checkout")
    parser.add_argument("other", nargs="?", default=str(ROOT), help="likewise; the working tree")
    parser.add_argument("--scenes", metavar="GLOB", default="*", help="paths below systems/")
    parser.add_argument("-j", "--jobs", type=int, default=os.cpu_count(), help="scenes at a time")
    parser.add_argument("--no-simulate", action="store_true", help="derive and emit alone")
    parser.add_argument("--until", metavar="T", help="end of every simulation")
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="write what differs there")
    parser.add_argument("--most", type=int, default=20, help="excerpts that are shown")
    return parser.parse_args(words)


def main(words: Sequence[str] | None = None) -> int:
    """Compare, report, and return the exit code."""
    asked = arguments(words)
    chosen = scenes(asked.scenes)
    if not chosen:
        raise SystemExit(f"no scene matches '{asked.scenes}'")
    started = time.monotonic()
    with tempfile.TemporaryDirectory() as temporary:
        work = Path(temporary).resolve()
        before, after = (
            checkout(what, work / f"checkout{n}")
            for n, what in enumerate((asked.commit, asked.other))
        )
        comparison = Comparison(before, after, work)

        def one(scene: str) -> None:
            comparison.scene(
                scene, commands(scene, simulate=not asked.no_simulate, until=asked.until)
            )
            print(f"{time.monotonic() - started:6.0f} s  {scene}", file=sys.stderr)

        with ThreadPoolExecutor(asked.jobs) as pool:
            list(pool.map(one, chosen))
        comparison.close()
    show(comparison.tally, asked.most)
    if asked.keep is not None:
        keep(comparison.tally.differences, asked.keep)
    return 1 if comparison.tally.differences else 0


if __name__ == "__main__":
    sys.exit(main())
