"""No output of a command takes the place of a file that the command reads."""

from __future__ import annotations

import glob
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from lagrange_cli.cli.remembered import SceneSource
from lagrange_cli.errors import InputError
from lagrange_cli.files import Named, read_bytes, require_apart, same_file

if TYPE_CHECKING:
    from lagrange_cli.emit.base import Emitter
    from lagrange_cli.scene.model import Scene


def guard(
    scene: str,
    source: SceneSource,
    parameters: Mapping[str, str],
    outputs: Mapping[str, str | None],
    more: Iterable[Named] = (),
) -> None:
    """Refuse outputs that would replace what a command reads of a scene, or each other.

    Parameters
    ----------
    scene
        The path as it was typed, ``-`` for standard input.
    outputs
        Option → file, None where it is not given.
    more
        What the command reads besides.

    Raises
    ------
    InputError
        Two files are one; or, where there is any output, the scene cannot be read.
    """
    writes = [Named(option, path) for option, path in outputs.items() if path is not None]
    if writes:
        require_apart([*_read_by(scene, source, parameters), *more], writes)


def _read_by(scene: str, source: SceneSource, parameters: Mapping[str, str]) -> list[Named]:
    """The scene and the files that it names."""
    return [Named("the scene", scene), *_recordings(source, parameters)]


def _recordings(source: SceneSource, parameters: Mapping[str, str]) -> Iterator[Named]:
    """The files of recorded inputs. A scene names one by the key ``file``, perhaps escaped."""
    if b"file" not in source.data and b"\\" not in source.data:
        return
    for given in _read(source, parameters).inputs:
        if given.recording is not None:
            yield Named("a recorded input", given.recording.path)


def _read(source: SceneSource, parameters: Mapping[str, str]) -> Scene:
    from lagrange_cli.scene import read_text

    return read_text(source.data, source.file, parameters=parameters)


def checkpoint_files(path: str) -> dict[str, str]:
    """What a run with a checkpoint writes beside its results: option → file."""
    samples = glob.glob(f"{glob.escape(path)}.samples*")
    named = {f"--checkpoint ({os.path.basename(file)})": file for file in samples}
    return {"--checkpoint": path, **named}


def guard_folder(
    folder: str, scene: str, source: SceneSource, parameters: Mapping[str, str], format_: Emitter
) -> None:
    """The same for a format that writes files into a folder, named after the scene.

    Raises
    ------
    InputError
        One of them would replace what is read.
    """
    reads = _read_by(scene, source, parameters)
    for path in _files(folder, format_.extensions):
        read = [named for named in reads if same_file(path, named.path)]
        if read and os.path.basename(path) in format_.files(_read(source, parameters).name):
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
    """The same for many scenes, those that cannot be read among them.

    Raises
    ------
    InputError
        An output would replace what is read, or is another's.
    """
    writes = [Named(option, path) for option, path in outputs.items() if path is not None]
    if not writes:
        return
    reads = [Named("a scene", path) for path in paths]
    for path in paths:
        with suppress(InputError):
            if path != "-":
                reads.extend(_recordings(SceneSource(path, read_bytes(path)), parameters))
    require_apart(reads, writes)
