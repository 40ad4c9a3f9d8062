"""Routines by the names that a function calls them by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from lagrange_cli.program.lowered.routines.bands import solve_banded, solve_sparse
from lagrange_cli.program.lowered.routines.elimination import (
    solve_columns,
    solve_definite,
    solve_pivoted,
)
from lagrange_cli.program.lowered.routines.impacts import falling, reset_contacts
from lagrange_cli.program.lowered.routines.motions import (
    advance,
    change_values,
    implicit_midpoint,
    interpolated,
    runge_kutta,
)
from lagrange_cli.program.lowered.routines.projection import (
    is_near,
    lead_positions,
    lead_velocities,
)
from lagrange_cli.program.lowered.routines.saddle import solve_saddle

#: Name → routine; solvers return whether there is a solution. Those of projections,
#: contacts, states with two values, recordings and fixed steps follow.
ROUTINES: Mapping[str, Callable[..., Any]] = {
    "banded": solve_banded,
    "columns": solve_columns,
    "definite": solve_definite,
    "pivoted": solve_pivoted,
    "saddle": solve_saddle,
    "sparse": solve_sparse,
    "lead_positions": lead_positions,
    "lead_velocities": lead_velocities,
    "is_near": is_near,
    "falling": falling,
    "reset_contacts": reset_contacts,
    "change_values": change_values,
    "advance": advance,
    "interpolated": interpolated,
    "runge_kutta": runge_kutta,
    "implicit_midpoint": implicit_midpoint,
}
