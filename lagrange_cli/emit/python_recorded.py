"""Recorded inputs in emitted Python."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.recorded import (
    ROUNDING,
    described_input,
    polynomial_row,
    recorded_inputs,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

__all__ = ["python_recorded"]

_PYTHON = '''\
def recorded(t, y, p, at=None):
    """The recorded inputs at time t, with what lies between two rows continued from the time
    at, by default t itself; NaN for the others, and outside a recording."""
    values = [nan] * len(INPUTS)
    for number, end, rows in RECORDED:
        within = @ROUNDING@ * (end - rows[0][0]) if end < inf else 0.0
        if rows[0][0] - within <= t <= end + within:
            row = bisect_right(rows, (t if at is None else at, inf)) - 1
            start, *coefficients = rows[max(row, 0)]
            values[number] = 0.0
            for coefficient in reversed(coefficients):
                values[number] = values[number] * (t - start) + coefficient
    return values
'''


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
    return ["\n".join([*lines, "]", ""]), _PYTHON.replace("@ROUNDING@", repr(ROUNDING))]
