"""Progress, deadline and cancellation of a run, asked after every step."""

from __future__ import annotations

import copy
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace

from lagrange_cli.errors import StoppedError
from lagrange_cli.stages import announce, is_heard

#: Seconds between two announcements of the time reached.
_GLANCE = 0.2

#: Part of the remaining bar that a pass over the samples takes; the rest is
#: for passes that may follow.
_PASS = 0.9


class RunProgress:
    """Tells how far the passes over the samples are.

    Parameters
    ----------
    progress
        Called with a fraction from 0 to 1 that never falls.
    reached
        Called with the simulated time that the present pass has reached.
    span
        First and last simulated time.
    """

    def __init__(
        self,
        progress: Callable[[float], None] | None = None,
        reached: Callable[[float], None] | None = None,
        span: tuple[float, float] = (0.0, 1.0),
    ) -> None:
        self._progress, self._reached = progress, reached
        self._start, self._until = span
        self._base, self._share, self._shown = 0.0, 0.1, 0.0
        self._announced = time.perf_counter()

    def next_pass(self) -> None:
        """Begin a further pass over the samples."""
        self._base += self._share
        self._share = _PASS * (1 - self._base)

    def at(self, fraction: float) -> None:
        """Tell the fraction done of the present pass."""
        self._tell(self._base + self._share * fraction)
        t = self._start + fraction * (self._until - self._start)
        if is_heard() and time.perf_counter() - self._announced > _GLANCE:
            self._announced = time.perf_counter()
            announce(f"integrating, t = {t:.6g}")
        if self._reached is not None:
            self._reached(t)

    def done(self) -> None:
        """Tell that nothing is left to do."""
        self._tell(1.0)

    def _tell(self, fraction: float) -> None:
        # One call in a thousandth of the whole is enough for any display.
        if self._progress is not None and (fraction >= self._shown + 1e-3 or fraction == 1):
            self._shown = fraction
            self._progress(fraction)


@dataclass(frozen=True)
class Deadline:
    """When a budget is spent.

    Attributes
    ----------
    at
        Value of ``time.perf_counter`` in seconds.
    """

    at: float = math.inf

    @classmethod
    def after(cls, budget: float | None) -> Deadline:
        """Set the deadline so many seconds from now; None if there is none."""
        return cls() if budget is None else cls(time.perf_counter() + budget)

    @property
    def passed(self) -> bool:
        return time.perf_counter() > self.at


@dataclass(frozen=True)
class Watch:
    """Called after every step with the fraction done of the present pass.

    Attributes
    ----------
    progress
        Told how far the run is.
    deadline
        The run ends when it has passed.
    stop
        Says whether the user has asked for an end.
    """

    progress: RunProgress = field(default_factory=RunProgress)
    deadline: Deadline = Deadline()
    stop: Callable[[], bool] | None = None

    def __call__(self, fraction: float) -> None:
        """Tell the progress.

        Raises
        ------
        StoppedError
            The run is to end here.
        """
        if self.deadline.passed or (self.stop is not None and self.stop()):
            raise StoppedError
        self.progress.at(fraction)

    def apart(self) -> Watch:
        """Make a watch for runs besides, whose passes do not count."""
        return replace(self, progress=copy.copy(self.progress))
