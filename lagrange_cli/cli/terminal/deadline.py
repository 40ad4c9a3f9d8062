"""End work that does not look at a clock after some seconds of wall clock."""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

#: Fewest seconds that alarms can be set to.
_LEAST = 1e-6

#: Most seconds that alarms are set to: three years.
_MOST = 1e8


class OverdueError(Exception):
    """The seconds are over."""


class _Overdue(BaseException):
    """Raised wherever the work stands; no handler of errors takes it for one."""


@contextmanager
def within(seconds: float | None) -> Iterator[None]:
    """Give up the work done here after so many seconds; None for never.

    Another alarm that was set goes on afterwards. In threads, and on systems without alarms,
    nothing is given up.

    Raises
    ------
    OverdueError
        The seconds are over.
    """
    main = threading.current_thread() is threading.main_thread()
    if seconds is None or not hasattr(signal, "setitimer") or not main:
        yield
        return
    seconds = min(max(seconds, _LEAST), _MOST)
    started = time.monotonic()
    handler = signal.signal(signal.SIGALRM, _overdue)
    left, interval = signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    except _Overdue:
        raise OverdueError from None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, handler)
        if left:
            remaining = left - (time.monotonic() - started)
            signal.setitimer(signal.ITIMER_REAL, max(remaining, _LEAST), interval)


def _overdue(number: int, frame: FrameType | None) -> None:
    raise _Overdue
