"""What files beside shipped scenes hold, read and interpolated without the program."""

from __future__ import annotations

import csv
from functools import cache
from itertools import pairwise
from pathlib import Path

from sympy import Expr, Piecewise, Rational, Symbol

SYSTEMS = Path(__file__).parents[2] / "systems"


@cache
def rows(file: str, column: str) -> list[tuple[Rational, Rational]]:
    """Times and values of a column, exactly as they are written."""
    with (SYSTEMS / file).open(encoding="utf-8", newline="") as lines:
        return [(Rational(row["t"]), Rational(row[column])) for row in csv.DictReader(lines)]


@cache
def linear(file: str, column: str, t: Symbol) -> Expr:
    """A column as a function of time, straight between its rows."""
    found = rows(file, column)
    pieces = [
        (a + (b - a) / (end - start) * (t - start), t < end)
        for (start, a), (end, b) in pairwise(found)
    ]
    return Piecewise(*pieces[:-1], (pieces[-1][0], True))
