"""What pyproject.toml declares, as words for `.ci/run`: so the two cannot drift apart.

lowest             each requirement at its lower bound, NAME==VERSION
pythons            the lowest and the newest Python that the classifiers name
interpreter X.Y    the path of that Python, on PATH or of pyenv; exit 1 where there is none
"""

from __future__ import annotations

import os
import re
import shutil
import sys
import tomllib
from pathlib import Path
from typing import Any

PROJECT = Path(__file__).resolve().parents[1] / "pyproject.toml"

#: Extras that run on the lowest versions; heyoka itself asks for NumPy 2.
EXTRAS = ("plot", "parallel", "sundials")

REQUIREMENT = re.compile(r"([A-Za-z0-9-]+)>=([0-9.]+)", re.ASCII)
CLASSIFIER = re.compile(r"Programming Language :: Python :: (3\.[0-9]+)", re.ASCII)


def lowest(project: dict[str, Any]) -> list[str]:
    """Every requirement of the project and of some extras, at its lower bound.

    Raises
    ------
    ValueError
        One is not of the form NAME>=VERSION.
    """
    extras = project["optional-dependencies"]
    texts = [*project["dependencies"], *(text for name in EXTRAS for text in extras[name])]
    bounds = [REQUIREMENT.fullmatch(text) for text in texts]
    if None in bounds:
        raise ValueError(f"no lower bound: {texts[bounds.index(None)]}")
    return [f"{bound[1]}=={bound[2]}" for bound in bounds if bound is not None]


def pythons(project: dict[str, Any]) -> tuple[str, str]:
    """The lowest and the newest version that the classifiers name."""
    named = [CLASSIFIER.fullmatch(text) for text in project["classifiers"]]
    versions = sorted({found[1] for found in named if found is not None}, key=_numbers)
    return versions[0], versions[-1]


def _numbers(version: str) -> list[int]:
    return [int(part) for part in version.split(".")]


def interpreter(version: str) -> str | None:
    """Where a Python of this version is, None where there is none."""
    root = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    installed = sorted(root.glob(f"versions/{version}.*/bin/python{version}"), key=str)
    # What pyenv puts on the path runs other versions than its name says.
    path = shutil.which(f"python{version}")
    if path is not None and "shims" not in Path(path).parts:
        return path
    return str(installed[-1]) if installed else None


def main(words: list[str]) -> int:
    """Print what the words ask for."""
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    match words:
        case ["lowest"]:
            print(*lowest(project))
        case ["pythons"]:
            print(*pythons(project))
        case ["interpreter", version]:
            path = interpreter(version)
            print(path or f"there is no Python {version} here", file=sys.stdout)
            return 0 if path else 1
        case _:
            print(__doc__, file=sys.stderr)
            return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
