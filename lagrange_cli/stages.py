"""Stages of long work, announced to listeners, who may ask for an end.

Derivation, compiler and integration announce their stages and know nothing of terminals. The
command line listens while a person waits; without a listener announcements cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from types import CodeType, FunctionType
from typing import Any, TypeVar, cast

_Function = TypeVar("_Function", bound=Callable[..., Any])

#: Code of the functions that are :func:`uninterrupted`.
UNINTERRUPTED: set[CodeType] = set()


def uninterrupted(function: _Function) -> _Function:
    """Let Ctrl-C and SIGTERM wait for the end of a short function.

    An exception in it would leave something that nobody ends, as a process just started.
    """
    UNINTERRUPTED.add(cast(FunctionType, function).__code__)
    return function


def _never() -> bool:
    return False


def _nowhere(stage: str) -> None:
    """Ignore a stage: nobody listens."""


@dataclass(frozen=True)
class Listener:
    """Receiver of announced stages.

    Attributes
    ----------
    hears
        Called with a phrase such as ``certifying``.
    ends
        Returns True if the work is to end.
    """

    hears: Callable[[str], None] = _nowhere
    ends: Callable[[], bool] = _never


_NOBODY = Listener()
_listener: ContextVar[Listener] = ContextVar("listener", default=_NOBODY)


@contextmanager
def heard_by(listener: Listener) -> Iterator[None]:
    """Add a listener to stages, for the time of a block."""
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
    """Announce the stage that begins, or its progress, to all listeners."""
    _listener.get().hears(stage)


def is_heard() -> bool:
    """Say whether anybody listens; if not, phrases need not be made."""
    return _listener.get() is not _NOBODY


def is_to_end() -> bool:
    """Say whether somebody has asked for an end, as with Ctrl-C."""
    return _listener.get().ends()
