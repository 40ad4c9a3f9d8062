"""Functions that emitted code needs besides if closure equations are kept.

``multipliers`` and ``constraints`` belong to the interface. The others are what
``project`` is made of: changes of q and of v that lead back to the closures,
the residuals with the sums of magnitudes that tell them from rounding, and what compares
the magnitudes of different closures. One-sided
constraints have more (:mod:`lagrange_cli.program.systems.contact_systems`): ``gaps`` with their
magnitudes; ``gap_terms``, which are their gradients by rows, rates, biases and
restitutions; and ``impulse``, the change of v that changes the rates of what is in
contact by the targets.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.program.program import Program, ProgramKind, build_program
from lagrange_cli.program.systems.large_systems import is_large_system

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Function → outputs that it writes, one after the other.
_OUTPUTS: dict[str, tuple[str, ...]] = {
    "multipliers": ("multipliers",),
    "constraints": ("closures", "closure_rates"),
    "position_error": ("closures", "closure_sizes"),
    "position_reach": ("closure_gradient_squares",),
    "position_change": ("position_change",),
    "velocity_error": ("closure_rates", "closure_rate_sizes"),
    "velocity_change": ("velocity_change",),
}

#: The same where there are one-sided constraints, with those in contact among the closures.
_OF_CONTACTS: dict[str, tuple[str, ...]] = {
    "contact_rhs": ("contact_acceleration",),
    **{
        f"contact_{function}": tuple(f"contact_{name}" for name in outputs)
        for function, outputs in _OUTPUTS.items()
    },
    "gaps": ("gaps", "gap_sizes"),
    "gap_terms": ("gap_gradients", "gap_rates", "gap_biases", "restitutions"),
    "impulse": ("impulse",),
}

#: Functions that only others call.
INTERNAL_FUNCTIONS = frozenset(
    f"{contact}{what}"
    for contact in ("", "contact_")
    for what in _OUTPUTS.keys() - {"multipliers", "constraints"}
) | {"flight_rhs"}


def constraint_programs(equations: Equations, rhs: Program | None = None) -> dict[str, Program]:
    """Function → program; none in minimal scenes, none for positions without such closures.

    ``rhs``: the program of the right-hand side, if it is known.
    """
    kinds = {closure.kind for closure in equations.closures}
    shared = None if rhs is None else multipliers_beside(rhs)
    return {
        function: build_program(equations, outputs)
        if shared is None or function != "multipliers"
        else shared
        for function, outputs in _OUTPUTS.items()
        if kinds and ("position" in kinds or not function.startswith("position_"))
    }


def multipliers_beside(rhs: Program) -> Program | None:
    """The program of the multipliers that a right-hand side finds with all of its accelerations;
    None where it finds them in another way."""
    if len(rhs.blocks) != 1 or rhs.parts or rhs.kind is not ProgramKind.RIGHT_HAND_SIDE:
        return None
    (block,) = rhs.blocks
    alone = block.band is not None or block.closures != tuple(range(len(block.closures)))
    return None if alone or not block.closures else replace(rhs, kind=ProgramKind.MULTIPLIERS)


def shifting_programs(equations: Equations) -> dict[str, Program]:
    """The function ``shifted_change``, for a method that leads positions back to the closures along
    the gradients where a step began; none where that method does not apply or loops are written."""
    applies = equations.closures and equations.facts.separable_on_closures
    if not applies or is_large_system(equations):
        return {}
    return {"shifted_change": build_program(equations, ("shifted_change",))}


def contact_programs(equations: Equations) -> dict[str, Program]:
    """Function → program, of equations that
    :func:`~lagrange_cli.program.systems.contact_systems.with_contact_flags` gave."""
    if not equations.contacts:
        return {}
    rhs, *others = _OF_CONTACTS
    programs = {rhs: build_program(equations, _OF_CONTACTS[rhs])}
    shared = multipliers_beside(programs[rhs])
    for function in others:
        known = shared if function == "contact_multipliers" else None
        programs[function] = known or build_program(equations, _OF_CONTACTS[function])
    return programs
