"""Phrases and rows on constraint forces and multipliers that all formats share."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.report.contents.joints import reaction_of_joint
from lagrange_cli.report.contents.sentences import names
from lagrange_cli.report.inlines import Plain, Written, say

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import ConstraintForces, Reaction

_AXES = ("x", "y", "z")


def forces_line() -> Written:
    """Say which forces the formulas give: those of constraints, without applied ones."""
    return say("beside applied forces; by constraints the multiplier times the gradient")


def force_rows(forces: ConstraintForces) -> Iterator[tuple[str, list[tuple[str, Expr]]]]:
    """Yield each body that a force acts on, with ``f_x`` and so on, unless they are zero.

    ``|f|`` follows if several components have a short magnitude. Forces that are not unique are
    left out.
    """
    for body in (b for b in forces.bodies if b.name not in forces.shared):
        rows = [
            (f"f_{axis}", component)
            for axis, component in zip(_AXES, body.components, strict=True)
            if component != 0
        ]
        if len(rows) > 1 and body.size is not None:
            rows.append(("|f|", magnitude(body.size)))
        if rows:
            yield body.name, rows


def magnitude(size: Expr) -> Expr:
    """Write |f| with factors that are known to be positive outside."""
    factors = sympy.Mul.make_args(size)
    outside = [f for f in factors if f.is_nonnegative or f.is_Rational or _is_root(f)]
    inside = sympy.Mul(*(f for f in factors if f not in outside))
    sizes = [f if _is_root(f) else abs(f) for f in outside]
    return sympy.Mul(*sizes, sympy.Abs(inside, evaluate=False) if inside != 1 else 1)


def _is_root(factor: Expr) -> bool:
    """Say whether a factor is a square root."""
    return bool(factor.is_Pow and factor.exp == sympy.Rational(1, 2))


def reaction_rows(
    equations: Equations, forces: ConstraintForces
) -> Iterator[tuple[str, Expr | None, list[tuple[str, Expr]]]]:
    """Yield each constraint's name, its multiplier, and bodies with the λ |∇φ| that acts on them.

    The multiplier is None if it is an unknown of the equations of motion; λ |∇φ| is left out
    if it is the multiplier again. There is no row if no constraint exerts a force.
    """
    if are_none(forces):
        return
    unknowns = {closure.multiplier for closure in equations.system.pushing}
    for reaction in forces.reactions:
        known = None if reaction.multiplier in unknowns else reaction.multiplier
        sizes = [(names, e) for names, e in _by_size(reaction) if e != reaction.multiplier]
        if known is not None or sizes:
            yield reaction.name, known, sizes


def _by_size(reaction: Reaction) -> list[tuple[str, Expr]]:
    """Return bodies, together if the constraint acts on them equally, with its force."""
    bodies: dict[Expr, list[str]] = {}
    for name, size in reaction.sizes:
        bodies.setdefault(size, []).append(name)
    return [(", ".join(names), size) for size, names in bodies.items()]


def are_none(forces: ConstraintForces) -> bool:
    """Say whether no constraint exerts a force: all are known, and vanish."""
    values = [e for body in forces.bodies for e in body.components]
    values += [reaction.multiplier for reaction in forces.reactions]
    return not (forces.open or forces.shared or any(values))


def _roles(forces: ConstraintForces) -> Iterator[Written]:
    """Say of each multiplier of a joint what it is."""
    for reaction in forces.reactions:
        if reaction.role:
            yield say(
                "multiplier of {name}: {value}",
                name=Plain(reaction.name),
                value=reaction_of_joint(reaction.role),
            )


def force_notes(forces: ConstraintForces) -> list[Written]:
    """Return notes on the formulas of forces."""
    notes: list[Written] = list(_roles(forces))
    if forces.form == "accelerations":
        notes.append(say("the accelerations are those of the equations of motion"))
    if forces.form == "multipliers":
        notes.append(say("multipliers and accelerations are those of the equations of motion"))
    if forces.shared:
        notes.append(
            say.counted(
                len(forces.shared),
                "the force on {bodies} is not unique: what {listed} exerts is written in"
                " coordinates, and acts on no particle",
                "the forces on {bodies} are not unique: what {listed} exerts is written in"
                " coordinates, and shared among them in no way that is stated",
                bodies=names(forces.shared),
                listed=names(forces.included),
            )
        )
    elif forces.included:
        notes.append(
            say.counted(
                len(forces.included),
                "these include the term {listed}, because it is written in coordinates",
                "these include the terms {listed}, because they are written in coordinates",
                listed=names(forces.included),
            )
        )
    if forces.weightless:
        notes.append(say("the scene gives {listed} no weight", listed=names(forces.weightless)))
    if forces.open:
        phrase = "multipliers that are not determined, or have no short form: {listed}"
        notes.append(say(phrase, listed=names(forces.open)))
    return notes
