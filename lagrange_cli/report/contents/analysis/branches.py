"""Sections on branches of equilibria: their parts, how they end, and marked points."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.analysis.equilibria import held_values
from lagrange_cli.report.contents.analysis.wording import (
    hidden,
    verdict_word,
)
from lagrange_cli.report.contents.numbers import phrased
from lagrange_cli.report.document_options import MOST_LISTED
from lagrange_cli.report.inlines import (
    Inline,
    Sentence,
    Text,
    literal,
    numeral,
    say,
    symbol,
)
from lagrange_cli.report.tree import Bullets, Labelled, Paragraph, Section, Table, section

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import (
        Branch,
        Branches,
        EndKind,
        MarkedPoint,
        MarkKind,
    )

#: Coordinates that have columns.
_MOST_COORDINATES = 3


def branch_sections(
    result: Branches | None, names: Sequence[str]
) -> Iterator[tuple[str, Section | None]]:
    """Yield the sections on branches and their marked points, if branches were followed.

    Each has a name before it, by which labels are told apart. ``names``: those of coordinates.
    """
    if result is not None:
        contents = _BranchContents(result, names)
        yield "branches", contents.branches()
        yield "marked-points", contents.marks()


@dataclass(frozen=True)
class _BranchContents:
    result: Branches
    names: Sequence[str]

    def branches(self) -> Section | None:
        """Return the parts of all branches with their stability."""
        result = self.result
        listed = result.branches[:MOST_LISTED]
        heads = (say("branch"), *self._heads(), say("stability"), say("reason"))
        rows = [row for k, branch in enumerate(listed, 1) for row in self._stretches(k, branch)]
        ends = [
            (say("branch {numbers}", numbers=number), line)
            for number, branch in enumerate(listed, 1)
            for line in self._ends(branch)
        ]
        skipped = list(_skipped(result))
        return section(
            say("Branches of equilibria"),
            Paragraph(say("{text}.", text=_found(result))),
            Table(heads, tuple(rows), say("reason")) if rows else None,
            Labelled(tuple(ends)) if ends else None,
            hidden(len(result.branches) - len(listed)),
            Bullets(tuple(skipped)) if skipped else None,
            *held_values(result.held_inputs),
        )

    def marks(self) -> Section | None:
        """Return the marked points of all branches."""
        marks = self.result.marks
        if not marks:
            return None
        heads = (say("number"), say("point"), *self._heads(), say("error"), say("frequency"))
        rows = tuple(self._mark(k, mark) for k, mark in enumerate(marks[:MOST_LISTED]))
        return section(
            say("Marked points"),
            Table((*heads, say("branches")), rows).without_empty_columns(),
            hidden(len(marks) - len(rows)),
        )

    def _followed(self) -> list[tuple[int, str]]:
        """List the coordinates that have columns, with their numbers."""
        free = self.result.free
        return [(k, n) for k, n in enumerate(self.names) if n not in free][:_MOST_COORDINATES]

    def _heads(self) -> list[Text]:
        names = [self.result.parameter, *(name for _, name in self._followed())]
        return [Inline(symbol(name)) for name in names]

    def _stretches(self, number: int, branch: Branch) -> Iterator[tuple[Text, ...]]:
        for k, stretch in enumerate(branch.stretches[:MOST_LISTED]):
            part = slice(stretch.first, stretch.last + 1)
            cells = [_between(branch.values[part].tolist())]
            for place, name in self._followed():
                values = branch.positions[part, place].tolist()
                cells.append(_between([_within_turn(self.result, name, x) for x in values]))
            stability = stretch.stability
            verdict, reason = verdict_word(stability.verdict), phrased(stability.reason)
            yield (str(number) if k == 0 else "", *cells, verdict, reason)

    def _mark(self, number: int, mark: MarkedPoint) -> tuple[Text, ...]:
        values = [
            Inline(numeral(_within_turn(self.result, name, mark.position[k])))
            for k, name in self._followed()
        ]
        on_branches = [
            k
            for k, branch in enumerate(self.result.branches, 1)
            if any(at == number for _, at in branch.marks)
        ]
        return (
            str(number + 1),
            kind_word(mark.kind),
            Inline(literal(value_text(mark.value, mark.error))),
            *values,
            Inline(literal(error_text(mark.error))),
            "" if mark.frequency is None else Inline(numeral(mark.frequency)),
            ", ".join(map(str, on_branches)),
        )

    def _ends(self, branch: Branch) -> list[Sentence]:
        """Say how a branch ends on both sides, where that is worth a line."""
        if branch.ends[1] == "closed":
            return [say("a closed loop")]
        values = float(branch.values[0]), float(branch.values[-1])
        name = symbol(self.result.parameter)
        lines = [
            end_line(kind, Inline(name + " = " + numeral(x)))
            for kind, x in zip(branch.ends, values, strict=True)
        ]
        return list(dict.fromkeys(line for line in lines if line is not None))


def kind_word(kind: MarkKind) -> Sentence:
    """Return the name of a kind of marked point, as fold or flutter."""
    return {
        "fold": say("fold"),
        "pitchfork": say("pitchfork"),
        "transcritical": say("transcritical"),
        "branch point": say("branch point"),
        "divergence": say("divergence"),
        "flutter": say("flutter"),
    }[kind]


def end_line(kind: EndKind, place: Inline) -> Sentence | None:
    """Say how a branch ends, other than with the range or in a closed loop; else None.

    ``place``: the parameter there, as ``p = 1``.
    """
    if kind in ("range", "closed"):
        return None
    return {
        "branch point": say("begins at {place}", place=place),
        "singular": say("ends at {place}: coordinates are singular beyond", place=place),
        "pole": say("ends at {place}: forces grow without bound there", place=place),
        "far": say("ends at {place}: it leaves every bound", place=place),
        "stuck": say("ends at {place}: it could not be followed further", place=place),
        "budget": say("ends at {place}: the budget is spent", place=place),
    }[kind]


def _found(result: Branches) -> Sentence:
    """Say how many branches were found over which range, from how many values."""
    return say(
        "{name} from {start} to {end}; {count} found, from equilibria at {values} values; there may"
        " be others",
        name=Inline(symbol(result.parameter)),
        start=Inline(numeral(result.low)),
        end=Inline(numeral(result.high)),
        count=len(result.branches),
        values=result.values,
    )


def _skipped(result: Branches) -> Iterator[Sentence]:
    """Say how many equilibria were not followed; nothing if all were."""
    if result.skipped:
        yield say(
            "{count} equilibria were not followed: they are degenerate, or parts of continua",
            count=result.skipped,
        )
    if result.left:
        yield say("{count} more were not followed: the budget is spent", count=result.left)


def _within_turn(result: Branches, name: str, value: float) -> float:
    """Return an angle of which a turn means nothing between -π and π, others as they are."""
    if name not in result.periodic:
        return value
    turned = math.remainder(value, 2 * math.pi)
    return math.pi if turned <= -math.pi + 1e-12 else turned


def _between(values: Sequence[float]) -> Text:
    """Write the value of a stretch, both ends, or the ends and the value farthest from them."""
    way = [Inline(literal(text)) for text in way_of(values)]
    if len(way) == 1:
        return way[0]
    if len(way) == 2:
        return say("{start} to {end}", start=way[0], end=way[1])
    return say("{start} over {middle} to {end}", start=way[0], middle=way[1], end=way[2])


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
