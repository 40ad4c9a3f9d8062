"""SIGTERM and SIGHUP end a command; with Ctrl-C they end a run that keeps what is done."""

from __future__ import annotations

import signal
import threading
import time
from _thread import interrupt_main
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.machinery import ExtensionFileLoader
from types import FrameType
from typing import Any

from lagrange_cli.stages import UNINTERRUPTED

#: Seconds after which a signal that had no effect is sent again.
_PAUSE = 0.02


class Terminated(BaseException):
    """The signal ``number`` asked for an end; unwinds the stack, so that temporary files go.

    Code that takes every exception for its own may swallow it, as extension modules do while they
    are imported: the signal is sent again if nobody has ``heard`` of it when it goes.
    """

    def __init__(self, number: int, again: Callable[[], None]) -> None:
        super().__init__(number)
        self.number, self.heard, self._again = number, False, again

    def __del__(self) -> None:
        if not self.heard:
            self._again()
            _send_again(self.number)


def _send_again(number: int) -> None:
    """Send a signal to the main thread after a pause: sent to the process, any thread gets it.

    The main thread would then go on waiting for a compiler, and look at the signal afterwards.
    """
    main = threading.main_thread().ident
    if main is None or not hasattr(signal, "pthread_kill"):
        # Where signals are sent to no thread, os.kill ends the process.
        threading.Timer(_PAUSE, interrupt_main, (number,)).start()
    else:
        threading.Timer(_PAUSE, signal.pthread_kill, (main, number)).start()


@contextmanager
def termination() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into :class:`Terminated` while a command runs."""

    def stop(number: int, frame: FrameType | None) -> None:
        if _is_postponed(number, frame):
            return
        # The two often come together: the second would disturb the tidying up after the first.
        for known in before:
            signal.signal(known, signal.SIG_IGN)
        raise Terminated(number, listen)

    def listen() -> None:
        for known in before:
            signal.signal(known, stop)

    with (
        _handled_signals(_interrupts(), _interrupt),
        _handled_signals(_ending_signals(), stop) as before,
    ):
        try:
            yield
        except Terminated as ended:
            ended.heard = True
            raise


def _interrupts() -> list[signal.Signals]:
    """Return SIGINT if Python turns it into KeyboardInterrupt, else nothing."""
    ours = signal.getsignal(signal.SIGINT) == signal.default_int_handler
    return [signal.SIGINT] if ours else []


def _interrupt(number: int, frame: FrameType | None) -> None:
    """Raise KeyboardInterrupt, unless that is postponed."""
    if not _is_postponed(number, frame):
        signal.default_int_handler(number, frame)


def _is_postponed(number: int, frame: FrameType | None) -> bool:
    """Send a signal again, a little later, while an extension module is imported.

    Such modules take every exception for their own meanwhile. Others pass it on. Functions that
    are ``uninterrupted`` are waited for too.
    """
    while frame is not None:
        is_import = isinstance(frame.f_locals.get("self"), ExtensionFileLoader)
        if is_import or frame.f_code in UNINTERRUPTED:
            _send_again(number)
            return True
        frame = frame.f_back
    return False


def _ending_signals() -> list[signal.Signals]:
    """Return the signals that ask a command to end.

    They are SIGTERM and, unless it is ignored (``nohup``), SIGHUP, of a terminal that is gone.
    """
    numbers = [signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    return numbers


@dataclass
class Interrupts:
    """Holds the signal that asked for an end; ``number`` is None if there was none."""

    number: int | None = None

    @property
    def asked(self) -> bool:
        return self.number is not None

    @property
    def exit_code(self) -> int:
        """Return the exit code that shells report for a process that the signal ended."""
        return 128 + (self.number or 0)


@contextmanager
def _handled_signals(
    numbers: Iterable[int], handler: Callable[[int, FrameType | None], None]
) -> Iterator[Mapping[int, Any]]:
    """Let a function handle signals meanwhile; yield number → the handler that it stands in for."""
    before = {number: signal.getsignal(number) for number in numbers}
    try:
        for number in before:
            signal.signal(number, handler)
        yield before
    finally:
        for number, known in before.items():
            signal.signal(number, known)


@contextmanager
def noted_interrupts() -> Iterator[Interrupts]:
    """Note the first signal, which the work then looks for; a second one acts at once."""
    interrupts = Interrupts()

    def note(number: int, frame: FrameType | None) -> None:
        interrupts.number = number
        for known, handler in before.items():
            signal.signal(known, handler)

    with _handled_signals((signal.SIGINT, *_ending_signals()), note) as before:
        yield interrupts


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
    left = interval = 0.0
    try:
        # The alarm may ring as it is set.
        left, interval = signal.setitimer(signal.ITIMER_REAL, seconds)
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
