"""Compare the events that a scene expects with those of its simulation."""

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
    """An event that a simulation shall have.

    Attributes
    ----------
    name
        Name of the event.
    time
        Simulated time at which it is expected; None for any.
    within
        Largest difference from that time.
    mark
        Place in the scene.
    """

    name: str
    time: float | None
    within: float
    mark: Mark

    def is_met_by(self, event: Event) -> bool:
        """Say whether an event has the name, and is near enough to the time."""
        if event.name != self.name:
            return False
        return self.time is None or abs(event.t - self.time) <= self.within


def missing_events(wanted: Sequence[ExpectedEvent], events: Sequence[Event]) -> Iterator[Problem]:
    """Yield a problem for each wanted event that does not happen after those wanted before it."""
    start = 0
    for want in wanted:
        matching = (k for k in range(start, len(events)) if want.is_met_by(events[k]))
        place = next(matching, None)
        if place is None:
            yield Problem(_message(want, events[start:]), want.mark, _hint(events), rule="events")
        else:
            start = place + 1


def _message(want: ExpectedEvent, remaining: Sequence[Event]) -> str:
    if want.time is None:
        return f"expected {want.name}; it does not happen"
    expected = f"expected {want.name} at t = {want.time!r} within {want.within:g}"
    times = [event.t for event in remaining if event.name == want.name]
    if not times:
        return f"{expected}; it does not happen"
    nearest = min(times, key=lambda t: abs(t - (want.time or 0.0)))
    return f"{expected}, found it at {nearest!r}"


def _hint(events: Sequence[Event]) -> str:
    """List the events of the simulation, in order."""
    if not events:
        return "found no events"
    listed = [f"{event.name} at t = {event.t!r}" for event in events[:_LISTED]]
    more = len(events) - len(listed)
    return "\n".join(["found", *(f"  {x}" for x in listed), *([f"  and {more} more"] * bool(more))])
