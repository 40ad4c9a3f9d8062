"""Connect to a scheduler of the user's."""

from __future__ import annotations

import importlib
import logging
import threading
import warnings
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from typing import TYPE_CHECKING

from lagrange_cli.errors import Problem
from lagrange_cli.simulate.cluster.refusals import EXTRA, ClusterError, refusal

if TYPE_CHECKING:
    from distributed import Client

#: Seconds until a scheduler that does not answer is refused.
_PATIENCE = 5.0

#: Seconds beyond that, in which Dask itself gives up where it can.
_MARGIN = 0.5

#: Seconds that are left to a connection to be closed.
_FAREWELL = 2.0


@contextmanager
def connected(address: str, patience: float = _PATIENCE) -> Iterator[Client]:
    """Connect to a scheduler for a while, if it answers within ``patience`` seconds.

    Raises
    ------
    ClusterError
        There is none at this address, or Dask is not installed.
    """
    if find_spec("distributed") is None:
        raise ClusterError(
            Problem("a cluster needs dask and distributed", hint=EXTRA, rule="missing-extra")
        )
    importlib.import_module("distributed")  # which makes its loggers
    _silence()
    try:
        with warnings.catch_warnings():
            # Versions that differ are refused later, by name.
            warnings.simplefilter("ignore")
            client = _client(address, patience)
    except Exception as error:
        hint = "'dask scheduler' starts one and says its address; --on local runs here"
        reason = str(error).strip().splitlines()[:1] or [f"no answer after {patience:g} s"]
        raise refusal(f"no Dask scheduler answers at {address}: {reason[0]}", hint) from None
    try:
        yield client
    finally:
        with suppress(Exception):
            client.close(timeout=_FAREWELL)


def _client(address: str, patience: float) -> Client:
    """Connect, in a thread of its own: Dask waits for ever for servers that are no schedulers.

    Raises
    ------
    OSError
        Nothing answers, or not in time.
    """
    from distributed import Client

    made: Future[Client] = Future()

    def connect() -> None:
        try:
            made.set_result(
                Client(address, timeout=patience, set_as_default=False, name="lagrange")
            )
        except BaseException as error:
            made.set_exception(error)

    threading.Thread(target=connect, daemon=True).start()
    return made.result(timeout=patience + _MARGIN)


def _silence() -> None:
    """Let nothing but this program speak of lost connections."""
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] == "distributed":
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
