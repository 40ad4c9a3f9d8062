"""Compiled integrators: the C files of this folder, as the compiler is given them."""

from __future__ import annotations

from pathlib import Path

__all__ = ["files", "options"]

#: States of more numbers are integrated by loops of a length known only when they run.
LARGEST_DIMENSION = 64


def files() -> dict[str, str]:
    """Name → text of every file of C."""
    folder = Path(__file__).parent
    found = sorted(path for path in folder.iterdir() if path.suffix in (".c", ".h"))
    return {path.name: path.read_text(encoding="ascii") for path in found}


def options(dimension: int) -> tuple[str, ...]:
    """Options of the compiler for states of ``dimension`` numbers.

    Products and sums may be fused: the compensated sums hold no products.
    """
    if dimension > LARGEST_DIMENSION:
        return ("-O2", "-ffp-contract=fast")
    return ("-O3", "-ffp-contract=fast", f"-DLAGRANGE_DIM={dimension}")
