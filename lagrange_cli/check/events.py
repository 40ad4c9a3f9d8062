"""Events that a scene expects beside those that a simulation found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.errors import Mark, Problem

if TYPE_CHECKING:
    from lagrange_cli.simulate.results.trajectory import Event

#: Events that a message lists.
_LISTED = 8


@dataclass(frozen=True)
class ExpectedEvent:
    """An event by name, at a ``time`` to be met ``within`` a bound (None: at any time)."""

    name: str
    time: float | None
    within: float
    mark: Mark

    def is_met_by(self, event: Event) -> bool:
        """Say whether an event is the one that is wanted."""
        if event.name != self.name:
            return False
        return self.time is None or abs(event.t - self.time) <= self.within


def missing_events(wanted: Sequence[ExpectedEvent], found: Sequence[Event]) -> Iterator[Problem]:
    """A problem for each wanted event that is not found after those wanted before it."""
    start = 0
    for want in wanted:
        matching = (k for k in range(start, len(found)) if want.is_met_by(found[k]))
        place = next(matching, None)
        if place is None:
            yield Problem(_message(want, found[start:]), want.mark, _hint(found), rule="events")
        else:
            start = place + 1


def _message(want: ExpectedEvent, left: Sequence[Event]) -> str:
    if want.time is None:
        return f"expected {want.name}; it does not happen"
    expected = f"expected {want.name} at t = {want.time!r} within {want.within:g}"
    times = [event.t for event in left if event.name == want.name]
    if not times:
        return f"{expected}; it does not happen"
    nearest = min(times, key=lambda t: abs(t - (want.time or 0.0)))
    return f"{expected}, found it at {nearest!r}"


def _hint(found: Sequence[Event]) -> str:
    """The events that there are, in order."""
    if not found:
        return "found no events"
    listed = [f"{event.name} at t = {event.t!r}" for event in found[:_LISTED]]
    more = len(found) - len(listed)
    return "\n".join(["found", *(f"  {x}" for x in listed), *([f"  and {more} more"] * bool(more))])
