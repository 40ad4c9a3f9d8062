"""Recorded inputs in emitted Python."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.recorded_inputs import (
    RECORDED_ROUNDING,
    described_input,
    polynomial_row,
    recorded_inputs,
)
from lagrange_cli.emit.template_files import python_template

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["python_recorded"]


def python_recorded(equations: Equations) -> list[str]:
    """The recordings of the inputs, and the function ``recorded``; nothing where there are none."""
    found = recorded_inputs(equations)
    if not found:
        return []
    lines = ["#: Number of the input, end, and rows: a start, coefficients from the lowest."]
    lines.append("RECORDED = [")
    for number, of in found:
        end = "inf" if math.isinf(of.end) else repr(of.end)
        lines += [
            f"    # {comment_text(described_input(equations, number))}",
            f"    ({number}, {end}, [",
        ]
        lines += [f"        {polynomial_row(of, k)}," for k in range(len(of.starts))]
        lines.append("    ]),")
    return [
        "\n".join([*lines, "]", ""]),
        python_template("recorded").replace("@ROUNDING@", repr(RECORDED_ROUNDING)),
    ]
