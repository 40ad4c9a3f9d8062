"""Functions of emitted code besides the right-hand side: constraints, derivatives, momenta.

Where closure equations are kept, ``multipliers`` and ``constraints`` belong to the interface. The
others are what ``project`` is made of: changes of q and of v that lead back to the closures, the
residuals with the sums of magnitudes that tell them from rounding, and the squares of the
gradients, which make residuals of different closures comparable. One-sided constraints have more
(:mod:`lagrange_cli.program.systems.contact_systems`): ``gaps`` with their magnitudes;
``gap_terms``, which are their gradients by rows, rates, biases and restitutions; and ``impulse``,
the change of v that changes the rates of what is in contact by the targets. Derivatives of
accelerations, outputs and constraints are further functions, and so are those that lead from
velocities to momenta and back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.program import (
    Program,
    build_jacobian,
    build_program,
    build_slopes,
)
from lagrange_cli.program.systems.contact_systems import with_contact_flags
from lagrange_cli.program.systems.large_systems import is_large_system

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


def optional_outputs(equations: Equations) -> list[str]:
    """List which of ``inputs``, ``outputs`` and ``switches`` the scene has."""
    names = ("inputs", "outputs", "switches")
    return [name for name in names if getattr(equations.system, name)]


def program_of(equations: Equations, name: str) -> Program:
    """Return the program of a function of one output; ``rhs`` gives the accelerations."""
    known = _PROGRAMS.setdefault(equations, {})
    if name not in known:
        known[name] = build_program(equations, ["acceleration" if name == "rhs" else name])
    return known[name]


#: Programs of functions of one output, by equations and name: each language is written from them.
_PROGRAMS: WeakKeyDictionary[Equations, dict[str, Program]] = WeakKeyDictionary()


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

#: Functions that only other emitted functions call.
INTERNAL_FUNCTIONS = frozenset(
    f"{contact}{what}"
    for contact in ("", "contact_")
    for what in _OUTPUTS.keys() - {"multipliers", "constraints"}
) | {"flight_rhs"}


def constraint_programs(equations: Equations, rhs: Program | None = None) -> dict[str, Program]:
    """Build the programs of closures by function: none without closures, some for positions alone.

    ``rhs``: the program of the right-hand side, if it is known.
    """
    kinds = {closure.kind for closure in equations.system.closures}
    shared = None if rhs is None else multipliers_beside(rhs)
    return {
        function: build_program(equations, outputs)
        if shared is None or function != "multipliers"
        else shared
        for function, outputs in _OUTPUTS.items()
        if kinds and ("position" in kinds or not function.startswith("position_"))
    }


def multipliers_beside(rhs: Program) -> Program | None:
    """Return the program of multipliers that shares its solution with a right-hand side, or None.

    It is None where accelerations and multipliers are not solved for together.
    """
    if len(rhs.blocks) != 1 or rhs.parts or rhs.kind is not ProgramKind.RIGHT_HAND_SIDE:
        return None
    (block,) = rhs.blocks
    alone = block.band is not None or block.closures != tuple(range(len(block.closures)))
    return None if alone or not block.closures else replace(rhs, kind=ProgramKind.MULTIPLIERS)


def shifting_programs(equations: Equations) -> dict[str, Program]:
    """Build ``shifted_change``, which leads positions back along the gradients of a step's start.

    Empty where RATTLE, which needs it, does not apply, and where loops are written.
    """
    applies = equations.system.closures and equations.derivation.facts.separable_on_closures
    if not applies or is_large_system(equations):
        return {}
    return {"shifted_change": build_program(equations, ("shifted_change",))}


def contact_programs(equations: Equations) -> dict[str, Program]:
    """Build the programs of contacts by function; empty without contacts.

    The equations are those of :func:`.systems.contact_systems.with_contact_flags`.
    """
    if not equations.system.contacts:
        return {}
    rhs, *others = _OF_CONTACTS
    programs = {rhs: build_program(equations, _OF_CONTACTS[rhs])}
    shared = multipliers_beside(programs[rhs])
    for function in others:
        known = shared if function == "contact_multipliers" else None
        programs[function] = known or build_program(equations, _OF_CONTACTS[function])
    return programs


#: Functions of the canonical equations, which only other emitted functions call.
CANONICAL_PARTS = frozenset({"momenta", "legendre", "momentum_rates"})


def canonical_programs(
    equations: Equations, velocities: Sequence[Expr] | None = None
) -> dict[str, Program]:
    """Build the programs of :data:`CANONICAL_PARTS`, of equations without multipliers.

    Parameters
    ----------
    velocities
        Velocities over coordinates and momenta, these by the symbols of the velocities; None where
        the mass matrix gives them.
    """
    if velocities is None:
        legendre = build_program(equations, ["legendre"], loops=False)
    else:
        named = zip((c.name for c in equations.system.coordinates), velocities, strict=True)
        asked = replace(equations, system=replace(equations.system, outputs=tuple(named)))
        legendre = build_program(asked, ["outputs"], loops=False)
    return {
        "momenta": build_program(equations, ["momenta"], loops=False),
        "legendre": legendre,
        "momentum_rates": build_program(equations, ["momentum_rates"], loops=False),
    }


#: Function → symbols by which it differentiates the state's rates.
DERIVATIVES = {"jacobian": "state", "jacobian_u": "inputs", "jacobian_p": "parameters"}

#: Tail of the names of functions that give those numbers alone that need not be zero.
ENTRIES = "_entries"

#: Function that only a linearization calls → outputs, and symbols by which they are differentiated.
SLOPES = {
    "output_jacobian": (("outputs",), "state"),
    "output_jacobian_u": (("outputs",), "inputs"),
    "constraint_jacobian": (("closures", "closure_rates"), "state"),
    "contact_constraint_jacobian": (("contact_closures", "contact_closure_rates"), "state"),
}

#: Largest number of entries of matrices and right-hand sides that is written out.
_MOST_NUMBERS = 2_000_000


def derivative_functions(equations: Equations) -> list[str]:
    """List the functions of :data:`DERIVATIVES` that have results."""
    present = {
        "state": equations.system.coordinates,
        "inputs": equations.system.coordinates and equations.system.inputs,
        "parameters": equations.system.coordinates and equations.system.parameters,
    }
    return [function for function, by in DERIVATIVES.items() if present[by]]


def derivative_programs(
    equations: Equations, *, jacobian: bool, linearization: bool, sparse: bool = True
) -> dict[str, Program]:
    """Build the programs of derivatives by function, with contacts under names in ``contact_``.

    With contacts the programs read their flags. Names of sparse ones end with :data:`ENTRIES`.

    Parameters
    ----------
    jacobian
        Build all derivatives of the state's rates.
    linearization
        Build those by state and inputs, and the derivatives of outputs and constraints.
    sparse
        Store the numbers alone that need not be zero where they are few.

    Raises
    ------
    InputError
        All accelerations depend on all others, and they are too many to write out.
    """
    if not (jacobian or linearization):
        return {}
    n = len(equations.system.coordinates) + len(equations.system.multipliers)
    if (
        n * (n + 2 * len(equations.system.coordinates)) > _MOST_NUMBERS
        and equations.system.closures
    ):
        raise InputError(
            Problem(
                f"derivatives of {len(equations.system.coordinates)} accelerations with"
                f" {len(equations.system.multipliers)} multipliers are too many to write out",
                hint="use fewer bodies, or --formulation minimal",
                rule="too-many-derivatives",
            )
        )
    contact = "contact_" if equations.system.contacts else ""
    flagged = with_contact_flags(equations) if contact else equations
    programs: dict[str, Program] = {}
    for function in derivative_functions(equations):
        if jacobian or function != "jacobian_p":
            program = build_jacobian(flagged, DERIVATIVES[function], sparse=sparse)
            assert program.jacobian is not None
            tail = "" if program.jacobian.pattern is None else ENTRIES
            programs[contact + function + tail] = program
    return programs | _slope_programs(equations, flagged) if linearization else programs


def _slope_programs(equations: Equations, flagged: Equations) -> dict[str, Program]:
    """Build those programs of :data:`SLOPES` that a linearization of the equations needs.

    Outputs need none where the scene has none: they are the coordinates then.
    """
    if not equations.system.coordinates:
        return {}
    present = {
        "output_jacobian": bool(equations.system.outputs),
        "output_jacobian_u": bool(equations.system.outputs and equations.system.inputs),
        "constraint_jacobian": bool(equations.system.closures and not equations.system.contacts),
        "contact_constraint_jacobian": bool(equations.system.contacts),
    }
    return {
        function: build_slopes(
            flagged if function.startswith("contact_") else equations, *SLOPES[function]
        )
        for function in SLOPES
        if present[function]
    }
