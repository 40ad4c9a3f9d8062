"""Progress and budget of a simulation."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from lagrange_cli.errors import StoppedError
from lagrange_cli.stages import announce, is_heard

if TYPE_CHECKING:
    from lagrange_cli.simulate.checkpoint import Keeper

__all__ = ["Watch"]

#: Seconds between two announcements of the time reached.
GLANCE = 0.2

#: Part of the remaining bar that a pass over the samples takes; the rest is
#: for passes that may follow.
PASS = 0.9


class Watch:
    """Called with the fraction done of the present pass, tells the user and minds the budget.

    ``progress`` gets a fraction from 0 to 1 that never falls; ``budget`` is in
    seconds of wall clock (None: without limit). ``reached`` gets the time that the pass has
    reached, of ``span``, which is from where to where; ``stop`` says whether the user has asked
    for an end. ``keeper`` writes the state of the runs now and then, and before an end.
    """

    keeper: Keeper | None = None

    def __init__(
        self,
        progress: Callable[[float], None] | None = None,
        budget: float | None = None,
        *,
        reached: Callable[[float], None] | None = None,
        span: tuple[float, float] = (0.0, 1.0),
        stop: Callable[[], bool] | None = None,
    ) -> None:
        self._progress, self._reached, self._stop = progress, reached, stop
        self._start, self._until = span
        self._deadline = None if budget is None else time.perf_counter() + budget
        self._base, self._share, self._shown = 0.0, 0.1, 0.0
        self._announced = time.perf_counter()

    def next_pass(self) -> None:
        """A further pass over the samples begins."""
        self._base += self._share
        self._share = PASS * (1 - self._base)

    def __call__(self, fraction: float) -> None:
        late = self._deadline is not None and time.perf_counter() > self._deadline
        ends = late or (self._stop is not None and self._stop())
        if self.keeper is not None:
            self.keeper.visit(now=ends)
        if ends:
            raise StoppedError
        self._tell(self._base + self._share * fraction)
        self._announce(fraction)
        if self._reached is not None:
            self._reached(self._start + fraction * (self._until - self._start))

    def done(self) -> None:
        self._tell(1.0)

    def _announce(self, fraction: float) -> None:
        """Say how far the pass is, now and then, where somebody listens."""
        if is_heard() and time.perf_counter() - self._announced > GLANCE:
            self._announced = time.perf_counter()
            announce(f"integrating, t = {self._start + fraction * (self._until - self._start):.6g}")

    def _tell(self, fraction: float) -> None:
        # One call in a thousandth of the whole is enough for any display.
        if self._progress is not None and (fraction >= self._shown + 1e-3 or fraction == 1):
            self._shown = fraction
            self._progress(fraction)
