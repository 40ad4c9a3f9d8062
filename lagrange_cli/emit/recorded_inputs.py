"""Recorded inputs as the text of every language writes them: rows of polynomials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.interpolation import Polynomials, polynomials

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Numbers of a recording that are written into code.
MOST_WRITTEN = 100_000

#: How far beyond a recording, as a part of it, rounding of times may lead.
RECORDED_ROUNDING = 1e-9


def recorded_inputs(equations: Equations) -> list[tuple[int, Polynomials]]:
    """The recorded inputs by number.

    Raises
    ------
    InputError
        Located: one of them is too long to be written into code, or cannot be read.
    """
    recordings = [
        (number, polynomials(source.recording))
        for number, source in enumerate(equations.inputs)
        if source.recording is not None
    ]
    for _, pieces in recordings:
        if pieces.coefficients.size > MOST_WRITTEN:
            raise InputError(
                Problem(
                    f"'{pieces.recording.file}' is too long to be written into code:"
                    f" {pieces.coefficients.size:,} numbers, the most are {MOST_WRITTEN:,}",
                    pieces.recording.mark,
                    hint="lagrange simulate reads it whole; the functions of emitted C"
                    " take inputs from their caller",
                    rule="limit",
                )
            )
    return recordings


def polynomial_rows(pieces: Polynomials) -> list[tuple[float, ...]]:
    """List the start and the coefficients of each piece, lowest first."""
    rows = zip(pieces.starts, pieces.coefficients, strict=True)
    return [(float(start), *map(float, coefficients)) for start, coefficients in rows]


def described_input(equations: Equations, number: int) -> str:
    source: Any = equations.inputs[number]
    return f"{source.name}: {source.recording.described}"
