"""Runs whose samples pass through files, window by window."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import count

import numpy as np

from lagrange_cli.files import whole_file
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.results.columns import Sampled
from lagrange_cli.simulate.results.decimation import Decimator
from lagrange_cli.simulate.results.formats import format_of
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.samples import (
    FileBuffer,
    RowSequence,
    SampleBuffer,
    buffer_folder,
    require_disk_space,
    unnamed_file,
    windows,
)

#: Numbers of the states of a run that memory is to hold.
_IN_MEMORY = 2**19

#: Runs that are compared to measure an error.
_COMPARED = 3

#: Samples that a trajectory has of those that are in a file.
_FEW = 1001


@dataclass(frozen=True)
class Stream:
    """Destination of samples that are more than memory should hold.

    Attributes
    ----------
    output
        File that all of them are written to; None if none is.
    extra
        Columns in it beside those of the state.
    drawn
        Columns that a picture is to show beside the energy; None if there is to be none.
    in_memory
        Numbers of states that are kept in memory at most.
    """

    output: str | None = None
    extra: tuple[str, ...] = ()
    drawn: tuple[str, ...] | None = None
    in_memory: int = _IN_MEMORY


@contextmanager
def buffers(
    stream: Stream, model: Model, request: Request, checkpoint: Checkpoint | None
) -> Iterator[Callable[[], SampleBuffer]]:
    """Give a maker of buffers on a disk, one for the samples of each run.

    The disk is that of the result; with a checkpoint files lie beside it, and stay.

    Raises
    ------
    InputError
        The disk has not that much space.
    """
    width = model.layout.size
    columns = 0 if stream.output is None else 1 + width + 2 * len(model.cartesian)
    folder = buffer_folder(stream.output if checkpoint is None else checkpoint.path)
    if checkpoint is None or not checkpoint.resume:
        runs = 1 if request.accuracy is None else _COMPARED
        require_disk_space(folder, len(request.times), runs * width + columns)
    names = count()
    with ExitStack() as files:

        def buffer() -> SampleBuffer:
            file = unnamed_file(folder) if checkpoint is None else checkpoint.samples(next(names))
            return FileBuffer(files.enter_context(file), width)

        yield buffer


def shown_samples(times: RowSequence, states: RowSequence) -> tuple[Array, Array]:
    """Choose the samples that a trajectory has: all in memory, or some of those in a file."""
    if isinstance(states, np.ndarray):
        return times[: len(states)], states
    numbers = np.unique(np.linspace(0, len(states) - 1, _FEW).round()).astype(int).tolist()
    return np.array([times[k] for k in numbers]), np.array([states[k] for k in numbers])


def written_in_windows(
    stream: Stream,
    trajectory: Trajectory,
    times: RowSequence,
    states: RowSequence,
    sampled: Callable[[Array, Array], Sampled],
) -> Trajectory:
    """Write all samples of a trajectory to its destination, window by window.

    Parameters
    ----------
    times, states
        Of all samples.
    sampled
        Gives the columns of some of them.

    Raises
    ------
    InputError
        The file cannot be written, or the columns are not there.
    """
    if stream.output is None and stream.drawn is None:
        return trajectory
    ends = float(times[0]), float(times[len(times) - 1])
    decimator = Decimator(*ends, len(states), stream.drawn or ())
    with ExitStack() as files:
        add = None
        if stream.output is not None:
            form, folder = format_of(stream.output), buffer_folder(stream.output)
            file = files.enter_context(whole_file(stream.output))
            add = files.enter_context(form(file, len(states), folder))
        for part in windows(times, states):
            columns = sampled(*part)
            decimator.add(columns)
            if add is not None:
                add(replace(trajectory, **vars(columns)).table(stream.extra))
    return replace(trajectory, written=stream.output, decimated=decimator.result())
