"""Compiled integrators: the C files of this folder, as the compiler is given them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

__all__ = ["extended", "files", "headers", "options"]

#: States of more numbers are integrated by loops of a length known only when they run.
LARGEST_DIMENSION = 64

_FOLDER = Path(__file__).parent

#: What the text of a system includes.
_HEADERS = ("lanes.h",)

#: What is written for doubles alone.
_DOUBLES_ALONE = ("gauss.c", "gauss.h")

#: Constants of C that are read as doubles.
_CONSTANT = re.compile(
    r"(?<![\w.])(0x[0-9a-f.]+p[+-]?\d+|\d+\.\d*(?:e[+-]?\d+)?|\d+e[+-]?\d+)(?![\w.])"
)


def files() -> dict[str, str]:
    """Name → text of every file that integrators are made of."""
    found = sorted(path.name for path in _FOLDER.iterdir() if path.suffix in (".c", ".h"))
    return {name: _text(name) for name in found if name not in _HEADERS}


def headers() -> dict[str, str]:
    """Name → text of the headers for a right-hand side."""
    return {name: _text(name) for name in _HEADERS}


def extended(sources: Mapping[str, str]) -> dict[str, str]:
    """The same files computing with long doubles: with 64 binary digits on x86, where doubles
    have 53."""
    kept = {name: text for name, text in sources.items() if name not in _DOUBLES_ALONE}
    return {name: _extended(text) for name, text in kept.items()}


def _extended(text: str) -> str:
    text = _CONSTANT.sub(r"\1L", text.replace("<math.h>", "<tgmath.h>"))
    return re.sub(r"\bdouble\b", "long double", text)


def _text(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="ascii")


def options(dimension: int) -> tuple[str, ...]:
    """Options of the compiler for states of ``dimension`` numbers.

    Products and sums may be fused: the compensated sums hold no products.
    """
    if dimension > LARGEST_DIMENSION:
        return ("-O2", "-ffp-contract=fast")
    return ("-O3", "-ffp-contract=fast", f"-DLAGRANGE_DIM={dimension}")
