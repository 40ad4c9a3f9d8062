"""The comparison of the equations with Lagrange's, and of the steps with derivatives."""

from __future__ import annotations

from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.steps.sections import Section, Words, section


def certificate(writer: DocumentWriter) -> Section | None:
    """How many states were compared, to how many digits, and how well they agreed."""
    say, letters, seal = writer.say, writer.letters, writer.equations.certificate
    told = say.counted(
        seal.points,
        "At {count} random state these equations were compared, in arithmetic of {digits} digits,"
        " with Lagrange's equations evaluated from {lagrangian} itself; the largest relative"
        " mismatch was {mismatch}.",
        "At {count} random states these equations were compared, in arithmetic of {digits} digits,"
        " with Lagrange's equations evaluated from {lagrangian} itself; the largest relative"
        " mismatch was {mismatch}.",
        digits=seal.digits,
        lagrangian=letters.inline(writer.labels["L"]),
        mismatch=letters.inline(letters.number(seal.mismatch)),
    )
    return section(say("Certificate"), Words(told), _steps(writer))


def _steps(writer: DocumentWriter) -> Words | None:
    steps = writer.equations.steps
    if steps is None:
        return None
    return Words(
        writer.say(
            "Every line of the steps was compared at {count} of these states with automatic"
            " differentiation: the largest mismatch was {mismatch}.",
            count=steps.states,
            mismatch=writer.letters.inline(writer.letters.number(steps.mismatch)),
        )
    )
