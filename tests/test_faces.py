"""Rooms are entered through the modules that their ``__init__`` lists."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import lagrange_cli

ROOT = Path(lagrange_cli.__file__).parent

#: The dotted names of all modules of the package.
MODULES = {
    ".".join(("lagrange_cli", *path.relative_to(ROOT).with_suffix("").parts)): path
    for path in ROOT.rglob("*.py")
    if path.name != "__init__.py"
}


def imported(path: Path) -> Iterator[str]:
    """The modules of the package that a file imports, within functions too."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            whole = [f"{node.module}.{alias.name}" for alias in node.names]
            yield from {name if name in MODULES else node.module or "" for name in whole}
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


def face(package: Path) -> list[str]:
    """The names in ``__all__`` of a room."""
    for node in ast.parse((package / "__init__.py").read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names: list[str] = ast.literal_eval(node.value)
            return names
    return []


def entered() -> dict[Path, set[str]]:
    """The modules of each folder that are imported from outside of it."""
    found: dict[Path, set[str]] = {}
    for path in ROOT.rglob("*.py"):
        for name in imported(path):
            target = MODULES.get(name)
            if target is not None and target.parent not in (path.parent, *path.parents):
                found.setdefault(target.parent, set()).add(target.stem)
    return found


@pytest.mark.slow
def test_rooms_list_the_modules_that_others_import():
    """Where ``__all__`` lists modules it lists those, no more and no less."""
    assert len(MODULES) > 300
    for folder, names in entered().items():
        listed = {name for name in face(folder) if (folder / f"{name}.py").exists()}
        if listed:
            assert names == listed, folder
    assert sum(bool(face(folder)) for folder in entered()) > 30
