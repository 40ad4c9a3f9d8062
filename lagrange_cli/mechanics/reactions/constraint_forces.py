"""Constraint forces f = m r̈ − F on particles, and their multipliers.

In the formulation ``minimal``, accelerations are replaced where the equations of motion are solved
for them; larger systems keep ``ddot(q)``. With closures, a coordinate that is a Cartesian name
itself feels Σ λ·gradient. A point with a force has no mass: the constraints balance the force.

All forces are compared with Newton's law before they are shown, at the states of the derivation's
certificate: component by component, and by the work on virtual displacements, which is that of the
closures (none without closures).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import count
from typing import Literal

import mpmath
import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import Kinematics, derivative
from lagrange_cli.mechanics.algebra.polynomials import factored_form
from lagrange_cli.mechanics.algebra.shorten import length_factor, shortened
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.dynamics.accelerations import explicit_form, multiplier_terms
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import BodyReaction, ConstraintForces, Reaction
from lagrange_cli.mechanics.numerics.elementary import to_mpf
from lagrange_cli.mechanics.numerics.sampling import working_digits
from lagrange_cli.mechanics.reactions.applied_forces import (
    AppliedForces,
    applied_forces,
    velocity_slopes,
    weightless,
)
from lagrange_cli.mechanics.reactions.forces_certificate import Forces, ForcesCheck
from lagrange_cli.mechanics.reactions.multipliers import (
    ConstraintEquation,
    ForceBalance,
    force_balances,
    multipliers,
)
from lagrange_cli.mechanics.reduction.geometry import gap_over_names
from lagrange_cli.mechanics.system import tagged
from lagrange_cli.scene.language.expression import Equation as Written

#: Most coordinates of systems whose accelerations are replaced.
_SOLVED = 3


def derive_constraint_forces(
    derivation: Uncertified, evidence: Evidence, equations: Equations
) -> ConstraintForces:
    """Find the constraint forces of certified equations.

    Raises
    ------
    InternalError
        They disagree with Newton's law.
    """
    applied = applied_forces(derivation)
    forces = _forces(derivation, equations, applied)
    with mpmath.workdps(working_digits(evidence.certificate.digits)):
        check = ForcesCheck(derivation, applied, evidence)
        check.newton(forces)
        stated = _stated(derivation)
        reactions, undetermined = _reactions(derivation, stated, forces, check)
    return ConstraintForces(
        tuple(_bodies(derivation, applied, forces)),
        tuple(reactions),
        _form(equations, [*forces.along.values(), *(r.multiplier for r in reactions)]),
        undetermined,
        applied.passed_on,
        applied.shared,
        weightless(derivation),
    )


def _form(
    equations: Equations, shown: Sequence[sp.Expr]
) -> Literal["motion", "accelerations", "multipliers"]:
    """Name the class of symbols in the expressions."""
    if equations.system.pushing:
        return "multipliers"
    symbols = set().union(*(e.free_symbols for e in shown))
    return (
        "motion"
        if symbols.isdisjoint(c.a for c in equations.system.coordinates)
        else "accelerations"
    )


def _forces(derivation: Uncertified, equations: Equations, applied: AppliedForces) -> Forces:
    reduced = derivation.reduced
    masses = dict.fromkeys(reduced.names.cartesian.values(), sp.Integer(0))
    bodies = zip(reduced.names.particle_symbols, reduced.masses, strict=True)
    for s, mass in ((s, mass) for body, mass in bodies for s in body):
        masses[s] += mass
    solved = _accelerations(equations)
    direct = dict(_direct(derivation))
    pushes = multiplier_terms(equations)
    along = {}
    for s, mass in masses.items():
        if s in applied.free:
            along[s] = sp.Integer(0)
        elif s in direct:
            along[s] = sp.Add(*pushes[direct[s]])
        else:
            force = mass * _acceleration(derivation, s) + applied.along(s)
            along[s] = shortened(shortened(force).xreplace(solved))
    return Forces(along, direct, solved)


def _accelerations(equations: Equations) -> dict[sp.Symbol, sp.Expr]:
    """Closed forms of all accelerations; empty if one has none."""
    if equations.system.closures or len(equations.system.coordinates) > _SOLVED:
        return {}
    explicit = explicit_form(equations).accelerations
    solved = {
        c.a: e for c, e in zip(equations.system.coordinates, explicit, strict=True) if e is not None
    }
    return solved if len(solved) == len(explicit) else {}


def _acceleration(derivation: Uncertified, symbol: sp.Symbol) -> sp.Expr:
    """r̈ along a raw symbol."""
    reduced = derivation.reduced
    q, v = [c.q for c in reduced.coordinates], [c.v for c in reduced.coordinates]
    kinematics = Kinematics(reduced.resolved, q, v, reduced.names.t)
    rows = kinematics.jacobian(symbol).items()
    turned = [part * reduced.coordinates[j].a for j, parts in rows for part in parts]
    return sp.Add(*turned, *kinematics.convective(symbol))


def _direct(derivation: Uncertified) -> Iterator[tuple[sp.Symbol, int]]:
    """Raw symbols that are coordinates and move no other component, with their numbers."""
    resolved = derivation.reduced.resolved
    for j, c in enumerate(derivation.reduced.coordinates):
        elsewhere = (e for s, e in resolved.items() if s != c.q)
        if resolved.get(c.q) == c.q and not any(c.q in e.free_symbols for e in elsewhere):
            yield c.q, j


def _bodies(
    derivation: Uncertified, applied: AppliedForces, forces: Forces
) -> Iterator[BodyReaction]:
    """Every particle, and points that are pulled at."""
    reduced = derivation.reduced
    names = reduced.names
    masses = [*reduced.masses, *(None for _ in names.point_symbols)]
    seen: set[sp.Symbol] = set()
    for body, symbols, mass in zip(names.bodies, names.body_symbols, masses, strict=True):
        components = []
        for s in symbols:
            shared = sum(s in triple for triple in names.particle_symbols) > 1
            force = forces.along[s]
            if shared and mass is not None:
                load = sp.Integer(0) if s in seen else applied.along(s)
                force = mass * _acceleration(derivation, s) + load
                force = shortened(force.xreplace(forces.solved))
            components.append(force if mass is not None or s not in seen else sp.Integer(0))
            seen.add(s)
        if mass is not None or any(components):
            x, y, z = components
            yield BodyReaction(body.name, (x, y, z), length_factor((x, y, z)))


def _stated(derivation: Uncertified) -> list[ConstraintEquation]:
    """The scene's equations and gaps, each with the name of its multiplier."""
    reduced = derivation.reduced
    closure_of = {
        (r.mark, r.text): c for r, c in zip(reduced.closures, derivation.closures, strict=True)
    }
    taken = {closure.name for closure in closure_of.values()}
    stated = []
    for name, several, equation, slopes, role in _written(derivation):
        closure = closure_of.get((equation.mark(), equation.text))
        if closure is not None:
            name = closure.name
        elif several:
            name = _numbered(name, taken)
            taken.add(name)
        known = None if closure is None else closure.multiplier
        stated.append(ConstraintEquation(name, equation.text, slopes, known, role))
    for one_sided, contact in zip(reduced.scene.unilateral, derivation.contacts, strict=True):
        gap = gap_over_names(reduced.names, one_sided)
        slopes = {s: derivative(gap, s) for s in gap.free_symbols}
        text = one_sided.inequality.text
        stated.append(ConstraintEquation(contact.name, text, slopes, contact.closure.multiplier))
    return stated


def _written(
    derivation: Uncertified,
) -> Iterator[tuple[str, bool, Written, dict[sp.Symbol, sp.Expr], tuple[str, ...]]]:
    """Yield constraint, True if it has several equations, one of these, its slopes and its role."""
    reduced = derivation.reduced
    positional = {id(s.equation): s for s in reduced.chart.geometry.elimination.stated}
    closure_places = {(r.mark, r.text) for r in reduced.closures}
    for constraint in reduced.scene.constraints:
        for number, equation in enumerate(constraint.equations):
            stated = positional.get(id(equation))
            if stated is not None:
                slopes = {s: derivative(stated.phi, s) for s in stated.phi.free_symbols}
            elif (equation.mark(), equation.text) in closure_places:
                slopes = velocity_slopes(derivation, equation)
            else:
                continue
            joint = constraint.joint
            role = () if joint is None else joint.role(number, equation.text)
            yield constraint.name, len(constraint.equations) > 1, equation, slopes, role


def _numbered(name: str, taken: set[str]) -> str:
    numbered = (tagged(name, f"_{number}") for number in count(1))
    return next(candidate for candidate in numbered if candidate not in taken)


def _reactions(
    derivation: Uncertified,
    stated: Sequence[ConstraintEquation],
    forces: Forces,
    check: ForcesCheck,
) -> tuple[list[Reaction], tuple[str, ...]]:
    """Reaction of each equation, and names of the equations without a known multiplier."""
    reduced = derivation.reduced
    along = dict(forces.along)
    along |= {c.q: check.applied.along(c.q) for c in reduced.coordinates if c.q not in along}
    point = check.points[0]
    exact = force_balances(reduced, stated, along, point, keep_definitions=False)
    hoped = force_balances(reduced, stated, forces.along, point, keep_definitions=True)
    # Of bodies that share the force of a term in an unknown way the forces explain no multiplier.
    unique = [row for row in hoped if row.force == 0 or row.body not in check.applied.shared]
    solved = multipliers(stated, exact, unique, point, to_mpf(check.scales[0]))
    check.rows([r for r in exact if r.gradient.keys() <= solved.keys()], solved)
    reactions = [
        Reaction(e.name, e.text, solved[k], tuple(_sizes(hoped, k, solved[k])), e.role)
        for k, e in enumerate(stated)
        if k in solved
    ]
    return reactions, tuple(e.name for k, e in enumerate(stated) if k not in solved)


def _sizes(
    rows: Sequence[ForceBalance], number: int, multiplier: sp.Expr
) -> Iterator[tuple[str, sp.Expr]]:
    """λ |∇φ| for each body."""
    slopes: dict[str, list[sp.Expr]] = {}
    for row in rows:
        if number in row.gradient:
            slopes.setdefault(row.body, []).append(row.gradient[number])
    for body, parts in slopes.items():
        square = shortened(sp.Add(*(e**2 for e in parts)))
        yield body, shortened(multiplier * sp.sqrt(factored_form(square)))
