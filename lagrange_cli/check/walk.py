"""Find the scene files that paths name, and the files that these read."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import read_bytes
from lagrange_cli.scene import read_text

if TYPE_CHECKING:
    from lagrange_cli.files import FileColumn

#: The key of a file that a scene reads, in any way in which YAML writes it.
_NAMES_A_FILE = re.compile(rb"file['\"]?\s*:")

#: File names that count as scenes in a folder; a file named outright may have any.
_SUFFIXES = (".yaml", ".yml")


def _in_folder(folder: str) -> Iterator[str]:
    """Yield scene files below a folder in sorted order, without hidden files and folders."""
    for parent, folders, files in os.walk(folder):
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        for name in sorted(files):
            if name.endswith(_SUFFIXES) and not name.startswith("."):
                yield os.path.join(parent, name)


def scenes_in(paths: Sequence[str]) -> list[str]:
    """Return the scene files that paths name, each once, folders searched recursively.

    Raises
    ------
    InputError
        A path does not exist, or a folder holds no scene.
    """
    scene_paths: dict[str, None] = {}
    problems = []
    for path in paths:
        scenes = list(_in_folder(path)) if os.path.isdir(path) else [path]
        if path != "-" and not os.path.exists(path):
            problems.append(Problem(f"no such file or folder: '{path}'", rule="path"))
        elif not scenes:
            problems.append(
                Problem(f"no scene in folder '{path}'", hint="scenes end in .yaml", rule="path")
            )
        scene_paths.update(dict.fromkeys(scenes))
    if problems:
        raise InputError(*problems)
    return list(scene_paths)


def name_of(path: str) -> str:
    """Return the name that messages have for a scene."""
    return "<stdin>" if path == "-" else path


def columns_in(data: bytes, path: str) -> tuple[FileColumn, ...]:
    """Return the columns of files that the text of a scene names.

    Raises
    ------
    InputError
        It names files, and cannot be read.
    """
    return read_text(data, name_of(path)).columns if _NAMES_A_FILE.search(data) else ()


def files_of(path: str) -> list[str]:
    """Return a scene and the files that it reads; the scene alone if it cannot be read."""
    try:
        columns = () if path == "-" else columns_in(read_bytes(path), path)
    except InputError:
        columns = ()
    return [path, *dict.fromkeys(column.path for column in columns)]
