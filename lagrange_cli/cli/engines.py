"""``--on``: where the work of a command is done, on this machine or on a user's Dask cluster."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lagrange_cli.cli.session import Session
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.api import Cluster

_Command = TypeVar("_Command", bound=Callable[..., Any])

#: Addresses of schedulers.
_SCHEDULER = re.compile(r"(tcp|tls)://[^\s/?#@]{1,255}:[0-9]{1,5}", re.ASCII)


def _scheduler(ctx: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Read the address of a scheduler; None for this machine."""
    if value is None or value == "local":
        return None
    if not _SCHEDULER.fullmatch(value):
        said = f"'{value}' is neither local nor the address of a scheduler, as tcp://HOST:8786"
        raise click.BadParameter(said, ctx, option)
    return value


def on(what: str) -> Callable[[_Command], _Command]:
    """``--on local|tcp://HOST:PORT``."""
    return click.option(
        "--on",
        "scheduler",
        callback=_scheduler,
        metavar="ENGINE",
        help=f"{what} on this machine or on a Dask cluster, tcp://HOST:PORT.  [default: local]",
    )


@contextmanager
def cluster(session: Session, scheduler: str | None, jobs: int | None) -> Iterator[Cluster | None]:
    """Connect to the cluster of ``--on`` for a while; None for this machine.

    Raises
    ------
    InputError
        There is none; or ``--jobs`` is given too, which is of this machine.
    """
    if scheduler is None:
        yield None
        return
    if jobs is not None:
        message = f"--jobs is of this machine, not of the cluster at {scheduler}"
        hint = "its workers say how much is done at a time: dask worker --nworkers"
        raise InputError(Problem(message, hint=hint, rule="cluster"))
    from lagrange_cli.api import cluster_at

    with cluster_at(scheduler, session.remark) as workers:
        yield workers
