"""Initial values."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from fractions import Fraction

import sympy

from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.steps.sections import Formula, Section, Words, formulas, section

#: Angles are multiples of π over a number up to this one, if they are so to the last digit.
_LARGEST_DENOMINATOR = 24


def start(writer: DocumentWriter) -> Section | None:
    """Positions and velocities at the start."""
    equations, say, letters = writer.equations, writer.say, writer.letters
    if not equations.coordinates:
        return None
    heading = say("Initial values")
    if equations.initial is None:
        return section(heading, Words(say("The scene gives none.")))
    positions, velocities = equations.initial.positions, equations.initial.velocities
    time = letters.inline(f"t = {letters.value(equations.simulate.start)}")
    return section(
        heading,
        Words(say("At {time}", time=time)),
        formulas(_rows(writer, 0, positions)),
        formulas(_rows(writer, 1, velocities)) if any(velocities) else Words(say("at rest.")),
    )


def _rows(writer: DocumentWriter, order: int, values: Sequence[float]) -> Iterator[Formula]:
    for c, value in zip(writer.equations.coordinates, values, strict=True):
        label = writer.coordinate(c, order)
        multiple = _multiple_of_pi(value) if c.is_angle and order == 0 else None
        if multiple is not None:
            yield writer.row(label, multiple * sympy.pi)
        else:
            yield Formula(label, (), middle=writer.letters.value(value))


def _multiple_of_pi(value: float) -> sympy.Rational | None:
    """The fraction of π that an angle is, None if it is not a simple one."""
    near = Fraction(value / math.pi).limit_denominator(_LARGEST_DENOMINATOR)
    exact = near.numerator * math.pi / near.denominator
    if value == 0 or not math.isclose(exact, value, rel_tol=2e-16):
        return None
    return sympy.Rational(near.numerator, near.denominator)
