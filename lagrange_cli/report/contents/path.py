"""Report of ``lagrange path``: the paths of stationary action that were found."""

from __future__ import annotations

from collections.abc import Iterator

from lagrange_cli.report.contents.numbers import assigned, decimal
from lagrange_cli.report.inlines import Listed, Plain, Text, Typed, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import Column, Document, Labelled, section, sections, table_of
from lagrange_cli.report.values.studies import PATHS
from lagrange_cli.studies.path.ends import End
from lagrange_cli.studies.path.measure import StationaryPath
from lagrange_cli.studies.path.result import Paths

#: Conjugate points of a path that the report lists.
_MOST_POINTS = 8

json_of.register(Paths, PATHS.write)


@contents_of.register
def paths_document(paths: Paths) -> Document:
    """Return the paths, and how they were found."""
    title = say.counted(
        len(paths.solutions),
        "{name}: {count} path of stationary action",
        "{name}: {count} paths of stationary action",
        name=Plain(paths.name),
    )
    ends = (say("from"), _end(paths, paths.first)), (say("to"), _end(paths, paths.last))
    numbered = list(enumerate(paths.solutions, 1))
    details = [
        (say("Path {number}", number=k), Listed(said, between="; "))
        for k, path in numbered
        if (said := tuple(_details(paths, path)))
    ]
    table = table_of(
        numbered,
        Column("", lambda item: f"{item[0]}", True),
        Column(say("action"), lambda item: decimal(item[1].action), True),
        Column(say("kind"), lambda item: _KINDS[item[1].conjugacy.kind]),
        Column(say("start"), lambda item: _start(paths, item[1])),
        prose=say("start"),
    )
    known = Labelled(
        (
            (say("Certified"), _certified(paths)),
            (say("Accuracy"), _accuracy(paths)),
            (say("Search"), Listed(tuple(_search(paths)), between="")),
        )
    )
    written = sections(
        section("", Labelled(ends)),
        section("", table),
        section("", Labelled(tuple(details)) if details else None),
        section("", known),
    )
    return Document(paths.name, "paths of stationary action", title, written)


#: Kind of a path → its words.
_KINDS = {
    "minimum": say("minimum"),
    "saddle": say("saddle"),
    "degenerate": say("degenerate"),
    "undecided": say("undecided"),
}


def _end(paths: Paths, end: End) -> Text:
    pairs = zip(("t", *paths.coordinates), (end.t, *end.q.tolist()), strict=True)
    return Listed(tuple(assigned(name, decimal(value)) for name, value in pairs))


def _start(paths: Paths, path: StationaryPath) -> Text:
    pairs = zip(paths.coordinates, path.velocity.tolist(), strict=True)
    return Listed(tuple(assigned(f"dot({name})", decimal(value)) for name, value in pairs))


def _details(paths: Paths, path: StationaryPath) -> Iterator[Text]:
    """Say what the kind of a path means, where it is not a minimum between the very ends."""
    points = path.conjugacy
    if path.last.q.tolist() != paths.last.q.tolist():
        yield say("ends at {end}", end=_end(paths, path.last))
    if points.index:
        times = tuple(decimal(t, ".6g") for t in points.times[:_MOST_POINTS])
        more = ("...",) if len(points.times) > _MOST_POINTS else ()
        yield say(
            "lowered by {count} of its variations, as many as the points conjugate to the start,"
            " at t = {times}",
            count=points.index,
            times=Listed((*times, *more)),
        )
    if points.kind == "saddle" and points.index is None:
        yield say("the mass matrix is not positive definite: quick variations lower the action")
    if points.kind == "degenerate":
        yield say("the end is conjugate to the start: neighbouring paths end there as well")
    if points.kind == "undecided":
        yield say("its Jacobi fields are not known well enough to count conjugate points")


def _certified(paths: Paths) -> Text:
    reached = max(path.reached for path in paths.solutions)
    return say(
        "from each start {simulate} comes to the end within {reached} of the scales, its own error"
        " included",
        simulate=Typed("simulate"),
        reached=decimal(reached, ".1e"),
    )


def _accuracy(paths: Paths) -> Text:
    return say(
        "{requested} requested, {estimated} estimated",
        requested=decimal(paths.requested, "g"),
        estimated=decimal(paths.estimated, ".1e"),
    )


def _search(paths: Paths) -> Iterator[Text]:
    whole = paths.scan
    yield say("{count} found from {starts} starts", count=len(paths.solutions), starts=paths.starts)
    if paths.deflated:
        yield say(", {count} of them by deflation of the others", count=paths.deflated)
    if whole is None:
        yield say("; there may be others")
    else:
        yield say(
            " and by {count} motions with initial velocities from {least} to {largest}, of energies"
            " up to {energy}; there may be others beyond",
            count=whole.count,
            least=decimal(-whole.reach, ".6g"),
            largest=decimal(whole.reach, ".6g"),
            energy=decimal(whole.energy, ".6g"),
        )
        if not whole.is_resolved:
            yield say(", and where motions part too fast to be told apart")
    if paths.lost:
        yield say("; {count} more came close to paths and could not be certified", count=paths.lost)
    if paths.turnable and not paths.turns:
        yield say(
            "; {option} looks a whole turn of {names} further, too",
            option=Typed("--turns 1"),
            names=Listed(tuple(map(Plain, paths.turnable))),
        )
