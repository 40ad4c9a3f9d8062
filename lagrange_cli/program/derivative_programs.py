"""Functions of emitted code that differentiate the accelerations."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.program import Program, build_jacobian
from lagrange_cli.program.systems.contact_systems import with_contact_flags

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Function → what it differentiates by.
DERIVATIVES = {"jacobian": "state", "jacobian_u": "inputs", "jacobian_p": "parameters"}

#: Numbers of matrices and right-hand sides that are written out at most.
_MOST_NUMBERS = 2_000_000


def derivative_functions(equations: Equations) -> list[str]:
    """List the functions of :data:`DERIVATIVES` that have results."""
    present = {
        "state": equations.coordinates,
        "inputs": equations.coordinates and equations.inputs,
        "parameters": equations.coordinates and equations.parameters,
    }
    return [function for function, by in DERIVATIVES.items() if present[by]]


def derivative_programs(equations: Equations) -> dict[str, Program]:
    """Function → program; with contacts ``contact_`` stands before the name, and flags are read.

    Raises
    ------
    InputError
        All accelerations depend on all others, and they are too many to write out.
    """
    n = len(equations.coordinates) + len(equations.multipliers)
    if n * (n + 2 * len(equations.coordinates)) > _MOST_NUMBERS and equations.closures:
        raise InputError(
            Problem(
                f"derivatives of {len(equations.coordinates)} accelerations with"
                f" {len(equations.multipliers)} multipliers are too many to write out",
                hint="use fewer bodies, or --formulation minimal",
                rule="too-many-derivatives",
            )
        )
    contact = "contact_" if equations.contacts else ""
    flagged = with_contact_flags(equations) if contact else equations
    return {
        contact + function: build_jacobian(flagged, DERIVATIVES[function])
        for function in derivative_functions(equations)
    }
