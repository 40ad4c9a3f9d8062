"""Recorded inputs, which are polynomials between the rows of a table."""

from __future__ import annotations

from lagrange_cli.program.lowered.routines.numbers import Array


def interpolated(rows: int, width: int, table: Array, t: float, at: float) -> float:
    """Return a recorded input at time t, by the polynomial that holds at another time.

    Each row of the table has the time at which its polynomial begins, and width - 1 coefficients of
    powers of the time since then, the lowest first. The first polynomial holds before, the last
    one behind all rows.
    """
    low = 0
    high = rows
    while high - low > 1:
        middle = (low + high) // 2
        if table[middle * width] <= at:
            low = middle
        else:
            high = middle
    value = 0.0
    for k in reversed(range(1, width)):
        value = value * (t - table[low * width]) + table[low * width + k]
    return value
