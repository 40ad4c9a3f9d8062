"""Find the scene files that paths name."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence

from lagrange_cli.errors import InputError, Problem

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
