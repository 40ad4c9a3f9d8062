"""Routines by the names that a function calls them by."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from lagrange_cli.program.lowered.routines.elimination import (
    solve_columns,
    solve_definite,
    solve_pivoted,
)
from lagrange_cli.program.lowered.routines.saddle import solve_saddle

#: Name → routine, which returns whether there is a solution.
ROUTINES: Mapping[str, Callable[..., bool]] = {
    "columns": solve_columns,
    "definite": solve_definite,
    "pivoted": solve_pivoted,
    "saddle": solve_saddle,
}
