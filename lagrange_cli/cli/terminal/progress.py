"""A long command's progress on a terminal: the line with its stage, and a bar."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TextIO

from lagrange_cli.errors import escape_controls

#: Seconds of work after which a line is shown: a shorter wait needs no word.
SHOWN_AFTER = 1.0

#: Seconds after which it is drawn again: often enough to be alive, seldom enough to cost nothing.
REDRAWN_AFTER = 0.5

#: Erases the line that the cursor is in.
ERASE = "\r\x1b[K"


class _Line:
    """The line with the last stage, drawn by a thread, since stages can last long."""

    def __init__(self, terminal: TextIO) -> None:
        self._terminal, self._stage = terminal, ""
        self._begun, self._ended = time.monotonic(), threading.Event()
        self._drawn, self._lock = False, threading.Lock()
        self._thread = threading.Thread(target=self._draw, daemon=True)

    def hears(self, stage: str) -> None:
        """Take a stage; an empty one leaves the terminal to others."""
        with self._lock:
            self._stage = escape_controls(stage)
            if not stage:
                self._erase()

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._ended.set()
        self._thread.join()
        self._erase()

    def _erase(self) -> None:
        if self._drawn:
            self._write(ERASE)
        self._drawn = False

    def _draw(self) -> None:
        wait = SHOWN_AFTER
        while not self._ended.wait(wait):
            wait = REDRAWN_AFTER
            with self._lock:
                if self._stage:
                    self._drawn = True
                    self._write(f"{ERASE}{self._stage}, {time.monotonic() - self._begun:.0f} s")

    def _write(self, text: str) -> None:
        # A terminal that is gone ends the work by a signal, not by an error of this line.
        with suppress(OSError, ValueError):
            self._terminal.write(text)
            self._terminal.flush()


@contextmanager
def shown_stage(terminal: TextIO) -> Iterator[Callable[[str], None]]:
    """Yield a function that takes the present stage; it is shown after a second."""
    line = _Line(terminal)
    line.start()
    try:
        yield line.hears
    finally:
        line.stop()


#: Seconds between two updates of the simulated time on a terminal, as often as an eye follows.
_REDRAWN_AFTER = 0.2

#: Seconds between two lines elsewhere: six lines a minute do not fill a log.
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
