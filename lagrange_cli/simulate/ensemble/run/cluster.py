"""Blocks of an ensemble on a Dask cluster: workers write them, into a folder that all share.

The plan, the members and the contents of recorded inputs travel once; a task is the number of a
block. While the run lasts a file of a random name lies in the folder of the blocks. Workers that do
not see it are refused, and none keeps a block once it is gone: a task that outlives its run writes
into no other run's folder. That is asked when a block lies beside it under another name: where the
folder is replaced afterwards, there is no such name in the new one.
"""

from __future__ import annotations

import os
import secrets
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace

from lagrange_cli.errors import InputError
from lagrange_cli.files import (
    CarriedFile,
    FileColumn,
    cannot_write,
    carried_files,
    is_address,
    reading_carried,
    temporary_file,
)
from lagrange_cli.simulate.cluster.tasks import Cluster
from lagrange_cli.simulate.cluster.workers import ClusterError, exists, refusal
from lagrange_cli.simulate.ensemble.plan.plan import Blocks
from lagrange_cli.simulate.ensemble.run.run import compile_ahead, run_block
from lagrange_cli.simulate.ensemble.store.blocks import FinishedBlock
from lagrange_cli.simulate.ensemble.store.store import BlockWriter, Store

#: Seconds between two looks at whether the run still lasts.
_GLANCE = 1.0


@dataclass(frozen=True)
class _Running:
    """Refuses to go on with a run that has ended, or whose blocks were removed.

    Attributes
    ----------
    watched
        A file that lies beside the blocks while the run lasts; None if they stay in memory.
    """

    watched: str | None

    def __call__(self) -> None:
        if self.watched is not None and not exists(self.watched):
            folder = os.path.dirname(self.watched)
            raise refusal(f"'{folder}' is not the folder any more that the run began with")


@dataclass(frozen=True)
class _BlockWork:
    """Runs blocks by their numbers and keeps them, on a worker.

    Attributes
    ----------
    blocks
        All blocks of the ensemble.
    writer
        Keeps each.
    files
        Contents of recorded inputs.
    running
        Refuses once the run has ended.
    """

    blocks: Blocks
    writer: BlockWriter
    files: Mapping[FileColumn, CarriedFile]
    running: _Running

    def prepare(self) -> None:
        with reading_carried(self.files):
            compile_ahead(self.blocks.plan)

    def __call__(self, number: int) -> FinishedBlock | None:
        with reading_carried(self.files):
            block = run_block(self.blocks.task(number), _Throttled(self.running))
        return None if block is None else self.writer(block)


class _Throttled:
    """Calls a function, but not more often than every second."""

    def __init__(self, function: Callable[[], None]) -> None:
        self._function, self._last = function, time.monotonic()

    def __call__(self) -> None:
        if time.monotonic() - self._last > _GLANCE:
            self._function()
            self._last = time.monotonic()


@dataclass(frozen=True)
class ClusterEngine:
    """Runs blocks on the workers of a cluster.

    Attributes
    ----------
    cluster
        These workers.
    budget
        Seconds after which no further block is waited for.
    """

    cluster: Cluster
    budget: float | None = None

    def __call__(
        self, blocks: Blocks, numbers: Iterable[int], store: Store
    ) -> Generator[FinishedBlock | None, None, None]:
        """Yield the blocks of some numbers as they are stored.

        Raises
        ------
        ClusterError
            Workers are unlike this process, do not see the folder of the blocks, or were lost with
            their scheduler. Finished blocks stay in the store.
        InputError
            A worker cannot write a block.
        """
        files = carried_files(blocks.plan.model.recordings)
        sent = replace(blocks, members=blocks.members.without_places())
        with _watched(store.place) as watched:
            try:
                self.cluster.admit(watched)
            except ClusterError:
                if not store.finished:
                    store.give_up()
                raise
            running = _Running(watched)
            work = _BlockWork(sent, store.far_writer(running), files, running)
            with _hinted(store.place):
                yield from self.cluster.in_any_order(work, numbers, watched, budget=self.budget)


@contextmanager
def _hinted(place: str | None) -> Iterator[None]:
    """Add to a refusal during the run the hint how it goes on."""
    try:
        yield
    except InputError as error:
        *others, last = error.problems
        if place is None:
            raise
        further = "what is finished is kept: --resume goes on, here or on another cluster"
        hint = "\n".join(filter(None, (last.hint, further)))
        raise ClusterError(*others, replace(last, hint=hint)) from error


@contextmanager
def _watched(place: str | None) -> Iterator[str | None]:
    """Keep a file in a folder, or below an address, for a while; yield its path."""
    if place is None:
        yield None
    elif is_address(place):
        with _far_file(f"{place.rstrip('/')}/.lagrange-{secrets.token_hex(16)}.tmp") as path:
            yield path
    else:
        with ExitStack() as stack:
            try:
                made = stack.enter_context(temporary_file(place))
            except OSError as error:
                raise cannot_write(f"into '{place}'", error) from error
            yield made.path


@contextmanager
def _far_file(address: str) -> Iterator[str]:
    """Keep an empty file at an address for a while."""
    import fsspec

    files, path = fsspec.core.url_to_fs(address)
    try:
        files.touch(path)
    except OSError as error:
        raise cannot_write(f"'{address}'", error) from error
    try:
        yield address
    finally:
        with suppress(Exception):
            files.rm_file(path)
