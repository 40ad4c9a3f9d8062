"""Whether anything is lost or half-written where a command is killed, or its disk is full.

Commands that write run in a folder that holds what an earlier run wrote, and are ended at a random
time, half of them just after a temporary file of theirs has appeared: by SIGKILL, SIGTERM, SIGINT
or SIGHUP, to the process or to all of its group. Others find a disk that gets full or is
read-only. Then each output has to be that of before or the new one, whole; and the same command
once more (with ``--resume`` where it says so) has to give the bytes of an undisturbed run and
to leave nothing else.

    python benchmarks/soundness_kills.py --kills 200 --seed 1
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from killed_commands import LONGEST, PUSH, SCENARIOS, SCENE, Place, Scenario

SIGNALS = {name: getattr(signal, name) for name in ("SIGKILL", "SIGTERM", "SIGINT", "SIGHUP")}
DISKS = ("full disk", "read-only disk")

#: How often each end comes, and the exit codes that it may have beside those of a whole run.
WEIGHTS = {
    "SIGKILL": 8,
    "SIGTERM": 4,
    "SIGINT": 3,
    "SIGHUP": 3,
    "full disk": 3,
    "read-only disk": 1,
}
CODES = {
    "SIGKILL": {-9},
    "SIGTERM": {143, -15},
    "SIGINT": {130, -2},
    "SIGHUP": {129, -1},
    "full disk": {2},
    "read-only disk": {2},
}


@dataclass
class Verdict:
    """What became of a command that was ended: the state of its outputs, and what is wrong."""

    end: str
    scenario: str
    code: int
    state: str = "old"
    wrong: list[tuple[str, str]] = field(default_factory=list)


def old_text(name: str) -> bytes:
    return f"what stood in {name} before\n".encode()


def prepared(root: Path, number: int, scenario: Scenario, *, own_disk: bool = False) -> Place:
    """A folder with the old content of the outputs."""
    place = Place(root, number, own_disk=own_disk)
    for name, text in scenario.texts.items():
        (place.folder / name).write_text(text)
    if scenario.before is not None:
        code, said = place.run(scenario.before)
        assert code == 0, said
    for name in scenario.outputs:
        path = place.folder / name
        if not path.exists():
            path.write_bytes(old_text(name))
    return place


def without_times(name: str, data: bytes) -> bytes:
    """A file without the seconds that a run took, which are in reports."""
    if name.endswith((".json", ".xml")):
        return re.sub(rb'("seconds": |time=")[0-9.]+', rb"\1", data)
    return data


def is_part(name: str, data: bytes) -> bool:
    """Whether a file is what ``simulate`` keeps of a motion that it was asked to end."""
    if name.endswith(".csv"):
        header, *rows = data.decode().split("\n")
        return rows[-1] == "" and all(r.count(",") == header.count(",") for r in rows[:-1])
    if name.endswith(".npz"):
        with np.load(io.BytesIO(data), allow_pickle=False) as arrays:
            return len({len(arrays[key]) for key in arrays.files}) == 1
    if name.endswith(".svg"):
        return ElementTree.fromstring(data).tag.endswith("svg")
    return False


@dataclass(frozen=True)
class Reference:
    """What an undisturbed run writes, and how long it takes in seconds."""

    contents: dict[str, bytes]
    before: dict[str, bytes]
    seconds: float
    leaves: frozenset[str]


def reference(root: Path, number: int, scenario: Scenario) -> Reference:
    place = prepared(root, number, scenario)
    before = place.contents(scenario.outputs)
    place.run(scenario.words)
    started = time.perf_counter()
    code, said = place.run(scenario.words)
    seconds = time.perf_counter() - started
    assert code == 0, said
    found = {
        name: without_times(name, data) for name, data in place.contents(scenario.outputs).items()
    }
    leaves = frozenset(os.listdir(place.folder))
    place.remove()
    return Reference(found, before, seconds, leaves)


def end_by_signal(
    place: Place, scenario: Scenario, expected: Reference, end: str, draw: random.Random
) -> int:
    """Run a command and send it a signal at a random time; its exit code."""
    with place.start(scenario.words, quiet=True) as process:
        if draw.random() < 0.5:
            wait_for_a_file(place, process)
            time.sleep(draw.random() ** 3 * 0.02)
        else:
            time.sleep(draw.uniform(0.0, 1.05) * expected.seconds)
        to_all = draw.random() < 0.5
        if process.poll() is None:
            send = os.killpg if to_all else os.kill
            send(process.pid, SIGNALS[end])
        try:
            process.wait(timeout=LONGEST)
        except subprocess.TimeoutExpired:
            print(f"hangs after {end}: {scenario.words}", file=sys.stderr)
        # Processes of a pool whose parent was killed.
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
    return process.returncode


def wait_for_a_file(place: Place, process: subprocess.Popen[bytes]) -> None:
    """Wait for something new in the folder or the one of temporary files."""
    folders = [place.folder, place.temporary, place.cache / "lagrange"]
    before = [set(os.listdir(path)) if path.exists() else set() for path in folders]
    while process.poll() is None:
        for path, names in zip(folders, before, strict=True):
            if path.exists() and set(os.listdir(path)) - names:
                return
        time.sleep(0.0005)


def end_by_disk(
    place: Place, scenario: Scenario, expected: Reference, end: str, draw: random.Random
) -> int:
    """Run a command on a disk that has no room for its results, or is read-only."""
    largest = max(len(data) for data in expected.contents.values())
    if end == "full disk":
        place.limit(draw.randrange(0, largest))
    else:
        place.protect()
    code, _ = place.run(scenario.words)
    place.mend()
    return code


def judge_outputs(verdict: Verdict, place: Place, scenario: Scenario, expected: Reference) -> None:
    """Each output is old, new, or for a motion that was asked to end what is kept of it."""
    states = []
    for name, data in place.contents(scenario.outputs).items():
        if not data:
            verdict.wrong.append(("lost", name))
        elif without_times(name, data) == expected.contents[name]:
            states.append("new")
        elif data == expected.before[name]:
            states.append("old")
        elif verdict.end not in ("SIGKILL", *DISKS) and holds(is_part, name, data):
            states.append("part")
        else:
            verdict.wrong.append(("half-written", name))
    if scenario.together and len(set(states)) > 1:
        verdict.wrong.append(("half-written", "files that belong together"))
    verdict.state = "+".join(sorted(set(states)))


def holds(question: Callable[[str, bytes], bool], name: str, data: bytes) -> bool:
    try:
        return question(name, data)
    except Exception:
        return False


def judge_next(verdict: Verdict, place: Place, scenario: Scenario, expected: Reference) -> None:
    """The next run gives the bytes of an undisturbed one, and leaves nothing else."""
    words = list(scenario.words)
    if scenario.state is not None and (place.folder / scenario.state).exists():
        if scenario.state == "c":
            words[words.index("--checkpoint")] = "--resume"
        else:
            words.append("--resume")
    code, said = place.run(words)
    if code != 0:
        verdict.wrong.append(("next run", f"exit code {code}: {said[-300:]}"))
    for name, data in place.contents(scenario.outputs).items():
        if without_times(name, data) != expected.contents[name]:
            verdict.wrong.append(("next run", f"{name} differs"))
    if (place.folder / "scene.yaml").read_text() != SCENE or (
        place.folder / "push.csv"
    ).read_text() != PUSH:
        verdict.wrong.append(("lost", "an input"))
    left = set(os.listdir(place.folder)) - expected.leaves
    left |= {name for name in os.listdir(place.temporary) if name.startswith("lagrange-")}
    left |= {path.name for path in place.cache.rglob(".lagrange-*")}
    if left:
        verdict.wrong.append(("left", ", ".join(sorted(left))))


def campaign(
    kills: int, seed: int, names: Sequence[str] = tuple(SCENARIOS), jobs: int = 1
) -> Iterator[Verdict]:
    """Commands that were ended, ``jobs`` at a time; each draws from its own number and the seed."""
    with (
        tempfile.TemporaryDirectory(prefix="kills-") as folder,
        ThreadPoolExecutor(jobs) as threads,
    ):
        root = Path(folder)
        known = {name: reference(root, k, SCENARIOS[name]) for k, name in enumerate(names)}
        ends = [end for end in WEIGHTS if end not in DISKS or can_mount(root)]

        def kill(number: int) -> Verdict:
            draw = random.Random(f"{seed} {number}")
            name = names[number % len(names)]
            (end,) = draw.choices(ends, [WEIGHTS[end] for end in ends])
            # A cache for each thread: what is left in it is of one command.
            own = root / threading.current_thread().name
            if draw.random() < 0.3:
                shutil.rmtree(own / "cache", ignore_errors=True)
            return one(own, number, name, end, known[name], draw)

        yield from threads.map(kill, range(kills))


def one(
    root: Path, number: int, name: str, end: str, expected: Reference, draw: random.Random
) -> Verdict:
    """A command that is ended, and what is wrong afterwards."""
    scenario = SCENARIOS[name]
    place = prepared(root, number, scenario, own_disk=end in DISKS)
    try:
        disturb = end_by_disk if end in DISKS else end_by_signal
        verdict = Verdict(end, name, disturb(place, scenario, expected, end, draw))
        if verdict.code not in {0} | CODES[end]:
            verdict.wrong.append(("exit code", str(verdict.code)))
        judge_outputs(verdict, place, scenario, expected)
        judge_next(verdict, place, scenario, expected)
    finally:
        place.remove()
    return verdict


def can_mount(root: Path) -> bool:
    """Whether a disk of its own can be had here (for root alone)."""
    place = Place(root, 10**9, own_disk=True)
    mounted = place.mounted
    place.remove()
    return mounted


KINDS = ("lost", "half-written", "left", "next run", "exit code")


def table(verdicts: Sequence[Verdict]) -> str:
    """The counts by what ended the commands."""
    heads = ("end", "runs", "ended before their end", "old", "new", "part kept, or some new")
    lines = [f"| {' | '.join((*heads, *KINDS))} |", "|---" * (len(heads) + len(KINDS)) + "|"]
    for end in (*WEIGHTS, "all"):
        some = [v for v in verdicts if end in (v.end, "all")]
        if not some:
            lines.append(f"| {end} | 0: not possible here |" + " |" * (4 + len(KINDS)))
            continue
        states = Counter(v.state for v in some)
        wrong = Counter(kind for v in some for kind in {kind for kind, _ in v.wrong})
        part = sum(n for state, n in states.items() if "part" in state)
        row = [
            len(some),
            sum(v.code != 0 for v in some),
            states["old"],
            states["new"],
            part + states["new+old"],
            *(wrong[kind] for kind in KINDS),
        ]
        lines.append(f"| {end} | {' | '.join(map(str, row))} |")
    return "\n".join(lines)


def main() -> int:
    """Run the campaign and print its table; 1 where anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=1, help="so many at a time")
    parser.add_argument("--json", type=Path, help="write every verdict to this file")
    options = parser.parse_args()
    verdicts = []
    for verdict in campaign(options.kills, options.seed, jobs=options.jobs):
        verdicts.append(verdict)
        for kind, what in verdict.wrong:
            print(f"{verdict.scenario}, {verdict.end}: {kind}: {what}", file=sys.stderr)
        if len(verdicts) % 20 == 0:
            print(f"{len(verdicts)} of {options.kills}", file=sys.stderr)
    print(table(verdicts))
    if options.json is not None:
        options.json.write_text(json.dumps([vars(v) for v in verdicts], indent=2))
    return int(any(v.wrong for v in verdicts))


if __name__ == "__main__":
    sys.exit(main())
