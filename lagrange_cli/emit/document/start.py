"""Initial values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.initial_state import multiple_of_pi
from lagrange_cli.emit.steps.sections import Formula, Section, Words, formulas, section


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
        multiple = multiple_of_pi(value) if order == 0 else None
        if multiple is not None:
            yield writer.row(label, multiple)
        else:
            yield Formula(label, (), middle=writer.letters.value(value))
