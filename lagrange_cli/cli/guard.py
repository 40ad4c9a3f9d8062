"""No output of a command takes the place of a file that the command reads."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.api.workspace import Workspace
from lagrange_cli.errors import InputError
from lagrange_cli.files import Named, require_apart, same_file

if TYPE_CHECKING:
    from lagrange_cli.api.formats import Emitter


def guard(
    scene: RememberedScene,
    outputs: Mapping[str, str | None],
    table: Mapping[str, str | None] | None = None,
) -> None:
    """Refuse outputs that would replace what a command reads of a scene, or each other.

    Parameters
    ----------
    outputs
        Option → file, None if it is not given.
    table
        What it is → a file that is read beside the scene, None if there is none.

    Raises
    ------
    InputError
        Two files are one; or, if there is any output, the scene cannot be read.
    """
    if writes := _given(outputs):
        require_apart([*_read_by(scene), *_given(table or {})], writes)


def _given(files: Mapping[str, str | None]) -> list[Named]:
    return [Named(name, path) for name, path in files.items() if path is not None]


def _read_by(scene: RememberedScene) -> list[Named]:
    """The scene and the files that it names."""
    return [Named("the scene", scene.source.path), *_recordings(scene)]


def _recordings(scene: RememberedScene) -> list[Named]:
    """The files of recorded inputs."""
    return [Named("a recorded input", path) for path in scene.recorded_files()]


def checkpoint_files(path: str | None) -> dict[str, str]:
    """Return the files that a run with a checkpoint writes beside its results: option → file."""
    if not path:
        return {}
    import glob

    samples = glob.glob(f"{glob.escape(path)}.samples*")
    named = {f"--checkpoint ({os.path.basename(file)})": file for file in samples}
    return {"--checkpoint": path, **named}


def guard_folder(folder: str, scene: RememberedScene, format_: Emitter) -> None:
    """Refuse files that a format would write into a folder in place of what it reads.

    Raises
    ------
    InputError
        One of them would replace the scene, or a file that it names.
    """
    reads = _read_by(scene)
    for path in _files(folder, format_.extensions):
        read = [named for named in reads if same_file(path, named.path)]
        if read and os.path.basename(path) in format_.files(scene.loaded().scene.name):
            require_apart(read, [Named("-o", path)])


def _files(folder: str, endings: tuple[str, ...]) -> list[str]:
    try:
        with os.scandir(folder) as entries:
            return [entry.path for entry in entries if entry.name.endswith(endings)]
    except OSError:
        return []


def guard_scenes(
    paths: Sequence[str], parameters: Mapping[str, str], outputs: Mapping[str, str | None]
) -> None:
    """Refuse outputs of a command on many scenes, some of which may not be readable.

    Raises
    ------
    InputError
        An output would replace what is read, or another output.
    """
    if not (writes := _given(outputs)):
        return
    reads = [Named("a scene", path) for path in paths]
    for path in paths:
        with suppress(InputError):
            if path != "-":
                reads += _recordings(RememberedScene(Workspace(), read_source(path), parameters))
    require_apart(reads, writes)
