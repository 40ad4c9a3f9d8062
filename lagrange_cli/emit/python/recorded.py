"""Recorded inputs in emitted Python."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.recorded_inputs import (
    RECORDED_ROUNDING,
    described_input,
    polynomial_rows,
    recorded_inputs,
)
from lagrange_cli.emit.template_files import python_template

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def python_recorded(equations: Equations) -> list[str]:
    """The recordings of the inputs, and the function ``recorded``; nothing where there are none."""
    recordings = recorded_inputs(equations)
    if not recordings:
        return []
    lines = ["#: Number of the input, end, and rows: a start, coefficients from the lowest."]
    lines.append("RECORDED = [")
    for number, pieces in recordings:
        end = "inf" if math.isinf(pieces.end) else repr(pieces.end)
        lines += [
            f"    # {comment_text(described_input(equations, number))}",
            f"    ({number}, {end}, [",
        ]
        lines += [f"        {row}," for row in polynomial_rows(pieces)]
        lines.append("    ]),")
    return [
        "\n".join([*lines, "]", ""]),
        python_template("recorded").replace("@ROUNDING@", repr(RECORDED_ROUNDING)),
    ]
