"""Compiled integrators: the C files of this folder, as the compiler is given them."""

from __future__ import annotations

import os
from typing import Protocol

__all__ = [
    "GROUPS",
    "CType",
    "batched_files",
    "kernel_files",
    "kernel_headers",
    "kernel_options",
    "options_of",
    "source",
    "wide_files",
]

#: States of more numbers are integrated by loops of a length known only when they run.
UNROLLED_DIMENSION = 64

_FOLDER = os.path.dirname(__file__)

#: Kernels that one library holds, by what their functions are called after: those that nearly
#: every run needs, and others that are compiled when they are first asked for.
GROUPS = {
    "stepping": frozenset({"dop853", "gauss"}),
    "fixed": frozenset({"rk4", "verlet", "rattle", "gauss4", "gauss6"}),
    "stiff": frozenset({"radau"}),
    "series": frozenset({"series"}),
}

#: Files of C of the kernels of each library, beside those that all share.
_KERNELS = {
    "stepping": ("dop853.c", "gauss.c"),
    "fixed": ("rk4.c", "verlet.c", "rattle.c", "collocation.c", "fixed.h"),
    "series": ("series.c",),
    "stiff": ("radau.c", "radau_systems.c", "radau.h", "linear.h"),
}

#: Headers that the text of a system includes.
_HEADERS = ("lanes.h", "numbers.h")

#: Files that are written for doubles alone.
_DOUBLES_ALONE = ("gauss.c", "gauss.h")

#: Option for each type of numbers; :file:`numbers.h` reads it.
_WIDTHS = {"long double": ("-DLAGRANGE_WIDE=80",), "_Float128": ("-DLAGRANGE_WIDE=128",)}


class CType(Protocol):
    """A floating-point type of C.

    Attributes
    ----------
    c_name
        ``double``, ``long double`` or ``_Float128``.
    """

    @property
    def c_name(self) -> str: ...


def kernel_files(*groups: str) -> dict[str, str]:
    """Return name → text of every file of the integrators of some :data:`GROUPS`, or of all."""
    names = _names(_FOLDER)
    excluded = [
        name for group in GROUPS if groups and group not in groups for name in _KERNELS[group]
    ]
    return {name: source(name) for name in names if name not in ("lanes.h", *excluded)}


def kernel_headers() -> dict[str, str]:
    """Return name → text of the headers for a right-hand side."""
    return {name: source(name) for name in _HEADERS}


def batched_files() -> dict[str, str]:
    """Return name → text of the files that step many motions at once, with the headers of their
    right-hand sides."""
    names = _names(os.path.join(_FOLDER, "members"))
    return {**kernel_headers(), **{name: source(f"members/{name}") for name in names}}


def wide_files(system: str, series: str) -> tuple[dict[str, str], dict[str, str]]:
    """Return name → text of the files of a system and of the integrators for types wider than
    doubles; ``series`` are Taylor recurrences, and may be empty."""
    files = {"system.c": system, "numbers.h": source("numbers.h")}
    if series:
        headers = (name for name in batched_files() if name.endswith(".h"))
        files |= {"series.c": series, **{name: batched_files()[name] for name in headers}}
    integrators = kernel_files("stepping", "series")
    return files, {name: text for name, text in integrators.items() if name not in _DOUBLES_ALONE}


def options_of(real: CType) -> tuple[str, ...]:
    """Return the options of the compiler for files that compute with numbers of a type."""
    return _WIDTHS.get(real.c_name, ())


def _names(folder: str) -> list[str]:
    return sorted(name for name in os.listdir(folder) if name.endswith((".c", ".h")))


def source(name: str) -> str:
    """Return the text of a file."""
    with open(os.path.join(_FOLDER, name), encoding="ascii") as file:
        return file.read()


def kernel_options(dimension: int) -> tuple[str, ...]:
    """Return the options of the compiler for states of ``dimension`` numbers.

    Products and sums may be fused: the compensated sums hold no products.
    """
    if dimension > UNROLLED_DIMENSION:
        return ("-O2", "-ffp-contract=fast")
    return ("-O3", "-ffp-contract=fast", f"-DLAGRANGE_DIM={dimension}")
