"""Stores of finished blocks, which are kept one by one and joined to an ensemble at the end.

Blocks stay in memory, go into files that become one file (:mod:`.part_files`), or into a store of
many files (:mod:`.zarr_store`). The process that runs a block writes it; its summary comes back.
"""

from __future__ import annotations

import importlib.util
import json
import math
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeAlias

import numpy as np

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.store.blocks import (
    COLUMN,
    TEXTS,
    BlockSummary,
    Failure,
    FinishedBlock,
    MemberBlock,
    NumberRange,
    arrays_of,
    written_name,
)
from lagrange_cli.simulate.ensemble.store.result import Ensemble

#: Name, shape, and parts along the first axis, of an array.
_Entry: TypeAlias = tuple[str, tuple[int, ...], Iterable[Array]]

#: Seconds between readings of metadata that another process is writing.
_PAUSES = 100 * (0.05,)

#: Stores a block in the process that ran it; its summary comes back.
BlockWriter: TypeAlias = Callable[[MemberBlock], FinishedBlock]


def refused(message: str, hint: str = "") -> InputError:
    """Return the refusal to begin, or to go on with, a result."""
    return InputError(Problem(message, hint=hint, rule="resume"))


def require_resumable(
    place: object, note: object, plan_note: object, resume: bool, anew: str
) -> None:
    """Refuse to go on with the blocks of another ensemble, or without ``resume``.

    Parameters
    ----------
    place
        Folder or address of the blocks.
    note, plan_note
        Notes of the run that wrote them and of this one (:attr:`.plan.plan.Blocks.note`).
    anew
        Hint that says how to begin again.

    Raises
    ------
    InputError
        The two runs differ, or it was not asked for.
    """
    if not resume:
        raise refused(
            f"'{place}' has the members that an interrupted run finished",
            f"--resume goes on with the others; {anew}",
        )
    if note != plan_note:
        raise refused(
            f"'{place}' is of another ensemble: the scene, its members, options that matter or"
            " the program have changed",
            anew,
        )


def require_package(package: str, ending: str, install: str) -> None:
    """Refuse a result of an ending if the package that writes it is not installed."""
    if importlib.util.find_spec(package) is None:
        message = f"a result as {ending} needs {package}"
        raise InputError(Problem(message, hint=f"pip install {install}", rule="missing-extra"))


@dataclass
class Store(ABC):
    """Finished blocks by their numbers.

    Attributes
    ----------
    size
        Members of each block but the last.
    finished
        Summary of each finished block.
    """

    size: int
    finished: dict[int, BlockSummary] = field(default_factory=dict)

    @property
    @abstractmethod
    def writer(self) -> BlockWriter:
        """Callable that stores a block; it can be sent to other processes."""

    @property
    def place(self) -> str | None:
        """The folder or address that the writer writes into; None if blocks stay in memory."""
        return None

    def far_writer(self, admit: Callable[[], None]) -> BlockWriter:
        """Return the writer for processes that are in other folders; its paths are absolute.

        Parameters
        ----------
        admit
            Called there before a block is stored; an exception of it keeps the block out.
        """
        return self.writer

    def finish(self, block: FinishedBlock) -> None:
        """Count a block as finished that the writer has stored."""
        self.finished[block.number] = block.summary

    @abstractmethod
    def complete(self, t: Array) -> None:
        """Join all blocks to the result, once they are finished.

        Parameters
        ----------
        t
            Times of the samples.

        Raises
        ------
        InputError
            The result cannot be written.
        """

    @abstractmethod
    def ensemble(self, name: str, t: Array) -> Ensemble:
        """Return the result, once it is complete; arrays in files are read as they are asked for.

        Parameters
        ----------
        name
            Name of the scene.
        t
            Times of the samples.
        """

    def give_up(self) -> None:
        """Remove files that were begun, while no block is finished."""
        # Nothing is begun in memory.
        return

    def counts(self) -> dict[str, int]:
        """Return status → number of members of finished blocks."""
        total = Counter[str]()
        for summary in self.finished.values():
            total.update(summary.counts)
        return dict(sorted(total.items()))

    def failures(self) -> Iterator[Failure]:
        """Yield the members of finished blocks that are not ``ok``, in order."""
        for number in sorted(self.finished):
            yield from self.finished[number].failures

    def estimated(self) -> float | None:
        """Return the largest estimated error, relative to scales; None if there is none."""
        known = [s.estimated for s in self.finished.values() if not math.isnan(s.estimated)]
        return max(known, default=None)

    def ranges(self) -> dict[str, NumberRange]:
        """Return name of a stored number → its range over the members of finished blocks."""
        ranges: dict[str, NumberRange] = {}
        for summary in self.finished.values():
            for name, extent in summary.ranges.items():
                ranges[name] = extent.union(ranges[name]) if name in ranges else extent
        return ranges


class SummaryStore(Store):
    """Summaries alone."""

    @property
    def writer(self) -> BlockWriter:
        return partial(FinishedBlock.of_block, size=self.size)

    def complete(self, t: Array) -> None:
        """Nothing is written."""

    def ensemble(self, name: str, t: Array) -> Ensemble:
        """Return the times: nothing else is stored."""
        return Ensemble(name, {"t": t})


@dataclass
class MemoryStore(Store):
    """Blocks in memory."""

    _blocks: dict[int, MemberBlock] = field(default_factory=dict)

    @property
    def writer(self) -> BlockWriter:
        return partial(FinishedBlock.of_block, size=self.size, with_results=True)

    def finish(self, block: FinishedBlock) -> None:
        super().finish(block)
        assert block.results is not None
        self._blocks[block.number] = block.results

    def complete(self, t: Array) -> None:
        """Nothing is written: :meth:`ensemble` has the result."""

    def ensemble(self, name: str, t: Array) -> Ensemble:
        arrays = {number: arrays_of(block) for number, block in self._blocks.items()}
        whole = JoinedArrays(
            self, lambda number: list(arrays[number]), lambda number, name: arrays[number].get(name)
        )
        return Ensemble(name, {n: np.concatenate(list(p)) for n, _, p in whole.entries(t)})


@dataclass(frozen=True)
class JoinedArrays:
    """Arrays over the members of all finished blocks.

    Attributes
    ----------
    store
        The store of these blocks.
    names
        Number of a block → names of its arrays.
    array
        Number of a block and name → array, None if it has none.
    """

    store: Store
    names: Callable[[int], list[str]]
    array: Callable[[int, str], Array | None]

    def entries(self, t: Array) -> Iterator[_Entry]:
        """Yield one array a name: times, columns, and what members have one value of.

        Each is read from all blocks before the next one.
        """
        numbers = sorted(self.store.finished)
        members = sum(map(self._members, numbers))
        yield "t", t.shape, [t]
        for name in dict.fromkeys(name for k in numbers for name in self.names(k)):
            shape = (members, len(t)) if name.startswith(COLUMN) else (members,)
            yield written_name(name), shape, self._parts(numbers, name, shape[1:])

    def _members(self, number: int) -> int:
        return sum(self.store.finished[number].counts.values())

    def _parts(
        self, numbers: Sequence[int], name: str, trailing: tuple[int, ...]
    ) -> Iterator[Array]:
        """Yield an array of each finished block, NaN in one that has none."""
        width = max(self._width(number, name) for number in numbers) if name in TEXTS else 0
        for number in numbers:
            part = self.array(number, name)
            if part is None:
                part = np.full((self._members(number), *trailing), np.nan)
            yield part.astype(f"<U{width}") if width else part

    def _width(self, number: int, name: str) -> int:
        """Return the length of the longest text of a finished block."""
        part = self.array(number, name)
        return 1 if part is None else max(1, part.dtype.itemsize // 4)


def settled(read: Callable[[], Any]) -> Any:
    """Read metadata in JSON, again while another process has written a part of them.

    Not every file system has files at once with their content.
    """
    for pause in _PAUSES:
        with suppress(json.JSONDecodeError):
            return read()
        time.sleep(pause)
    return read()
