"""Text on branches of equilibria: the parts of each with their stability, and marked points."""

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
from lagrange_cli.notation.page import Block, Row, words

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import Branch, Branches, MarkedPoint, Stretch
    from lagrange_cli.emit.language import Language

#: Coordinates of which both ends of a part are written.
_MOST_COORDINATES = 4


@dataclass(frozen=True)
class BranchRows:
    """Writes branches.

    Attributes
    ----------
    found
        What was found.
    names
        Names of all coordinates.
    say, told
        The language, and what says phrases of the analysis in it.
    symbol
        Prints a name of the scene.
    plus_minus
        The sign before an error.
    """

    found: Branches
    names: Sequence[str]
    say: Language
    told: Callable[[str], str]
    symbol: Callable[[str], str]
    plus_minus: str

    def rows(self) -> Iterator[Row | Block]:
        """Write the branches."""
        found, say = self.found, self.say
        name = self.symbol(found.parameter)
        told = words(found_line(found, say, str, name))
        yield Row(say("Branches of equilibria"), "   ", told, "heading")
        listed = found.branches[:MOST_LISTED]
        verdicts = [verdict_word(s.stability.verdict, say) for b in listed for s in b.stretches]
        width = max(map(len, verdicts), default=0)
        for number, branch in enumerate(listed, 1):
            parts = branch.stretches[:MOST_LISTED]
            rows = [self._stretch(branch, number, k, s, width) for k, s in enumerate(parts)]
            yield Block(tuple(rows), "asides")
            hidden = len(branch.stretches) - len(parts)
            lines = [self._more(hidden)] if hidden else []
            for line in [*lines, *end_lines(branch, say, self._place)]:
                yield Row("", " " * 5, words(line))
        hidden = len(found.branches) - len(listed)
        lines = [self._more(hidden)] if hidden else []
        for line in [*lines, *skipped_lines(found, say), self._held()]:
            if line:
                yield Row("", "  ", words(line))

    def marked_rows(self) -> Iterator[Row | Block]:
        """Write the marked points of all branches."""
        marks, say = self.found.marks, self.say
        if not marks:
            return
        yield Row(say("Marked points"), role="heading")
        listed = marks[:MOST_LISTED]
        width = max(len(kind_word(mark.kind, say)) for mark in listed)
        rows = [self._mark(number, mark, width) for number, mark in enumerate(listed)]
        yield Block(tuple(rows), "asides")
        if len(marks) > len(listed):
            yield Row("", "  ", words(self._more(len(marks) - len(listed))))

    def _more(self, count: int) -> str:
        return self.say("and {count} more, in --json", count=count)

    def _held(self) -> str:
        if not self.found.held:
            return ""
        held = ", ".join(f"{self.symbol(n)} = {x:g}" for n, x in self.found.held)
        return self.say("with inputs held at {values}", values=held)

    def _place(self, value: float) -> str:
        return f"{self.symbol(self.found.parameter)} = {value:.6g}"

    def _stretch(self, branch: Branch, number: int, part: int, stretch: Stretch, width: int) -> Row:
        verdict = verdict_word(stretch.stability.verdict, self.say)
        head = f"{number:3d}  {verdict}" if part == 0 else f"{'':5}{verdict}"
        part_of = slice(stretch.first, stretch.last + 1)
        told = [self._between(self.found.parameter, branch.values[part_of].tolist())]
        for k, name in followed(self.found, self.names)[:_MOST_COORDINATES]:
            values = branch.positions[part_of, k].tolist()
            told.append(self._between(name, [within_turn(self.found, name, x) for x in values]))
        gap = " " * (5 + width - len(head) + 3)
        reason = self.told(stretch.stability.reason)
        return Row(head, gap, words(", ".join(told)), "name", 2, reason)

    def _between(self, name: str, values: Sequence[float]) -> str:
        symbol, way = self.symbol(name), way_of(values)
        if len(way) == 1:
            return f"{symbol} = {way[0]}"
        if len(way) == 2:
            return self.say("{name} from {start} to {end}", name=symbol, start=way[0], end=way[1])
        start, middle, end = way
        return self.say(
            "{name} from {start} over {middle} to {end}",
            name=symbol,
            start=start,
            middle=middle,
            end=end,
        )

    def _mark(self, number: int, mark: MarkedPoint, width: int) -> Row:
        kind = kind_word(mark.kind, self.say)
        head = f"{number + 1:3d}  {kind}"
        value = f"{value_text(mark.value, mark.error)} {self.plus_minus} {error_text(mark.error)}"
        told = [f"{self.symbol(self.found.parameter)} = {value}"]
        for k, name in followed(self.found, self.names)[:_MOST_COORDINATES]:
            shown = within_turn(self.found, name, mark.position[k]) + 0.0
            told.append(f"{self.symbol(name)} = {shown:.6g}")
        if mark.frequency is not None:
            told.append(self.say("angular frequency {value}", value=f"{mark.frequency:.6g}"))
        places = ", ".join(map(str, on_branches(self.found, number)))
        aside = self.say("branch {numbers}", numbers=places)
        gap = " " * (5 + width - len(head) + 3)
        return Row(head, gap, words(", ".join(told)), "name", 2, aside)
