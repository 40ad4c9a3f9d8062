"""Report of ``lagrange path``: the paths of stationary action that were found."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.notation.page import Page, Row, page
from lagrange_cli.report.tables import TableColumn, json_text, labelled, sentence_row, table
from lagrange_cli.report.values.studies import PATHS

if TYPE_CHECKING:
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.measure import StationaryPath
    from lagrange_cli.studies.path.result import Paths

_PATHS = (
    TableColumn("", 3, ">"),
    TableColumn("action", 16, ">"),
    TableColumn("kind", 10),
    TableColumn("start"),
)

#: Conjugate points of a path that the text lists.
_MOST_POINTS = 8


def _text(paths: Paths) -> Page:
    """Write the paths and how they were found, for a person."""
    number = len(paths.solutions)
    heading = f"{paths.name}: {number} path{'s' * (number > 1)} of stationary action"
    rows = [_row(paths, k, solution) for k, solution in enumerate(paths.solutions, 1)]
    return page(
        [
            [
                sentence_row(heading, "heading"),
                *labelled(
                    ("  from", _end(paths, paths.first)), ("  to", _end(paths, paths.last)), width=6
                ),
            ],
            table(_PATHS, rows),
            [row for k, path in enumerate(paths.solutions, 1) for row in _details(paths, k, path)],
            labelled(
                ("Certified", _certified(paths)),
                ("Accuracy", f"{paths.requested:g} requested, {paths.estimated:.1e} estimated"),
                ("Search", "".join(_search(paths))),
            ),
        ]
    )


def _end(paths: Paths, end: End) -> str:
    pairs = zip(("t", *paths.coordinates), (end.t, *end.q.tolist()), strict=True)
    return ", ".join(f"{name} = {value:.9g}" for name, value in pairs)


def _row(paths: Paths, number: int, path: StationaryPath) -> list[str]:
    pairs = zip(paths.coordinates, path.velocity.tolist(), strict=True)
    start = ", ".join(f"dot({name}) = {value:.9g}" for name, value in pairs)
    return [f"{number}", f"{path.action:.9g}", path.conjugacy.kind, start]


def _details(paths: Paths, number: int, path: StationaryPath) -> Iterator[Row]:
    """Say what the kind of a path means, where it is not a minimum between the very ends."""
    points = path.conjugacy
    times = ", ".join(f"{t:.6g}" for t in points.times[:_MOST_POINTS])
    more = ", ..." if len(points.times) > _MOST_POINTS else ""
    said = []
    if path.last.q.tolist() != paths.last.q.tolist():
        said.append(f"ends at {_end(paths, path.last)}")
    if points.index:
        said.append(
            f"lowered by {points.index} of its variations, as many as the points conjugate to the"
            f" start, at t = {times}{more}"
        )
    if points.kind == "saddle" and points.index is None:
        said.append("the mass matrix is not positive definite: quick variations lower the action")
    if points.kind == "degenerate":
        said.append("the end is conjugate to the start: neighbouring paths end there as well")
    if points.kind == "undecided":
        said.append("its Jacobi fields are not known well enough to count conjugate points")
    if said:
        yield from labelled((f"  {number}", "; ".join(said)), width=3)


def _certified(paths: Paths) -> str:
    reached = max(path.reached for path in paths.solutions)
    return (
        "from each start simulate comes to the end within"
        f" {reached:.1e} of the scales, its own error included"
    )


def _search(paths: Paths) -> Iterator[str]:
    whole = paths.scan
    yield f"{len(paths.solutions)} found from {paths.starts} starts"
    if paths.deflated:
        yield f", {paths.deflated} of them by deflation of the others"
    if whole is None:
        yield "; there may be others"
    else:
        yield (
            f" and by {whole.count} motions with initial velocities from {-whole.reach:.6g} to"
            f" {whole.reach:.6g}, of energies up to {whole.energy:.6g}; there may be others beyond"
        )
        if not whole.is_resolved:
            yield ", and where motions part too fast to be told apart"
    if paths.lost:
        yield f"; {paths.lost} more came close to paths and could not be certified"
    if paths.turnable and not paths.turns:
        names = ", ".join(paths.turnable)
        yield f"; --turns 1 looks a whole turn of {names} further, too"


#: Name of a format → what writes it.
FORMATS: Mapping[str, Callable[[Paths], str | Page]] = {
    "text": _text,
    "json": lambda paths: json_text(PATHS.write(paths)),
}
