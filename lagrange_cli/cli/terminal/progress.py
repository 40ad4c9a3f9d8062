"""Progress of an integration, for a person who waits."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

#: Seconds between two updates of the simulated time on a terminal; set by hand.
_REDRAWN_AFTER = 0.2

#: Seconds between two lines elsewhere; set by hand.
_LINE_AFTER = 10.0


class ProgressBar:
    """A bar that is moved by calls with the fraction done, and shows the simulated time.

    Parameters
    ----------
    bar
        Click's progress bar, of length 1000; None if none is shown.
    line
        Writes a line now and then in place of the bar; None if there is a bar, or nothing.
    """

    def __init__(self, bar: Any | None, line: Callable[[str], None] | None = None) -> None:
        self._bar, self._line = bar, line
        self._done = 0.0
        self._shown = self._begun = time.monotonic()
        self._first: float | None = None
        self._last = 0.0

    def __call__(self, fraction: float) -> None:
        self._done = fraction
        if self._bar is not None:
            self._bar.update(round(1000 * fraction) - self._bar.pos)

    def says(self, stage: str) -> None:
        """Show a stage of the work, if there is a bar."""
        if self._bar is not None:
            self._bar.current_item = stage
            self._bar.render_progress()

    def reached(self, t: float) -> None:
        """Show the simulated time and its rate; a time that falls begins another pass."""
        now = time.monotonic()
        if self._first is None or t < self._last:
            self._first, self._begun = t, now
        self._last = t
        if now - self._shown < (_REDRAWN_AFTER if self._line is None else _LINE_AFTER):
            return
        self._shown = now
        rate = (t - self._first) / max(now - self._begun, 1e-9)
        text = f"t = {t:.6g}" + (f", {rate:.3g} a second" if rate > 0 else "")
        if self._line is not None:
            self._line(f"{text}, {100 * self._done:.0f} % done")
        elif self._bar is not None:
            self._bar.current_item = text
            self._bar.render_progress()
