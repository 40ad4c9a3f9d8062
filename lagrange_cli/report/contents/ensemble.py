"""Report of ``lagrange simulate`` for an ensemble: the outcomes of its members."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from lagrange_cli.report.contents.numbers import assigned, decimal
from lagrange_cli.report.inlines import Listed, Plain, Text, Typed, say
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tree import Document, Labelled, Section, section, sections
from lagrange_cli.report.values.simulation import ENSEMBLE, SimulatedMembers
from lagrange_cli.simulate.ensemble.store.blocks import NumberRange
from lagrange_cli.simulate.ensemble.store.result import Ensemble

#: Failures that the report lists.
_MOST_SHOWN = 12

json_of.register(SimulatedMembers, ENSEMBLE.write)


@contents_of.register
def ensemble_document(simulated: SimulatedMembers) -> Document:
    """Return counts of outcomes, the ranges of numbers of motions, and members that failed."""
    counts = simulated.counts()
    rate = sum(counts.values()) / max(simulated.seconds["integrate"], 1e-9)
    return _document(
        simulated.plan.model.name,
        len(simulated.members),
        counts,
        (
            *_accuracy(simulated.store.estimated()),
            (say("Speed"), say("{rate} members a second", rate=decimal(rate, ".3g"))),
        ),
        simulated.reduced(),
        simulated.failed(_MOST_SHOWN),
    )


@contents_of.register
def members_document(ensemble: Ensemble) -> Document:
    """Return the same of the arrays alone."""
    figures, failed = ensemble.figures, np.flatnonzero(np.array(ensemble.status) != "ok")
    errors = figures["estimated"][np.isfinite(figures["estimated"])]
    reduced = {
        name: (NumberRange.of_values(numbers), float(ensemble.reduced_error[name].max(initial=0)))
        for name, numbers in ensemble.reduced.items()
    }
    members = [
        {
            "member": int(k),
            "values": {name: f"{values[k]:.9g}" for name, values in ensemble.given.items()},
            **{name: str(figures[name][k]) for name in ("status", "reason")},
        }
        for k in failed[:_MOST_SHOWN]
    ]
    return _document(
        ensemble.name,
        len(ensemble),
        dict(sorted(Counter(ensemble.status).items())),
        tuple(_accuracy(float(errors.max()) if len(errors) else None)),
        reduced,
        members,
    )


def _document(
    name: str,
    number: int,
    counts: Mapping[str, int],
    known: tuple[tuple[Text, Text], ...],
    reduced: Mapping[str, tuple[NumberRange, float]],
    failed: Sequence[Mapping[str, Any]],
) -> Document:
    """Return the report of a number of members.

    Parameters
    ----------
    counts
        Status → number of members.
    known
        What is known of all of them.
    reduced
        Number of motions → its range, and its largest error.
    failed
        The first members that are not ``ok``.
    """
    finished = sum(counts.values())
    title = say(
        "{name}: {finished} of {number} members", name=Plain(name), finished=finished, number=number
    )
    listed = Listed(
        tuple(Listed((f"{n}", Plain(status)), between=" ") for status, n in counts.items())
    )
    written = sections(
        section("", Labelled(((say("Status"), listed or say("none is finished")), *known))),
        _reduced(reduced, finished),
        _failures(failed, finished - counts.get("ok", 0)),
    )
    return Document(name, "an ensemble", title, written)


def _accuracy(estimated: float | None) -> Iterator[tuple[Text, Text]]:
    if estimated is not None:
        error = decimal(estimated, ".1e")
        yield say("Accuracy"), say("{error} estimated, the largest of all members", error=error)


def _reduced(reduced: Mapping[str, tuple[NumberRange, float]], members: int) -> Section | None:
    """Return the ranges of the numbers of motions; None if there are none."""
    rows = tuple((Plain(name), _range(*known, members)) for name, known in reduced.items())
    return section(say("Reduced"), Labelled(rows)) if rows else None


def _range(extent: NumberRange, error: float, members: int) -> Text:
    if not extent.known:
        is_open = error == math.inf
        return say("open: it is not decided whether there is one") if is_open else say("of none")
    ends = {"least": decimal(extent.least, ".6g"), "largest": decimal(extent.largest, ".6g")}
    if math.isnan(error):
        said = say("from {least} to {largest}", **ends)
    elif error < math.inf:
        digits = decimal(error, ".1g")
        said = say("from {least} to {largest} ± {error}", error=digits, **ends)
    else:
        said = say("from {least} to {largest}, with an error that has no bound", **ends)
    if extent.known < members:
        return say.counted(
            extent.known, "{text}, of {count} member", "{text}, of {count} members", text=said
        )
    return said


def _failures(failed: Sequence[Mapping[str, Any]], number: int) -> Section | None:
    """Return the first of a number of failures; None if there are none."""
    if not failed:
        return None
    left_out = say(
        "and {count} more; {option} lists them all",
        count=number - len(failed),
        option=Typed("--json"),
    )
    rows = tuple((f"{member['member']}", _failure(member)) for member in failed)
    return section(say("Failed"), Labelled(rows), left_out if number > len(failed) else None)


def _failure(member: Mapping[str, Any]) -> Text:
    values = Listed(tuple(assigned(name, Plain(value)) for name, value in member["values"].items()))
    return say(
        "{values}: {status}, {reason}",
        values=values,
        status=Plain(member["status"]),
        reason=Plain(member["reason"]),
    )
