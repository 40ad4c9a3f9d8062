"""Functions of emitted code that differentiate: accelerations, outputs and constraints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.program import Program, build_jacobian, build_slopes
from lagrange_cli.program.systems.contact_systems import with_contact_flags

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Function → what it differentiates the accelerations by.
DERIVATIVES = {"jacobian": "state", "jacobian_u": "inputs", "jacobian_p": "parameters"}

#: Function that only a linearization calls → outputs, and what they are differentiated by.
SLOPES = {
    "output_jacobian": (("outputs",), "state"),
    "output_jacobian_u": (("outputs",), "inputs"),
    "constraint_jacobian": (("closures", "closure_rates"), "state"),
    "contact_constraint_jacobian": (("contact_closures", "contact_closure_rates"), "state"),
}

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


def derivative_programs(
    equations: Equations, *, jacobian: bool, linearization: bool
) -> dict[str, Program]:
    """Function → program; with contacts ``contact_`` stands before the name, and flags are read.

    Parameters
    ----------
    jacobian
        All derivatives of the accelerations are wanted.
    linearization
        Those by state and inputs are, with what a linearization needs besides.

    Raises
    ------
    InputError
        All accelerations depend on all others, and they are too many to write out.
    """
    if not (jacobian or linearization):
        return {}
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
    programs = {
        contact + function: build_jacobian(flagged, DERIVATIVES[function])
        for function in derivative_functions(equations)
        if jacobian or function != "jacobian_p"
    }
    return programs | _slope_programs(equations, flagged) if linearization else programs


def _slope_programs(equations: Equations, flagged: Equations) -> dict[str, Program]:
    """Function of :data:`SLOPES` → program, of those that a linearization of the equations needs.

    Outputs need none where the scene has none: they are the coordinates then.
    """
    if not equations.coordinates:
        return {}
    present = {
        "output_jacobian": bool(equations.outputs),
        "output_jacobian_u": bool(equations.outputs and equations.inputs),
        "constraint_jacobian": bool(equations.closures and not equations.contacts),
        "contact_constraint_jacobian": bool(equations.contacts),
    }
    return {
        function: build_slopes(
            flagged if function.startswith("contact_") else equations, *SLOPES[function]
        )
        for function in SLOPES
        if present[function]
    }
