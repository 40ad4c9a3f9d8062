"""Recorded inputs as the text of every language writes them: rows of polynomials."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files.interpolation import Polynomials, polynomials

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = [
    "MOST_WRITTEN",
    "RECORDED_ROUNDING",
    "described_input",
    "polynomial_row",
    "recorded_inputs",
]

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
    found = [
        (number, polynomials(given.recording))
        for number, given in enumerate(equations.inputs)
        if given.recording is not None
    ]
    for _, of in found:
        if of.coefficients.size > MOST_WRITTEN:
            raise InputError(
                Problem(
                    f"'{of.recording.file}' is too long to be written into code:"
                    f" {of.coefficients.size:,} numbers, the most are {MOST_WRITTEN:,}",
                    of.recording.mark,
                    hint="lagrange simulate reads it whole; the functions of emitted C"
                    " take inputs from their caller",
                    rule="limit",
                )
            )
    return found


def polynomial_row(of: Polynomials, k: int) -> tuple[float, ...]:
    return (float(of.starts[k]), *map(float, of.coefficients[k]))


def described_input(equations: Equations, number: int) -> str:
    given: Any = equations.inputs[number]
    return f"{given.name}: {given.recording.described}"
