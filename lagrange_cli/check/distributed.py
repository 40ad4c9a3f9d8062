"""Check scenes on a user's Dask cluster: they travel as text, with the files that they name."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from lagrange_cli.check.model import SceneReport
from lagrange_cli.check.walk import name_of
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import (
    CarriedFile,
    Recording,
    carried_files,
    read_bytes,
    reading_carried,
)
from lagrange_cli.scene import read_text

if TYPE_CHECKING:
    from lagrange_cli.simulate.cluster.tasks import Cluster

#: Threads of a worker check in turn: most of that is Python's.
_one_by_one = threading.Lock()


class _Check(Protocol):
    """Checks the text of the scene at a path."""

    def __call__(self, path: str, data: bytes, /) -> SceneReport: ...


@dataclass(frozen=True)
class _SceneTask:
    """A scene that was read here.

    Attributes
    ----------
    path
        The scene as it was named.
    data
        Its text.
    files
        Contents of the recorded inputs that it names.
    """

    path: str
    data: bytes
    files: Mapping[Recording, CarriedFile]


@dataclass(frozen=True)
class _CheckWork:
    """Checks scenes on a worker.

    Attributes
    ----------
    check
        Checks one of them.
    """

    check: _Check

    def prepare(self) -> None:
        """Nothing is compiled for all scenes."""

    def __call__(self, task: _SceneTask) -> SceneReport:
        with _one_by_one, reading_carried(task.files):
            return self.check(task.path, task.data)


def on_cluster(
    cluster: Cluster, paths: Sequence[str], parameters: Mapping[str, str] | None, check: _Check
) -> Iterator[SceneReport]:
    """Yield the report of each scene as it is ready.

    Parameters
    ----------
    paths
        The scenes, each once; read here.
    parameters
        Values that replace those of the scenes.
    check
        Checks a scene with these values, there.

    Raises
    ------
    ClusterError
        The cluster cannot be used, or was lost.
    """
    cluster.admit()
    unread: list[SceneReport] = []
    tasks = _tasks(paths, parameters, unread.append)
    yield from cluster.in_any_order(_CheckWork(check), tasks, killed=_died)
    yield from unread


def _tasks(
    paths: Sequence[str],
    parameters: Mapping[str, str] | None,
    refuse: Callable[[SceneReport], None],
) -> Iterator[_SceneTask]:
    """Read scenes one after the other; report those that cannot be read."""
    for path in paths:
        try:
            data = read_bytes(path)
        except InputError as error:
            refuse(SceneReport(path, "invalid", 0.0, error.problems))
            continue
        yield _SceneTask(path, data, carried_files(_recordings(path, data, parameters)))


def _recordings(path: str, data: bytes, parameters: Mapping[str, str] | None) -> list[Recording]:
    """Return the recorded inputs of a scene; none of one that cannot be read."""
    try:
        scene = read_text(data, name_of(path), parameters=parameters)
    except InputError:
        return []
    return [entry.recording for entry in scene.inputs if entry.recording is not None]


def _died(task: _SceneTask) -> SceneReport:
    problem = Problem("each worker that checked this scene ended", rule="crash")
    return SceneReport(task.path, "crash", 0.0, (problem,))
