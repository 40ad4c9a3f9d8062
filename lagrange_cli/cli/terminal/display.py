"""Show the stage of long work in one line on a terminal, while it lasts."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TextIO

from lagrange_cli.errors import escape_controls

#: Seconds of work after which a line is shown; set by hand.
SHOWN_AFTER = 1.0

#: Seconds after which it is drawn again; set by hand.
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
