"""Expected equations of the shipped scenes with one sign flipped: none may pass a check.

Every + and - of an equation is replaced by the other in turn, in the text of the scene; the
equations are then compared with the derived ones as ``lagrange check`` does. A flip that leaves an
equation what it was up to a factor, as that of the only term, is told apart by SymPy's expansion.

    python benchmarks/sign_flips.py --docs docs/quality/sign-flips.md
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml
from sympy import Expr, expand

from lagrange_cli.check.expectations import CHECKS
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.scene import read_text
from lagrange_cli.scene.model import Scene

ROOT = Path(__file__).parents[1]

SCENES = sorted((ROOT / "systems").rglob("*.yaml"))

#: A sign between terms or before one, not that of an exponent of ten.
SIGN = re.compile(r"(?<![0-9.][eE])[+-]")

OTHER = {"+": "-", "-": "+"}

PAGE = """\
# Flipped signs

Every sign of every expected equation of the shipped scenes, replaced by the other one in turn. An
equation is *the same* where the flip changes nothing but its factor.

    {command}

| scenes | equations | flips | refused | the same | passed |
|---|---|---|---|---|---|
{row}
"""


@dataclass
class Counts:
    """What became of the flips."""

    scenes: int = 0
    equations: int = 0
    refused: int = 0
    same: int = 0
    passed: int = 0

    def __str__(self) -> str:
        flips = self.refused + self.same + self.passed
        cells = (self.scenes, self.equations, flips, self.refused, self.same, self.passed)
        return " | ".join(f"{cell:,}" for cell in cells)


def flipped(text: str) -> Iterator[str]:
    """The text of a scene with each sign of each expected equation flipped in turn."""
    root = yaml.compose(text, yaml.SafeLoader)
    for key in ("expect", "equations"):
        values = {name.value: value for name, value in root.value}
        if key not in values:
            return
        root = values[key]
    for entry in root.value:
        node = entry[1] if isinstance(entry, tuple) else entry
        if node.style in ("|", ">"):
            start = text.index("\n", node.start_mark.index)
        else:
            start = node.start_mark.index
        for sign in SIGN.finditer(text, start, node.end_mark.index):
            yield text[: sign.start()] + OTHER[sign[0]] + text[sign.end() :]


def residuals(equations: Equations, scene: Scene) -> list[Expr]:
    """Left sides less right sides of the expected equations."""
    wanted = scene.expect.equations or ()
    return [interpret(equations, e.left) - interpret(equations, e.right) for e in wanted]


def is_same(first: Expr, second: Expr) -> bool:
    """Say whether one is a multiple of the other by 1 or -1, by SymPy's own expansion."""
    return any(expand(first - sign * second) == 0 for sign in (1, -1))


def count(path: Path, counts: Counts) -> None:
    """Flip the signs of one scene, and count what becomes of them."""
    text, file = path.read_text(encoding="utf-8"), str(path)
    texts = list(flipped(text))
    if not texts:
        return
    scene = read_text(text, file)
    equations = derive(scene)
    before = residuals(equations, scene)
    counts.scenes += 1
    counts.equations += len(before)
    for changed in texts:
        try:
            other = read_text(changed, file)
        except InputError:
            counts.refused += 1  # as a sign in an index or an exponent
            continue
        after = residuals(equations, other)
        if all(map(is_same, before, after)):
            counts.same += 1
        elif list(CHECKS["equations"](other.expect, equations)):
            counts.refused += 1
        else:
            counts.passed += 1
            pairs = zip(after, before, strict=True)
            print(f"{path.name}: passed", *(a for a, b in pairs if a != b), sep="\n  ")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", default="", help="scenes whose path holds this text")
    parser.add_argument("--docs", type=Path, help="write the table to this page")
    arguments = parser.parse_args()
    counts = Counts()
    for path in SCENES:
        if arguments.only in str(path):
            count(path, counts)
    row = f"| {counts} |"
    print(row)
    if arguments.docs is not None:
        only = f"--only {arguments.only} " if arguments.only else ""
        command = f"python benchmarks/sign_flips.py {only}--docs {arguments.docs}"
        arguments.docs.write_text(PAGE.format(command=command, row=row), encoding="utf-8")
    return 1 if counts.passed else 0


if __name__ == "__main__":
    sys.exit(main())
