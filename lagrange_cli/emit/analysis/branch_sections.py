"""Sections of a document on branches of equilibria."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.emit.analysis.branch_words import (
    MOST_LISTED,
    end_lines,
    error_text,
    followed,
    found_line,
    kind_word,
    on_branches,
    skipped_lines,
    value_text,
    way_of,
    within_turn,
)
from lagrange_cli.emit.analysis.wording import verdict_word
from lagrange_cli.emit.steps.sections import Block, Bullets, Section, Table, Words, section

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import Branch, Branches, MarkedPoint
    from lagrange_cli.emit.analysis.places import Places
    from lagrange_cli.emit.document.writer import DocumentWriter

#: Coordinates that have columns.
_MOST_COORDINATES = 3


@dataclass(frozen=True)
class BranchSections:
    """Writes branches.

    Attributes
    ----------
    found
        What was found.
    writer, places
        The letters and language, and coordinates in them.
    told
        Says phrases of the analysis.
    """

    found: Branches
    writer: DocumentWriter
    places: Places
    told: Callable[[str], str]

    def branches(self) -> Section | None:
        """The parts of all branches with their stability."""
        say = self.writer.say
        text = found_line(self.found, say, str, self._symbol(self.found.parameter))
        blocks: list[Block | None] = [Words(say("{text}.", text=text))]
        heads = (say("branch"), *self._heads(), say("stability"), say("reason"))
        rows = [
            row
            for number, branch in enumerate(self.found.branches[:MOST_LISTED], 1)
            for row in self._stretches(number, branch)
        ]
        if rows:
            blocks.append(Table(heads, tuple(rows), say("reason")))
        lines = list(self._ends())
        blocks += [Bullets(tuple(lines))] if lines else []
        return section(say("Branches of equilibria"), *blocks)

    def marks(self) -> Section | None:
        """The marked points of all branches."""
        say, marks = self.writer.say, self.found.marks
        if not marks:
            return None
        heads = (say("number"), say("point"), *self._heads(), say("error"), say("frequency"))
        rows = tuple(self._mark(k, mark) for k, mark in enumerate(marks[:MOST_LISTED]))
        table = Table((*heads, say("branches")), rows).kept()
        hidden = len(marks) - len(rows)
        more = Words(say("And {count} more, in JSON.", count=hidden)) if hidden else None
        return section(say("Marked points"), table, more)

    def _symbol(self, name: str) -> str:
        letters = self.writer.letters
        return letters.inline(letters.symbol(name))

    def _coordinates(self) -> list[tuple[int, str]]:
        names = [c.name for c in self.places.coordinates]
        return followed(self.found, names)[:_MOST_COORDINATES]

    def _heads(self) -> list[str]:
        return [
            self._symbol(self.found.parameter),
            *(self._symbol(n) for _, n in self._coordinates()),
        ]

    def _number(self, text: str) -> str:
        return self.writer.letters.inline(self.places.literal(text))

    def _stretches(self, number: int, branch: Branch) -> Iterator[tuple[str, ...]]:
        say = self.writer.say
        for k, stretch in enumerate(branch.stretches[:MOST_LISTED]):
            part = slice(stretch.first, stretch.last + 1)
            cells = [self._between(branch.values[part].tolist())]
            for place, name in self._coordinates():
                values = branch.positions[part, place].tolist()
                cells.append(self._between([within_turn(self.found, name, x) for x in values]))
            verdict = verdict_word(stretch.stability.verdict, say)
            reason = self.told(stretch.stability.reason)
            yield (str(number) if k == 0 else "", *cells, verdict, reason)

    def _between(self, values: Sequence[float]) -> str:
        say, way = self.writer.say, [self._number(text) for text in way_of(values)]
        if len(way) == 1:
            return way[0]
        if len(way) == 2:
            return say("{start} to {end}", start=way[0], end=way[1])
        return say("{start} over {middle} to {end}", start=way[0], middle=way[1], end=way[2])

    def _mark(self, number: int, mark: MarkedPoint) -> tuple[str, ...]:
        values = [
            self._number(f"{within_turn(self.found, name, mark.position[k]) + 0.0:.6g}")
            for k, name in self._coordinates()
        ]
        return (
            str(number + 1),
            kind_word(mark.kind, self.writer.say),
            self._number(value_text(mark.value, mark.error)),
            *values,
            self._number(error_text(mark.error)),
            "" if mark.frequency is None else self._number(f"{mark.frequency:.6g}"),
            ", ".join(map(str, on_branches(self.found, number))),
        )

    def _ends(self) -> Iterator[str]:
        say, letters = self.writer.say, self.writer.letters
        listed = self.found.branches[:MOST_LISTED]

        def place(value: float) -> str:
            symbol = letters.symbol(self.found.parameter)
            return letters.inline(f"{symbol} = {self.places.number(value)}")

        for number, branch in enumerate(listed, 1):
            for line in end_lines(branch, say, place):
                yield say("branch {numbers}: {text}", numbers=str(number), text=line)
        if len(self.found.branches) > len(listed):
            yield say("And {count} more, in JSON.", count=len(self.found.branches) - len(listed))
        yield from skipped_lines(self.found, say)
        if self.found.held:
            held = ", ".join(
                letters.inline(f"{letters.symbol(n)} = {self.places.number(x)}")
                for n, x in self.found.held
            )
            yield say("with inputs held at {values}", values=held)
