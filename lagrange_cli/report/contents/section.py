"""Report of ``lagrange simulate --section``: the points, and what is open about them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lagrange_cli.report.contents.numbers import assigned, decimal, phrased
from lagrange_cli.report.contents.simulate import drift_of
from lagrange_cli.report.inlines import Count, Listed, Plain, Text, Typed, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import Column, Document, Labelled, Part, Table, sections, table_of
from lagrange_cli.report.tree import section as part
from lagrange_cli.report.values.simulation import SECTION
from lagrange_cli.studies.section.result import Section, SectionPoints

#: Points and members that the report lists, and numbers of each point.
_MOST_POINTS, _MOST_MEMBERS, _MOST_NUMBERS = 12, 40, 5

#: Times that a sentence lists.
_MOST_TIMES = 4

#: Characters of the longest number of a point, but for rare exponents.
_DIGITS = 14


@dataclass(frozen=True, slots=True)
class FoundSection:
    """A section, and the names of further columns that were asked for."""

    section: Section
    extra: Sequence[str] = ()


json_of.register(Section, SECTION.write)
json_of.register(FoundSection, lambda report: SECTION.write(report.section))


@contents_of.register
def section_document(report: FoundSection) -> Document:
    """Return the points of a motion, or their number for each of several."""
    section = report.section
    parts = {"name": Plain(section.name), "condition": Plain(section.condition)}
    title: Text = say(
        "{name} where {condition}: {points}", points=_points_counted(len(section)), **parts
    )
    if len(section.members) > 1:
        title = say("{title} of {count} motions", title=title, count=len(section.members))
        written = sections(
            part("", *_members(section.members)), part("", Labelled(_of_all(section)))
        )
    else:
        known = Labelled(tuple(_known(section.members[0])))
        reason = section.members[0].reason
        why = Labelled(((say("Reason"), phrased(reason)),), only="document") if reason else None
        written = sections(part("", *_points(report)), part("", known, why))
    return Document(section.name, "points of a section", title, written)


contents_of.register(Section, lambda section: section_document(FoundSection(section)))


def _points_counted(number: int) -> Text:
    return say.counted(number, "{shown} point", "{shown} points", shown=Count(number))


def _points(report: FoundSection) -> Iterator[Part]:
    """Return the first points of a motion, with the first numbers of each."""
    section, columns = report.section, report.section.table(report.extra)
    state = [*section.coordinates, *(f"dot({name})" for name in section.coordinates)]
    names = ["t", *state[:_MOST_NUMBERS], *(["energy"] if "energy" in report.extra else [])]
    if not len(section):
        return
    heads = tuple(Plain(name) for name in names)
    rows = tuple(
        tuple(decimal(columns[name][k]) for name in names)
        for k in range(min(len(section), _MOST_POINTS))
    )
    yield Table(heads, rows, numeric=frozenset(heads), digits=_DIGITS)
    if len(section) > _MOST_POINTS:
        more = Count(len(section) - _MOST_POINTS)
        yield say("and {count} more; {option} has them all", count=more, option=Typed("-o"))


def _members(members: Sequence[SectionPoints]) -> Iterator[Part]:
    """Return the members with the number of their points."""
    yield table_of(list(enumerate(members[:_MOST_MEMBERS])), *_MEMBERS)
    if len(members) > _MOST_MEMBERS:
        more = Count(len(members) - _MOST_MEMBERS)
        yield say("and {count} more; {option} has them all", count=more, option=Typed("--json"))


def _error(points: SectionPoints) -> Text:
    return say("none") if points.error is None else decimal(points.error.max(initial=0.0), ".1e")


def _status(points: SectionPoints) -> Text:
    """Say briefly how a motion ended, and what is not known of its points."""
    doubts: list[Text] = [Plain(points.status)]
    if points.uncertain:
        doubts.append(say("{count} uncertain", count=points.uncertain))
    if points.open:
        doubts.append(
            say.counted(len(points.open), "open at {count} place", "open at {count} places")
        )
    return Listed(tuple(doubts))


def _given(points: SectionPoints) -> Text:
    return Listed(tuple(assigned(name, Plain(text)) for name, text in points.given.items()))


_MEMBERS: tuple[Column[tuple[int, SectionPoints]], ...] = (
    Column(say("member"), lambda item: f"{item[0]}"),
    Column(say("points"), lambda item: f"{len(item[1].t)}", True),
    Column(say("error"), lambda item: _error(item[1]), True),
    Column(say("status"), lambda item: _status(item[1])),
    Column(say("values"), lambda item: _given(item[1])),
)


def _known(points: SectionPoints) -> Iterator[tuple[Text, Text]]:
    """Say what is known of the points of one motion, and what is not."""
    yield say("Accuracy"), _promise(points)
    if points.uncertain:
        said = say(
            "{points} where the motion meets the section too flatly to be known to that accuracy:"
            " column error",
            points=_points_counted(points.uncertain),
        )
        yield say("Beyond"), said
    if points.open:
        times = (*map(decimal, points.open[:_MOST_TIMES]),)
        more = ("...",) if len(points.open) > _MOST_TIMES else ()
        said = say(
            "the number of points at t = {times}: the motion only touches the section, or a border"
            " of it, as far as is known",
            times=Listed((*times, *more)),
        )
        yield say("Open"), said
    yield say("Energy"), drift_of(points.energy_drift)
    runs = say.counted(points.runs, "{count} run", "{count} runs")
    yield say("Method"), Listed((Plain(points.method), runs))


def _promise(points: SectionPoints) -> Text:
    if points.requested is None:
        return say("nothing is promised or estimated: a method was chosen")
    known = {
        "requested": decimal(points.requested, "g"),
        "until": decimal(points.holds_until),
    }
    if points.error is None:
        return say("{requested} requested, holds until t = {until}", **known)
    return say(
        "{requested} requested, {error} estimated of points, holds until t = {until}",
        error=_error(points),
        **known,
    )


def _of_all(section: Section) -> tuple[tuple[Text, Text], ...]:
    """Return what is known of the points of all motions."""
    errors = [p.error.max(initial=0.0) for p in section.members if p.error is not None]
    if not errors:
        said = say("nothing is promised or estimated: a method was chosen")
    else:
        said = say(
            "{error} estimated of points, the largest of all members",
            error=decimal(max(errors), ".1e"),
        )
    return ((say("Accuracy"), said),)
