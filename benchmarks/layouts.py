"""Scenes written in layouts drawn at random, and what ``lagrange fmt`` makes of them.

A shipped scene is written anew: sections in any order, blocks or brackets, other indentation,
quotes and spaces, comments between lines and at their ends, blank lines. What is laid out must mean
the same to PyYAML's own loader of texts, hold each comment once, and be laid out as it is.

    python benchmarks/layouts.py --scenes 2000 --seed 1 --docs docs/quality/layouts.md
"""

from __future__ import annotations

import argparse
import json
import random
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from lagrange_cli.api import laid_out

ROOT = Path(__file__).parents[1]

SCENES = sorted((ROOT / "systems").rglob("*.yaml"))

#: The page that the table is written to.
PAGE = """\
# Layouts

Shipped scenes as they are, and written in layouts drawn at random (other order of sections, blocks
or brackets, indentation, quotes, spaces, comments, blank lines), put into the usual layout by
`lagrange fmt`. A meaning is that of PyYAML's loader of texts, which the layout does not use.

    {command}

| scenes | number | already so | laid out twice as once | other meaning | comments | lost |
|---|---|---|---|---|---|---|
{rows}
"""


@dataclass
class Writer:
    """Writes a tree of YAML in a layout that is drawn."""

    random: random.Random
    comments: int = 0
    lines: list[str] = field(default_factory=list)

    def scene(self, root: yaml.MappingNode) -> str:
        """The text of a scene, its sections in any order."""
        entries = list(root.value)
        if self.random.random() < 0.7:
            self.random.shuffle(entries)
        self.mapping(entries, 0)
        text = "\n".join(self.lines) + self.random.choice(("", "\n", "\n\n"))
        return text.replace("\n", "\r\n") if self.random.random() < 0.1 else text

    def mapping(self, entries: list[tuple[Any, Any]], column: int) -> None:
        for key, value in entries:
            self.between(column)
            self.value(" " * column + self.scalar(key, key=True) + ":", value, column, in_map=True)

    def sequence(self, items: list[Any], column: int) -> None:
        for item in items:
            self.between(column)
            self.value(" " * column + "-", item, column)

    def value(self, begun: str, node: Any, column: int, *, in_map: bool = False) -> None:
        """Write a value after the beginning of its line, or below it."""
        step = self.random.choice((1, 2, 2, 3, 4, 8))
        is_block = node.value and not isinstance(node, yaml.ScalarNode)
        if is_block and not self.inline(node):
            self.lines.append(begun + self.end())
            if isinstance(node, yaml.MappingNode):
                self.mapping(node.value, column + step)
            else:
                dash = column if in_map and self.random.random() < 0.4 else column + step
                self.sequence(node.value, dash)
            return
        text = self.flow(node) if not isinstance(node, yaml.ScalarNode) else self.scalar(node)
        words = text.split(" ")
        if isinstance(node, yaml.ScalarNode) and len(words) > 3 and self.random.random() < 0.2:
            cut = self.random.randrange(2, len(words) - 1)
            if words[cut] and words[cut][0] not in "#-?:" and words[cut - 1] and node.value == text:
                self.lines.append(f"{begun} {' '.join(words[:cut])}")
                self.lines.append(" " * (column + step) + " ".join(words[cut:]) + self.end())
                return
        self.lines.append(begun + " " * self.random.choice((1, 1, 2, 5)) + text + self.end())

    def inline(self, node: Any) -> bool:
        return bool(self.random.random() < (0.9 if node.flow_style else 0.1))

    def flow(self, node: Any) -> str:
        """A value in brackets."""
        if isinstance(node, yaml.ScalarNode):
            return self.scalar(node, flow=True)
        gap = self.random.choice(("", "", " "))
        comma = self.random.choice((", ", ",  ", " , ", ","))
        if isinstance(node, yaml.SequenceNode):
            return f"[{gap}{comma.join(map(self.flow, node.value))}{gap}]"
        pairs = [f"{self.scalar(k, key=True, flow=True)}: {self.flow(v)}" for k, v in node.value]
        return f"{{{gap}{comma.join(pairs)}{gap}}}"

    def scalar(self, node: yaml.ScalarNode, *, key: bool = False, flow: bool = False) -> str:
        """A text in quotes or, where it may be, without; numbers stay as they are."""
        text, drawn = node.value, self.random.random()
        if yaml.SafeLoader("").resolve(yaml.ScalarNode, text, (True, False)) != STRING:
            return text if node.style in (None, "") else json.dumps(text)
        if drawn < 0.2 or "\n" in text:
            return json.dumps(text, ensure_ascii=False)
        if drawn < 0.3:
            return "'" + text.replace("'", "''") + "'"
        context = f"{{{text}: 1}}" if key else f"[{text}]" if flow else text
        try:
            read = yaml.load(context, yaml.BaseLoader)
        except yaml.YAMLError:
            return json.dumps(text, ensure_ascii=False)
        expected = {text: "1"} if key else [text] if flow else text
        return text if read == expected else json.dumps(text, ensure_ascii=False)

    def between(self, column: int) -> None:
        """Blank lines and comments before an entry."""
        if self.random.random() < 0.1:
            self.lines += [""] * self.random.choice((1, 1, 3))
        if self.random.random() < 0.1:
            self.lines.append(" " * self.random.choice((0, column, column + 3)) + self.comment())

    def end(self) -> str:
        """The end of a line: perhaps a comment, or blanks."""
        drawn = self.random.random()
        return f" {' ' * int(drawn * 60)}{self.comment()}" if drawn < 0.1 else "  " * (drawn > 0.9)

    def comment(self) -> str:
        self.comments += 1
        return f"# remark {self.comments}: {{a, 'b"


STRING = "tag:yaml.org,2002:str"


@dataclass
class Row:
    """Counts of one kind of scenes."""

    number: int = 0
    unchanged: int = 0
    stable: int = 0
    other: int = 0
    comments: int = 0
    lost: int = 0

    def add(self, text: str, comments: Counter[str]) -> None:
        """Lay a text out, and count what becomes of it."""
        after = laid_out(text.encode(), "drawn.yaml")
        self.number += 1
        self.unchanged += after == text
        self.stable += laid_out(after.encode(), "drawn.yaml") == after
        meanings = [yaml.load(t, yaml.BaseLoader) for t in (text, after)]
        if meanings[0] != meanings[1]:
            self.other += 1
            print(text, after, sep="\n----\n", file=sys.stderr)
        self.comments += comments.total()
        found = Counter({comment: after.count(comment) for comment in comments})
        self.lost += sum((found - comments).values()) + sum((comments - found).values())

    def __str__(self) -> str:
        cells = (self.number, self.unchanged, self.stable, self.other, self.comments, self.lost)
        return " | ".join(f"{cell:,}" for cell in cells)

    @property
    def holds(self) -> bool:
        return self.stable == self.number and not self.other and not self.lost


def drawn_scene(number: int, seed: int) -> tuple[str, Counter[str]]:
    """A scene in a layout that is drawn, and its comments."""
    chosen = random.Random(f"{seed} {number}")
    root = yaml.compose(SCENES[number % len(SCENES)].read_text(encoding="utf-8"), yaml.SafeLoader)
    writer = Writer(chosen)
    text = writer.scene(root)
    return text, Counter(f"# remark {k}: {{a, 'b" for k in range(1, writer.comments + 1))


def shipped() -> Iterator[tuple[str, Counter[str]]]:
    """The shipped scenes and their comments, which stand on lines of their own."""
    for path in SCENES:
        text = path.read_text(encoding="utf-8")
        lines = (line.strip() for line in text.splitlines())
        yield text, Counter(line for line in lines if line.startswith("#"))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", type=int, default=2000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--docs", type=Path, help="write the table to this page")
    arguments = parser.parse_args()
    rows = {"shipped": Row(), "drawn": Row()}
    for text, comments in shipped():
        rows["shipped"].add(text, comments)
    for number in range(arguments.scenes):
        rows["drawn"].add(*drawn_scene(number, arguments.seed))
    table = "\n".join(f"| {name} | {row} |" for name, row in rows.items())
    print(table)
    if arguments.docs is not None:
        words = f"--scenes {arguments.scenes} --seed {arguments.seed} --docs {arguments.docs}"
        command = f"python benchmarks/layouts.py {words}"
        arguments.docs.write_text(PAGE.format(command=command, rows=table), encoding="utf-8")
    return 0 if all(row.holds for row in rows.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
