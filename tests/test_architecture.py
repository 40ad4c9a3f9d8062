"""docs/architecture.md names modules, functions and files that there are, and lists every room."""

from __future__ import annotations

import importlib
import importlib.util
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "lagrange_cli"
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
#: What stands between backticks in the walks and tables and is code of the package.
DOTTED = sorted(set(re.findall(r"`((?:[a-z_]+\.)+[a-z_]+)(?:\(.*?\))?`", PAGE)))
PATHS = sorted(set(re.findall(r"`([a-z_/.]+/[a-z_./]*)`", PAGE)))
FILES = (".py", ".md", ".yaml", ".toml")
IN_ROOMS = ("mechanics", "simulate")


def found(name: str) -> bool:
    """Whether a module, or what stands in a module, has this name below the package."""
    parts = name.split(".")
    for k in range(len(parts), 0, -1):
        module = f"lagrange_cli.{'.'.join(parts[:k])}"
        try:
            if importlib.util.find_spec(module) is None:
                continue
        except ModuleNotFoundError:
            continue
        target: object = importlib.import_module(module)
        for part in parts[k:]:
            if not hasattr(target, part):
                return False
            target = getattr(target, part)
        return True
    return False


@pytest.mark.parametrize("name", [n for n in DOTTED if not n.endswith(FILES)])
def test_names_are_those_of_the_program(name: str) -> None:
    assert any(found(f"{room}.{name}".lstrip(".")) for room in ("", *IN_ROOMS, "simulate.accuracy"))


@pytest.mark.parametrize("path", PATHS)
def test_paths_are_there(path: str) -> None:
    assert (ROOT / path).exists() or any(PACKAGE.rglob(path.rstrip("/")))


def test_every_room_has_its_paragraph() -> None:
    rooms = {p.parent.relative_to(PACKAGE) for p in PACKAGE.rglob("__init__.py")} - {Path()}
    first = {str(r) for r in rooms if len(r.parts) == 1}
    floors = {r.name for r in rooms if r.parts[0] in IN_ROOMS and len(r.parts) == 2}
    assert not [room for room in sorted(first) if f"`{room}/`" not in PAGE]
    assert not [floor for floor in sorted(floors) if f"`{floor}/`" not in PAGE]
