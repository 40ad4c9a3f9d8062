"""Text on what is found along a motion: Lyapunov exponents, a linear system."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.analysis.wording import along_lines, averaged_line, span_line
from lagrange_cli.notation.page import Block, Row, words

if TYPE_CHECKING:
    from lagrange_cli.analysis.result import AlongMotion, Exponents
    from lagrange_cli.emit.language import Language


def exponent_rows(found: Exponents | None, say: Language) -> list[Row | Block]:
    """Write Lyapunov exponents and their spreads, if there are some."""
    if found is None:
        return []
    columns = [
        [say("exponent"), *(f"{x:.5g}" for x in found.values)],
        [say("spread"), *(f"{x:.2g}" for x in found.spreads)],
    ]
    widths = [max(map(len, column)) for column in columns]
    rows = [
        Row("", "  ".join(["", *(f"{x:>{w}}" for x, w in zip(row, widths, strict=True))]))
        for row in zip(*columns, strict=True)
    ]
    told = words(averaged_line(found, say, str))
    return [Row(say("Lyapunov exponents"), "   ", told, "heading"), *rows]


def along_rows(found: AlongMotion | None, say: Language) -> list[Row | Block]:
    """Say where a linear system along a motion is, if there is one."""
    if found is None:
        return []
    law = "d/dt dy = A(t) dy + B(t) du,  dz = C(t) dy + D(t) du"
    named = (
        (say("states"), found.states),
        (say("inputs"), found.inputs),
        (say("outputs"), found.outputs),
    )
    rows = [Row("", "  ", words(law))]
    rows += [Row("", f"  {n:8} ", words(", ".join(names))) for n, names in named if names]
    rows += [Row("", "  ", words(line)) for line in along_lines(found, say, str)]
    heading = say("Along the motion")
    return [Row(heading, "   ", words(span_line(found, say, str)), "heading"), *rows]
