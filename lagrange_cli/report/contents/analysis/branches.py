"""Branches of equilibria: phrases, rows of the terminal, sections of documents."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Block, Row, words
from lagrange_cli.report.contents.analysis.wording import verdict_word
from lagrange_cli.report.tree import Bullets, Paragraph, Section, Table, section

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import (
        Branch,
        Branches,
        EndKind,
        MarkedPoint,
        MarkKind,
        Stretch,
    )
    from lagrange_cli.report.contents.analysis.places import Places
    from lagrange_cli.report.contents.derivation.writer import DocumentWriter
    from lagrange_cli.report.phrases.language import Language

#: Branches and marked points that are listed.
MOST_LISTED = 16


def kind_word(kind: MarkKind, say: Language) -> str:
    """Return the name of a kind of marked point, as fold or flutter."""
    return {
        "fold": say("fold"),
        "pitchfork": say("pitchfork"),
        "transcritical": say("transcritical"),
        "branch point": say("branch point"),
        "divergence": say("divergence"),
        "flutter": say("flutter"),
    }[kind]


def end_line(kind: EndKind, place: str, say: Language) -> str:
    """Say how a branch ends, other than with the range or in a closed loop; else nothing.

    ``place``: the parameter there, as ``p = 1``.
    """
    if kind in ("range", "closed"):
        return ""
    return {
        "branch point": say("begins at {place}", place=place),
        "singular": say("ends at {place}: coordinates are singular beyond", place=place),
        "pole": say("ends at {place}: forces grow without bound there", place=place),
        "far": say("ends at {place}: it leaves every bound", place=place),
        "stuck": say("ends at {place}: it could not be followed further", place=place),
        "budget": say("ends at {place}: the budget is spent", place=place),
    }[kind]


def found_line(result: Branches, say: Language, inline: Callable[[str], str], name: str) -> str:
    """Say how many branches were found over which range, from how many values."""
    return say(
        "{name} from {start} to {end}; {count} found, from equilibria at {values} values; there may"
        " be others",
        name=inline(name),
        start=f"{result.low:.6g}",
        end=f"{result.high:.6g}",
        count=len(result.branches),
        values=result.values,
    )


def skipped_lines(result: Branches, say: Language) -> list[str]:
    """Say how many equilibria were not followed; nothing if all were."""
    lines = []
    if result.skipped:
        lines.append(
            say(
                "{count} equilibria were not followed: they are degenerate, or parts of continua",
                count=result.skipped,
            )
        )
    if result.left:
        lines.append(say("{count} more were not followed: the budget is spent", count=result.left))
    return lines


def within_turn(result: Branches, name: str, value: float) -> float:
    """Return an angle of which a turn means nothing between -π and π, others as they are."""
    if name not in result.periodic:
        return value
    turned = math.remainder(value, 2 * math.pi)
    return math.pi if turned <= -math.pi + 1e-12 else turned


def followed(result: Branches, names: Sequence[str]) -> list[tuple[int, str]]:
    """List the coordinates that branches have, with their numbers."""
    return [(k, name) for k, name in enumerate(names) if name not in result.free]


def on_branches(result: Branches, mark: int) -> list[int]:
    """List the numbers, from 1, of the branches that a marked point is on."""
    return [
        k
        for k, branch in enumerate(result.branches, 1)
        if any(number == mark for _, number in branch.marks)
    ]


def end_lines(branch: Branch, say: Language, place: Callable[[float], str]) -> list[str]:
    """Say how a branch ends on both sides, where that is worth a line."""
    if branch.ends[1] == "closed":
        return [say("a closed loop")]
    values = float(branch.values[0]), float(branch.values[-1])
    lines = [end_line(k, place(x), say) for k, x in zip(branch.ends, values, strict=True)]
    return list(dict.fromkeys(line for line in lines if line))


def way_of(values: Sequence[float]) -> tuple[str, ...]:
    """Write the value of a stretch, both ends, or the ends and the value farthest from them."""
    start, end = (f"{values[k] + 0.0:.6g}" for k in (0, -1))
    if start != end:
        return start, end
    far = max(values, key=lambda x: abs(x - values[0]))
    middle = f"{far + 0.0:.6g}"
    size = max(1.0, abs(values[0]))
    return (start,) if abs(far - values[0]) <= 1e-9 * size else (start, middle, end)


def value_text(value: float, error: float) -> str:
    """Write a number with the digits that are known, sixteen at most."""
    if value == 0.0 or abs(value) <= error:
        return "0"
    digits = math.floor(math.log10(abs(value))) - math.floor(math.log10(max(error, 1e-300)))
    return f"{value:.{max(1, min(16, digits))}g}"


def error_text(error: float) -> str:
    """Write an error with one digit, rounded up."""
    if error == 0.0:
        return "0"
    size = 10.0 ** math.floor(math.log10(error))
    return f"{math.ceil(error / size - 1e-9) * size:.0e}"


#: Coordinates of which both ends of a part are written.
_MOST_IN_ROWS = 4


@dataclass(frozen=True)
class BranchRows:
    """Writes branches.

    Attributes
    ----------
    result
        The branches of equilibria that were found.
    names
        Names of all coordinates.
    say, phrase
        The language, and what says phrases of the analysis in it.
    symbol
        Prints a name of the scene.
    plus_minus
        The sign before an error.
    """

    result: Branches
    names: Sequence[str]
    say: Language
    phrase: Callable[[str], str]
    symbol: Callable[[str], str]
    plus_minus: str

    def rows(self) -> Iterator[Row | Block]:
        """Write the branches."""
        result, say = self.result, self.say
        name = self.symbol(result.parameter)
        span = words(found_line(result, say, str, name))
        yield Row(say("Branches of equilibria"), "   ", span, "heading")
        listed = result.branches[:MOST_LISTED]
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
        hidden = len(result.branches) - len(listed)
        lines = [self._more(hidden)] if hidden else []
        for line in [*lines, *skipped_lines(result, say), self._held()]:
            if line:
                yield Row("", "  ", words(line))

    def marked_rows(self) -> Iterator[Row | Block]:
        """Write the marked points of all branches."""
        marks, say = self.result.marks, self.say
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
        if not self.result.held_inputs:
            return ""
        inputs = ", ".join(f"{self.symbol(n)} = {x:g}" for n, x in self.result.held_inputs)
        return self.say("with inputs held at {values}", values=inputs)

    def _place(self, value: float) -> str:
        return f"{self.symbol(self.result.parameter)} = {value:.6g}"

    def _stretch(self, branch: Branch, number: int, part: int, stretch: Stretch, width: int) -> Row:
        verdict = verdict_word(stretch.stability.verdict, self.say)
        head = f"{number:3d}  {verdict}" if part == 0 else f"{'':5}{verdict}"
        part_of = slice(stretch.first, stretch.last + 1)
        phrases = [self._between(self.result.parameter, branch.values[part_of].tolist())]
        for k, name in followed(self.result, self.names)[:_MOST_IN_ROWS]:
            values = branch.positions[part_of, k].tolist()
            phrases.append(self._between(name, [within_turn(self.result, name, x) for x in values]))
        gap = " " * (5 + width - len(head) + 3)
        reason = self.phrase(stretch.stability.reason)
        return Row(head, gap, words(", ".join(phrases)), "name", 2, reason)

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
        phrases = [f"{self.symbol(self.result.parameter)} = {value}"]
        for k, name in followed(self.result, self.names)[:_MOST_IN_ROWS]:
            shown = within_turn(self.result, name, mark.position[k]) + 0.0
            phrases.append(f"{self.symbol(name)} = {shown:.6g}")
        if mark.frequency is not None:
            phrases.append(self.say("angular frequency {value}", value=f"{mark.frequency:.6g}"))
        places = ", ".join(map(str, on_branches(self.result, number)))
        aside = self.say("branch {numbers}", numbers=places)
        gap = " " * (5 + width - len(head) + 3)
        return Row(head, gap, words(", ".join(phrases)), "name", 2, aside)


#: Coordinates that have columns.
_MOST_IN_COLUMNS = 3


@dataclass(frozen=True)
class BranchSections:
    """Writes branches.

    Attributes
    ----------
    result
        The branches of equilibria that were found.
    writer, places
        The letters and language, and coordinates in them.
    phrase
        Says phrases of the analysis.
    """

    result: Branches
    writer: DocumentWriter
    places: Places
    phrase: Callable[[str], str]

    def branches(self) -> Section | None:
        """Return the parts of all branches with their stability."""
        say = self.writer.say
        text = found_line(self.result, say, str, self._symbol(self.result.parameter))
        blocks: list[Paragraph | Table | Bullets] = [Paragraph(say("{text}.", text=text))]
        heads = (say("branch"), *self._heads(), say("stability"), say("reason"))
        rows = [
            row
            for number, branch in enumerate(self.result.branches[:MOST_LISTED], 1)
            for row in self._stretches(number, branch)
        ]
        if rows:
            blocks.append(Table(heads, tuple(rows), say("reason")))
        lines = list(self._ends())
        blocks += [Bullets(tuple(lines))] if lines else []
        return section(say("Branches of equilibria"), *blocks)

    def marks(self) -> Section | None:
        """Return the marked points of all branches."""
        say, marks = self.writer.say, self.result.marks
        if not marks:
            return None
        heads = (say("number"), say("point"), *self._heads(), say("error"), say("frequency"))
        rows = tuple(self._mark(k, mark) for k, mark in enumerate(marks[:MOST_LISTED]))
        table = Table((*heads, say("branches")), rows).without_empty_columns()
        hidden = len(marks) - len(rows)
        more = Paragraph(say("And {count} more, in JSON.", count=hidden)) if hidden else None
        return section(say("Marked points"), table, more)

    def _symbol(self, name: str) -> str:
        letters = self.writer.letters
        return letters.inline(letters.symbol(name))

    def _coordinates(self) -> list[tuple[int, str]]:
        names = [c.name for c in self.places.coordinates]
        return followed(self.result, names)[:_MOST_IN_COLUMNS]

    def _heads(self) -> list[str]:
        return [
            self._symbol(self.result.parameter),
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
                cells.append(self._between([within_turn(self.result, name, x) for x in values]))
            verdict = verdict_word(stretch.stability.verdict, say)
            reason = self.phrase(stretch.stability.reason)
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
            self._number(f"{within_turn(self.result, name, mark.position[k]) + 0.0:.6g}")
            for k, name in self._coordinates()
        ]
        return (
            str(number + 1),
            kind_word(mark.kind, self.writer.say),
            self._number(value_text(mark.value, mark.error)),
            *values,
            self._number(error_text(mark.error)),
            "" if mark.frequency is None else self._number(f"{mark.frequency:.6g}"),
            ", ".join(map(str, on_branches(self.result, number))),
        )

    def _ends(self) -> Iterator[str]:
        say, letters = self.writer.say, self.writer.letters
        listed = self.result.branches[:MOST_LISTED]

        def place(value: float) -> str:
            symbol = letters.symbol(self.result.parameter)
            return letters.inline(f"{symbol} = {self.places.number(value)}")

        for number, branch in enumerate(listed, 1):
            for line in end_lines(branch, say, place):
                yield say("branch {numbers}: {text}", numbers=str(number), text=line)
        if len(self.result.branches) > len(listed):
            yield say("And {count} more, in JSON.", count=len(self.result.branches) - len(listed))
        yield from skipped_lines(self.result, say)
        if self.result.held_inputs:
            inputs = ", ".join(
                letters.inline(f"{letters.symbol(n)} = {self.places.number(x)}")
                for n, x in self.result.held_inputs
            )
            yield say("with inputs held at {values}", values=inputs)
