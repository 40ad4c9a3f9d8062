"""Report of ``lagrange simulate --section``: the points, and what is open about them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.simulation import SECTION

if TYPE_CHECKING:
    from lagrange_cli.studies.section.result import Section, SectionPoints

#: Points and members that the text lists, and numbers of each point.
_MOST_POINTS, _MOST_MEMBERS, _MOST_NUMBERS = 12, 40, 5

#: Times that a sentence lists.
_MOST_TIMES = 4


@dataclass(frozen=True, slots=True)
class FoundSection:
    """A section, and the names of further columns that were asked for."""

    section: Section
    extra: Sequence[str] = ()


def _text(report: FoundSection) -> Page:
    """The result for a person."""
    section = report.section
    many = len(section.members) > 1
    of_members = f" of {len(section.members)} motions" if many else ""
    heading = (
        f"{section.name} where {section.condition}: {_count(len(section), 'point')}{of_members}"
    )
    return page(
        [
            [sentence_row(heading, "heading")],
            _members(section) if many else _points(report),
            labelled(*(_of_all(section) if many else _known(section.members[0])), width=8),
        ]
    )


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'s' * (number != 1)}"


def _points(report: FoundSection) -> list[Row]:
    """List the first points of a motion, with the first numbers of each."""
    columns = report.section.table(report.extra)
    rates = [f"dot({name})" for name in report.section.coordinates]
    state = [*report.section.coordinates, *rates]
    names = ["t", *state[:_MOST_NUMBERS], *(["energy"] if "energy" in report.extra else [])]
    rows = [
        [f"{columns[name][k]:.9g}" for name in names]
        for k in range(min(len(report.section), _MOST_POINTS))
    ]
    if not rows:
        return []
    lines = table([TableColumn(name, 14, ">") for name in names], rows)
    if len(report.section) > _MOST_POINTS:
        lines.append(Row(f"  and {len(report.section) - _MOST_POINTS:,} more; -o has them all"))
    return lines


def _members(section: Section) -> list[Row]:
    """List the members with the number of their points."""
    columns = (
        TableColumn("member"),
        TableColumn("points", align=">"),
        TableColumn("error", 8),
        TableColumn("status"),
        TableColumn("values"),
    )
    rows = []
    for number, points in enumerate(section.members[:_MOST_MEMBERS]):
        values = ", ".join(f"{name} = {text}" for name, text in points.given.items())
        said = ", ".join(filter(None, (points.status, *_doubts(points))))
        rows.append([str(number), f"{len(points.t)}", _error(points), said, values])
    lines = table(columns, rows)
    if len(section.members) > _MOST_MEMBERS:
        lines.append(Row(f"  and {len(section.members) - _MOST_MEMBERS:,} more; --json has them"))
    return lines


def _error(points: SectionPoints) -> str:
    return "none" if points.error is None else f"{points.error.max(initial=0.0):.1e}"


def _doubts(points: SectionPoints) -> Iterator[str]:
    """Say briefly what is not known of the points of a member."""
    if points.uncertain:
        yield f"{points.uncertain} uncertain"
    if points.open:
        yield f"open at {_count(len(points.open), 'place')}"


def _known(points: SectionPoints) -> Iterator[tuple[str, str]]:
    """Say what is known of the points of one motion, and what is not."""
    if points.requested is None:
        yield "Accuracy", "nothing is promised or estimated: a method was chosen"
    else:
        error, until = points.error, points.holds_until
        of_points = "" if error is None else f"{error.max(initial=0.0):.1e} estimated of points, "
        yield "Accuracy", f"{points.requested:g} requested, {of_points}holds until t = {until:.9g}"
    if points.uncertain:
        what = f"{_count(points.uncertain, 'point')} where the motion meets the section too flatly"
        yield "Beyond", f"{what} to be known to that accuracy: column error"
    if points.open:
        times = ", ".join(f"{t:.9g}" for t in points.open[:_MOST_TIMES])
        more = ", ..." if len(points.open) > _MOST_TIMES else ""
        what = "the motion only touches the section, or a border of it, as far as is known"
        yield "Open", f"the number of points at t = {times}{more}: {what}"
    drift = points.energy_drift
    yield "Energy", "not found to be conserved" if drift is None else f"relative drift {drift:.1e}"
    yield "Method", f"{points.method}, {_count(points.runs, 'run')}"


def _of_all(section: Section) -> Iterator[tuple[str, str]]:
    """Say what is known of the points of all motions."""
    errors = [p.error.max(initial=0.0) for p in section.members if p.error is not None]
    if errors:
        yield "Accuracy", f"{max(errors):.1e} estimated of points, the largest of all members"
    else:
        yield "Accuracy", "nothing is promised or estimated: a method was chosen"


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[FoundSection], str | Page]] = {
    "text": _text,
    "json": lambda report: json_text(SECTION.write(report.section)),
}
