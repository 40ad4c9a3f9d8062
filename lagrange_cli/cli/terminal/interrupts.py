"""Ctrl-C, SIGTERM and SIGHUP during work that keeps what is done."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType


def ending_signals() -> list[signal.Signals]:
    """The signals that ask a command to end: SIGTERM, and where it is not ignored (``nohup``)
    SIGHUP, of a terminal that is gone."""
    numbers = [signal.SIGTERM]
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:
        numbers.append(signal.SIGHUP)
    return numbers


@dataclass
class Interrupts:
    """The signal that asks for an end, None where there was none."""

    number: int | None = None

    @property
    def asked(self) -> bool:
        return self.number is not None

    @property
    def exit_code(self) -> int:
        """As shells report what a signal ended."""
        return 128 + (self.number or 0)


@contextmanager
def noted_interrupts() -> Iterator[Interrupts]:
    """Note the first signal, which the work then looks for; a second one acts at once."""
    found = Interrupts()
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, *ending_signals())}

    def note(number: int, frame: FrameType | None) -> None:
        found.number = number
        for known, handler in before.items():
            signal.signal(known, handler)

    try:
        for number in before:
            signal.signal(number, note)
        yield found
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
