"""One-sided constraints as systems to solve and expressions to evaluate.

Each contact k has a flag s among the parameters: 1 where it is closed and may push, 0 where it is
open. One system serves all cases: its row is s·gradient·a + s·bias + (1 − s)·λ = 0, beside M a = f
+ Σ s·λ·gradient, so that λ = 0 where it is open. The flags of all contacts stand behind the
parameters of the scene; behind them stand the targets, changes of rates that an impulse has to
cause. ``gaps``, their rates and accelerations tell which flags are to change
(:mod:`lagrange_cli.emit.c.constraints`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.system import Parameter
from lagrange_cli.program.solvers.blocks import MassMatrixSystem
from lagrange_cli.program.systems.constraint_systems import (
    no_forces,
    outputs_of,
    residual_size,
    system_of,
    systems_of,
    times,
)

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure


def with_contact_flags(equations: Equations) -> Equations:
    """Return the equations with U flags, then U targets, as further parameters, for U contacts.

    A flag is 1.0 in contact and 0.0 else; a target is the change of a flagged contact's rate by an
    impulse.
    """
    contacts = equations.system.contacts
    names = [f"{kind}({c.name})" for kind in ("flag", "target") for c in contacts]
    further = (Parameter(name, sympy.Symbol(name, real=True)) for name in names)
    return replace(
        equations,
        system=replace(equations.system, parameters=(*equations.system.parameters, *further)),
    )


def _flags(e: Equations) -> list[Expr]:
    count = len(e.system.contacts)
    return [p.symbol for p in e.system.parameters[-2 * count : -count]]


def _weighted(e: Equations) -> list[tuple[Closure, Expr]]:
    """Closures with weight 1, then contacts with their flags."""
    contacts = zip((contact.closure for contact in e.system.contacts), _flags(e), strict=True)
    return [*((closure, sympy.S.One) for closure in e.system.closures), *contacts]


def _impulse(e: Equations) -> MassMatrixSystem:
    changes = [*(sympy.S.Zero for _ in e.system.closures), *_targets(e)]
    return system_of(_weighted(e), no_forces(e), changes)


def _targets(e: Equations) -> list[Expr]:
    """List the biases of an impulse, also of contacts that are open."""
    return [-p.symbol for p in e.system.parameters[-len(e.system.contacts) :]]


@dataclass(frozen=True)
class WeightedClosures:
    """Outputs of equations in which contacts stand among the closures, weighted by their flags.

    Attributes
    ----------
    equations
        The equations with the contacts among the closures.
    outputs
        Names of the outputs over these.
    compliance
        Diagonal entry of each closure (see :class:`.solvers.blocks.MassMatrixSystem`), or empty.
    flags
        Number of flags and targets, the last parameters.
    """

    equations: Equations
    outputs: tuple[str, ...]
    compliance: tuple[Expr, ...] = ()
    flags: int = 0


def weighted_closures(e: Equations, outputs: Sequence[str]) -> WeightedClosures:
    """Translate outputs of contacts to outputs of equations in which contacts are closures."""
    contacts = [contact.closure for contact in e.system.contacts]
    if outputs[0] == "gaps":
        names = (name.replace("gap", "closure", 1) for name in outputs)
        return WeightedClosures(
            replace(e, system=replace(e.system, closures=tuple(contacts))), tuple(names)
        )
    if outputs[0] == "impulse":
        changes = [*(sympy.S.Zero for _ in e.system.closures), *_targets(e)]
    elif outputs[0].startswith("contact_"):
        changes = [closure.bias for closure, _ in _weighted(e)]
    else:
        return WeightedClosures(e, tuple(outputs))
    weighted = [
        replace(
            closure,
            # Term by term, since magnitudes of terms are added up.
            expression=sympy.Add(*(weight * x for x in sympy.Add.make_args(closure.expression))),
            gradient=times(weight, closure.gradient),
            rate=weight * closure.rate,
            bias=weight * change,
        )
        for (closure, weight), change in zip(_weighted(e), changes, strict=True)
    ]
    names = (name.removeprefix("contact_") for name in outputs)
    compliance = tuple(1 - weight for _, weight in _weighted(e))
    flags = 2 * len(contacts)
    return WeightedClosures(
        replace(e, system=replace(e.system, closures=tuple(weighted))),
        tuple(names),
        compliance,
        flags,
    )


#: Output of flagged equations → the system with the mass matrix that it solves.
CONTACT_SYSTEMS: dict[str, Callable[[Equations], MassMatrixSystem]] = {
    **{f"contact_{name}": system for name, system in systems_of(_weighted).items()},
    "impulse": _impulse,
}


def _gradients(e: Equations) -> Iterable[Expr]:
    return (entry for contact in e.system.contacts for entry in contact.closure.gradient)


#: Output of flagged equations → its expressions.
CONTACT_OUTPUTS: dict[str, Callable[[Equations], Iterable[Expr]]] = {
    **{f"contact_{name}": output for name, output in outputs_of(_weighted).items()},
    "gaps": lambda e: [contact.closure.expression for contact in e.system.contacts],
    "gap_sizes": lambda e: [residual_size(contact.closure, e) for contact in e.system.contacts],
    "gap_gradients": _gradients,
    "gap_rates": lambda e: [contact.closure.rate for contact in e.system.contacts],
    "gap_biases": lambda e: [contact.closure.bias for contact in e.system.contacts],
    "restitutions": lambda e: [contact.restitution for contact in e.system.contacts],
}
