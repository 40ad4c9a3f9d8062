"""Stages of long work, told to listeners, who may ask for an end.

Derivation, compiler and integration tell their stage and know nothing of terminals. The command
line listens while a person waits; else nobody does, and it costs nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


def _never() -> bool:
    return False


def _nowhere(stage: str) -> None:
    """Nobody listens."""


@dataclass(frozen=True)
class Listener:
    """One who is told of stages.

    Attributes
    ----------
    hears
        Takes a phrase such as ``certifying``.
    ends
        Says whether the work is to end.
    """

    hears: Callable[[str], None] = _nowhere
    ends: Callable[[], bool] = _never


_NOBODY = Listener()
_listener: ContextVar[Listener] = ContextVar("listener", default=_NOBODY)


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Let a listener hear of stages, beside those that listen already."""
    before = _listener.get()

    def hears(stage: str) -> None:
        before.hears(stage)
        listener.hears(stage)

    def ends() -> bool:
        return before.ends() or listener.ends()

    token = _listener.set(Listener(hears, ends))
    try:
        yield
    finally:
        _listener.reset(token)


def announce(stage: str) -> None:
    """Tell listeners the stage that begins, or how far it is."""
    _listener.get().hears(stage)


def is_heard() -> bool:
    """Say whether anybody listens: a phrase that takes time to make need not be made otherwise."""
    return _listener.get() is not _NOBODY


def is_to_end() -> bool:
    """Say whether somebody has asked for an end, as with Ctrl-C."""
    return _listener.get().ends()
