"""Every language of emitted code on every shipped scene: what it holds, and how exactly.

Functions are called at the start and at random states, and compared with 40-digit values of the
symbolic equations. An error is relative to the size of rounding: the sum of the magnitudes that a
result is made of.

    python benchmarks/languages.py --docs docs/quality/languages.md
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from lagrange_cli.errors import InputError  # noqa: E402
from lagrange_cli.mechanics.equations import Equations  # noqa: E402
from tests.emit.languages.c_and_python import C, Python  # noqa: E402
from tests.emit.languages.cases import CASES, built  # noqa: E402
from tests.emit.languages.drivers import Driver  # noqa: E402
from tests.emit.languages.reference import calls  # noqa: E402
from tests.emit.languages.test_languages import DRIVERS  # noqa: E402
from tests.systems.shipped import APART, SCENES, derived  # noqa: E402

#: Cases built by hand that the page lists beside the scenes → their kind.
LARGE = {
    "band": "large: bands",
    "tree": "large: supernodes",
    "springs": "large: loops without closures",
    "masses": "coupled mass matrix",
    "indefinite": "mass matrix not proven definite",
}

HEAD = """\
# Languages

Emitted code of every shipped scene, compiled or interpreted, called at its start and at three
random states near it: right-hand side, mass matrix, forcing, energy, positions and velocities, and
inputs, outputs, multipliers and constraints where there are any. This page is the output of

    python benchmarks/languages.py --docs docs/quality/languages.md

A number is the largest error of any result, relative to the sum of the magnitudes that the result
is made of, as they come out of the symbolic equations in 40 digits: 1e-16 is half a unit in the
last place. With contacts, free flight is compared; tests compare every mode, events and what is
behind them with the interpreter, to 1e-12 (1e-10 where LAPACK solves ill-conditioned systems).
"""


def kind(equations: Equations) -> str:
    """Return the kind of a scene, as far as emitted code differs."""
    system = equations.system
    if system.contacts:
        return "one-sided constraints"
    if system.switches:
        return "states with two values"
    if any(u.recording is not None for u in system.inputs):
        return "inputs from a file"
    if system.inputs:
        return "inputs"
    if any(closure.kind == "velocity" for closure in system.closures):
        return "velocity constraints"
    return "closures between positions" if system.closures else "few coordinates"


def judged(driver: Driver, equations: Sequence[Equations], folder: Path) -> tuple[str, float]:
    """Return the largest error, or the reason for which a language refuses the scenes."""
    modules, expected, reasons = [], [], []
    for each in equations:
        try:
            modules.append(driver.emitted(each, folder / each.presentation.name))
        except InputError as refusal:
            reasons.append(refusal.problems[0].message.partition(": ")[2])
        else:
            expected.append(calls(each))
    if reasons:
        assert not modules
        return f"refused: {reasons[0]}", 0.0
    worst = 0.0
    found = driver.results(folder, modules, expected)
    for rows, results in zip(expected, found, strict=True):
        for call, numbers in zip(rows, results, strict=True):
            worst = max([worst, *(call.errors(numbers) if numbers is not None else [])])
    return f"{worst:.0e}", worst


def table(kinds: Mapping[str, Sequence[Equations]], drivers: Mapping[str, Driver]) -> list[str]:
    """Return the lines of the table: kinds by languages."""
    lines = [
        f"| kind of scene | scenes | {' | '.join(drivers)} |",
        "|---" * (len(drivers) + 2) + "|",
    ]
    notes: dict[str, int] = {}
    for name, equations in kinds.items():
        cells = []
        for language, driver in drivers.items():
            with tempfile.TemporaryDirectory() as folder:
                text, _ = judged(driver, equations, Path(folder))
            if text.startswith("refused"):
                text = f"[{notes.setdefault(text, len(notes) + 1)}]"
            cells.append(text)
            print(name, language, text, flush=True)
        lines.append(f"| {name} | {len(equations)} | {' | '.join(cells)} |")
    return [*lines, "", *(f"[{number}] {text}  " for text, number in notes.items())]


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--docs", type=Path, help="the page to write")
    parser.add_argument("names", nargs="*", help="shipped scenes; all if none is named")
    chosen = parser.parse_args(arguments)
    names = chosen.names or [*SCENES, *APART]
    kinds: dict[str, Any] = {}
    for name in names:
        kinds.setdefault(kind(derived(name)), []).append(derived(name))
    if not chosen.names:
        for name in CASES.keys() & LARGE.keys():
            kinds.setdefault(LARGE[name], []).append(built(name))
    everything = {driver.language: driver for driver in (C(), Python(), *DRIVERS.values())}
    here = {n: d for n, d in everything.items() if all(map(shutil.which, d.programs))}
    with tempfile.TemporaryDirectory() as cache:
        os.environ.setdefault("XDG_CACHE_HOME", cache)
        lines = table(dict(sorted(kinds.items())), here)
    page = "\n".join([HEAD, *lines]).rstrip() + "\n"
    if chosen.docs:
        chosen.docs.write_text(page, encoding="utf-8")
    else:
        print(page)
    return 0


if __name__ == "__main__":
    sys.exit(main())
