"""Structure facts and conserved quantities of a derivation."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.energies import (
    by_parameters,
    moving_part,
    over_roots,
    parts_by_degree,
)
from lagrange_cli.mechanics.algebra.polynomials import degree_bound, expand_terms
from lagrange_cli.mechanics.algebra.shortest import shortest_groups
from lagrange_cli.mechanics.algebra.substitution import at_rest
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.momenta import momentum_of, terms_by_symbol
from lagrange_cli.mechanics.dynamics.potential_forces import raw_terms
from lagrange_cli.mechanics.elements.body import BodyElement
from lagrange_cli.mechanics.equations import ShortLagrangian
from lagrange_cli.mechanics.findings import Conserved, Facts
from lagrange_cli.mechanics.free_symbols import holds, symbols_in, symbols_of_all
from lagrange_cli.mechanics.kinks import KINKED
from lagrange_cli.mechanics.numerics.rank import (
    DoubleRow,
    Matrix,
    clearly_independent,
    dense_matrix,
)
from lagrange_cli.mechanics.proofs.continuity import is_continuous
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.system import Closure, Coordinate
from lagrange_cli.scene.bodies import bodies_of
from lagrange_cli.scene.checks.external import without_rate
from lagrange_cli.scene.language.expression import names_in
from lagrange_cli.scene.model import Scene

#: Smallest eigenvalue of a scaled mass matrix that counts as inertia.
_INERTIA = 1e-12

#: Systems of more unknowns are first examined without their eigenvalues.
_LARGE = 64

#: Terms that an energy function may be multiplied out to for collection.
_TERM_BUDGET = 400


def structure_facts(derivation: Uncertified) -> Facts:
    """Prove structure facts; a fact without proof is False."""
    reduced = derivation.reduced
    forcing = symbols_of_all(term for row in derivation.forcing for term in row)
    moving = {c.q for c in reduced.coordinates} | {c.v for c in reduced.coordinates}
    moving.add(reduced.names.t)
    inertia = symbols_of_all(derivation.inertia.parts)
    constant = inertia.isdisjoint(moving)
    symbols = inertia | forcing
    symbols = symbols.union(*(symbols_in(closure.expression) for closure in derivation.pushing))
    symbols |= symbols_of_all(e for state in reduced.states for e in state.expressions)
    velocities = {c.v for c in reduced.coordinates}
    positions = [*reduced.resolved.values(), *(c.expression for c in derivation.pushing)]
    # A state has no momentum: no Hamiltonian is its own.
    apart = constant and not forcing & velocities and not reduced.scene.states
    fixed = all(
        c.kind == "position" and reduced.names.t not in symbols_in(c.expression)
        for c in derivation.closures
    )
    return Facts(
        constant_mass_matrix=constant,
        diagonal_mass_matrix=derivation.inertia.is_diagonal,
        separable=apart and not derivation.pushing,
        autonomous=symbols.isdisjoint([reduced.names.t, *reduced.names.inputs.values()]),
        rheonomic=any(reduced.names.t in symbols_in(e) for e in positions),
        planar=_planar(derivation),
        positive_definite_mass_matrix=_positive_definite(derivation),
        unused_parameters=_unused(reduced.scene),
        separable_on_closures=apart and fixed and derivation.pushing == derivation.closures,
    )


def _planar(derivation: Uncertified) -> bool:
    """Every particle moves in one and the same coordinate plane (or a parallel one)."""
    reduced = derivation.reduced
    bodies = reduced.names.particle_symbols
    moving = {c.q for c in reduced.coordinates} | {reduced.names.t}
    if any(not body.planar for body in bodies_of(reduced.scene)):
        return False
    return bool(bodies) and any(
        not any(symbols_in(reduced.resolved[body[axis]]) & moving for body in bodies)
        for axis in range(3)
    )


def _positive_definite(derivation: Uncertified) -> bool:
    """Tell whether M is proven positive definite: Σ m JᵀJ with m > 0 and full rank.

    Extra kinetic energy is admitted where each term is linear in velocities, or quadratic,
    never negative, and without switching functions, which may be zero on a part of the
    configurations. Full rank is checked without closures only; beside them
    every coordinate must be a particle's component itself, whose mass it has.
    """
    velocities = frozenset(c.v for c in derivation.reduced.coordinates)
    if derivation.closures and not _has_own_inertia(derivation):
        return False
    extra = derivation.extra
    if derivation.tree is not None:
        # The energies of bodies are as long as their chain; their tensors are not.
        if not all(_is_semidefinite(e.inertia) for e in _bodies(derivation.reduced)):
            return False
        terms = raw_terms(derivation.reduced)
        extra = sp.Add(*terms.declared, *(-u for u in terms.velocity_dependent))
    return all(_adds_no_deficit(t, velocities) for t in sp.Add.make_args(extra))


def _bodies(reduced: Reduced) -> Iterator[BodyElement]:
    return (e for e in reduced.elements if isinstance(e, BodyElement))


def _is_semidefinite(tensor: Sequence[sp.Expr]) -> bool:
    """Tell whether a tensor of inertia is proven to have no negative moment."""
    if all(e.is_Rational for e in tensor):
        return bool(sp.Matrix(3, 3, list(tensor)).is_positive_semidefinite)
    is_diagonal = all(e == 0 for k, e in enumerate(tensor) if k % 4)
    return is_diagonal and all(bool(e.is_nonnegative) for e in tensor[::4])


def _has_own_inertia(derivation: Uncertified) -> bool:
    reduced = derivation.reduced
    components = {reduced.resolved[s] for body in reduced.names.particle_symbols for s in body}
    return all(c.q in components for c in reduced.coordinates)


def _adds_no_deficit(term: sp.Expr, velocities: frozenset[sp.Symbol]) -> bool:
    degree = degree_bound(term, velocities)
    if degree is None or degree > 2:
        return False
    return degree < 2 or bool(term.is_nonnegative and not holds(term, *KINKED))


def _unused(scene: Scene) -> tuple[str, ...]:
    """Parameters that occur nowhere in the scene."""
    expressions = [
        *(p.value for p in scene.parameters),
        *(u.expression for u in scene.inputs),
        *(e for s in scene.states for e in s.expressions),
        *(e for c in scene.controllers for e in (c.every, *(v.expression for v in c.values))),
        *(p.mass for p in scene.particles),
        *(e for p in scene.particles for e in p.position),
        *(e for p in scene.points for e in p.position),
        *(s for c in scene.constraints for e in c.equations for s in (e.left, e.right)),
        *(s for u in scene.unilateral for s in (u.inequality.left, u.inequality.right)),
        *(u.restitution for u in scene.unilateral),
        *(f.expression for f in scene.functions),
        *(d.expression for d in scene.definitions),
        *(t.expression for t in (*scene.potentials, *scene.kinetic, *scene.dissipation)),
        *(c for f in scene.forces for c in f.components),
        *(t.expression for t in scene.outputs),
        *(i.value for i in (*scene.initial, *scene.state_starts, *scene.near)),
        scene.simulate.until,
        scene.simulate.start,
        scene.simulate.step,
        scene.simulate.accuracy,
        scene.simulate.samples,
    ]
    unused = {p.name for p in scene.parameters} - {name for _, name in scene.starts}
    for expression in expressions:
        if not unused:
            break
        if expression is not None:
            unused.difference_update([n.name for n in names_in(expression.node)])
    return tuple(p.name for p in scene.parameters if p.name in unused)


def require_no_rates_of_inputs(derivation: Uncertified) -> None:
    """Refuse inputs and states beside velocities in L: d/dt ∂L/∂q̇ would hold their rates.

    Raises
    ------
    InputError
        Located at the input or state.
    """
    reduced = derivation.reduced
    velocities = {c.v for c in reduced.coordinates}
    if symbols_in(derivation.extra).isdisjoint(reduced.names.external.values()):
        return
    parts = [symbols_in(e) for e in sp.Add.make_args(sp.expand_mul(derivation.extra))]
    coupled = set().union(*(symbols for symbols in parts if symbols & velocities))
    for state in reduced.scene.states:
        if reduced.names.states[state.name] in coupled:
            raise InputError(
                Problem(
                    f"the state '{state.name}' stands beside velocities in the Lagrangian",
                    state.mark,
                    hint="momenta do not follow states: write a force on the coordinate",
                    rule="misplaced-state",
                )
            )
    for term in reduced.scene.inputs:
        if reduced.names.inputs[term.name] in coupled:
            raise InputError(
                Problem(
                    f"the input '{term.name}' stands beside velocities in the Lagrangian,"
                    " so that its rate would be needed",
                    term.mark,
                    hint=without_rate(reduced.scene, term.name),
                    rule="misplaced-input",
                )
            )


def require_inertia(derivation: Uncertified, evidence: Evidence) -> None:
    """Refuse equations of motion that are singular at every state, naming the coordinate.

    With closures [[M, Φᵀ], [Φ, 0]] has to be regular in place of M: a coordinate without inertia
    may follow from the others.

    Raises
    ------
    InputError
        Located at the coordinate without inertia of its own, or with one that is no double.
    """
    coordinates = derivation.reduced.coordinates
    if evidence.beyond is not None:
        raise _beyond_doubles(derivation.reduced, *evidence.beyond)
    for gradients in evidence.gradients:
        for closure, row in zip(derivation.closures, gradients, strict=True):
            if not all(map(math.isfinite, row.values())):
                raise _steep(derivation.reduced, closure)
    best = None
    for mass, gradients in zip(evidence.mass_matrices, evidence.gradients, strict=True):
        direction = _null_direction(mass, gradients)
        if direction is None:
            return
        best = direction
    if best is None:
        return
    weakest = coordinates[int(np.abs(best).argmax())]
    # What switches, or vanishes to every digit, may be something elsewhere.
    partly = (*KINKED, sp.exp, sp.tanh)
    is_partial = any(holds(e, *partly) for row in derivation.mass for p in row.values() for e in p)
    where = "the configurations looked at" if is_partial else "every configuration"
    raise InputError(
        Problem(
            f"coordinate '{weakest.name}' has no inertia of its own:"
            f" the mass matrix is singular at {where}",
            _place(derivation.reduced, weakest),
            hint="the kinetic energy must depend on the velocity of every coordinate",
            rule="no-inertia",
        )
    )


def _place(reduced: Reduced, coordinate: Coordinate) -> Mark:
    scene = reduced.scene
    return coordinate.mark or scene.coordinates_mark or Mark(scene.file, 1, 1)


def _beyond_doubles(reduced: Reduced, number: int, size: mpf) -> InputError:
    coordinate = reduced.coordinates[number]
    what = "above 1e308: numbers overflow" if size > 1 else "below 1e-307: numbers underflow"
    return InputError(
        Problem(
            f"the inertia of coordinate '{coordinate.name}' is {what}",
            _place(reduced, coordinate),
            hint="write the scene in units that keep masses times lengths squared"
            " between 1e-300 and 1e300",
            rule="range",
        )
    )


def _steep(reduced: Reduced, closure: Closure) -> InputError:
    return InputError(
        Problem(
            f"the gradient of '{closure.name}' is above 1e308: numbers overflow",
            closure.mark or Mark(reduced.scene.file, 1, 1),
            hint="write the scene in units that keep it between 1e-300 and 1e300",
            rule="range",
        )
    )


def _null_direction(inertia: Sequence[DoubleRow], slopes: Sequence[DoubleRow]) -> Matrix | None:
    """Direction of q that the equations leave open, None if they are regular or without q.

    M is scaled by its diagonal, each gradient by its largest entry.
    """
    n = len(inertia)
    if _clearly_regular(inertia, slopes):
        return None
    mass, gradients = dense_matrix(inertia, n), dense_matrix(slopes, n)
    scale = np.sqrt(np.abs(np.diag(mass)))
    scale[scale == 0] = np.sqrt(np.abs(mass).max(initial=0.0)) or 1.0
    whole = np.zeros((n + len(gradients), n + len(gradients)))
    whole[:n, :n] = mass / np.outer(scale, scale)
    if len(gradients):
        rows = gradients / scale
        rows /= np.maximum(np.abs(rows).max(axis=1, keepdims=True), 1e-300)
        whole[n:, :n], whole[:n, n:] = rows, rows.T
    # Vectors cost far more than values, and are seldom needed.
    if not len(whole) or np.abs(np.linalg.eigvalsh(whole)).min() > _INERTIA:
        return None
    sizes, vectors = np.linalg.eigh(whole)
    direction: Matrix = vectors[:n, int(np.abs(sizes).argmin())]
    return direction


def _clearly_regular(inertia: Sequence[DoubleRow], slopes: Sequence[DoubleRow]) -> bool:
    """Tell whether diagonal M and clearly independent gradients show a large system regular."""
    if len(inertia) + len(slopes) <= _LARGE:
        return False
    sizes = [row.get(j, 0.0) for j, row in enumerate(inertia)]
    if min(sizes) <= 0 or any(any(row[k] for k in row if k != j) for j, row in enumerate(inertia)):
        return False
    rows = [{j: x / math.sqrt(sizes[j]) for j, x in row.items()} for row in slopes]
    return not rows or clearly_independent(rows)


def cyclic_names(derivation: Uncertified, evidence: Evidence) -> tuple[str, ...]:
    return tuple(
        c.name
        for c, cyclic in zip(derivation.reduced.coordinates, evidence.cyclic, strict=True)
        if cyclic
    )


def conserved_quantities(
    derivation: Uncertified, evidence: Evidence, energy: tuple[sp.Expr, ...], whole: sp.Expr
) -> tuple[Conserved, ...]:
    """Momenta of unforced cyclic coordinates, then the energy or Jacobi integral.

    ``whole`` is the sum of the parts ``energy``. One that may jump on the way is left out.
    """
    numbers = [
        row
        for row, is_cyclic in enumerate(evidence.cyclic)
        if is_cyclic and not evidence.forced[row]
    ]
    holding = terms_by_symbol(derivation.lagrangian) if numbers else {}
    cyclic = [derivation.reduced.coordinates[row] for row in numbers]
    candidates = [
        Conserved(
            name=f"p_{c.name}",
            kind="momentum",
            expression=momentum_of(derivation, c.v, holding.get(c.v, [])),
            reason=f"{c.name} is cyclic",
            coordinate=c.name,
        )
        for c in cyclic
    ]
    external = derivation.reduced.names.external.values()
    driven = external and not symbols_of_all([derivation.lagrangian]).isdisjoint(external)
    if evidence.energy_conserved and not driven:
        kind: Literal["energy", "jacobi"] = "energy" if evidence.energy_is_sum else "jacobi"
        parts = () if kind == "energy" else energy
        even = kind == "jacobi" and _is_even(derivation)
        reason = _reason(derivation)
        candidates.append(Conserved(kind, kind, whole, reason, parts=parts, is_energy=even))
    moving = {s for c in derivation.reduced.coordinates for s in (c.q, c.v)}
    moving.add(derivation.reduced.names.t)
    return tuple(c for c in candidates if is_continuous(c.expression, moving))


def _is_even(derivation: Uncertified) -> bool:
    """Tell whether T is even in the velocities and 0 at rest, and V does not hold velocities.

    Jacobi's integral is then the energy, as in the theory of relativity, though T is no kinetic
    energy.
    """
    velocities = [c.v for c in derivation.reduced.coordinates]
    kinetic = derivation.kinetic
    still = at_rest(kinetic, velocities)
    is_even = kinetic.xreplace({v: -v for v in velocities}) == kinetic
    is_positional = symbols_in(derivation.potential).isdisjoint(velocities)
    return bool(still == 0 and is_even and is_positional)


def _reason(derivation: Uncertified) -> str:
    """Phrase why the energy is conserved, and that an impact takes part of it."""
    elastic = all(contact.restitution == 1 for contact in derivation.contacts)
    return "L does not depend on t" + ("" if elastic else " (between impacts)")


def short_lagrangian(derivation: Uncertified) -> ShortLagrangian | None:
    """L without constants and functions of t alone; None if it has none, or no other terms.

    None also if no other term depends on t: the energy of the whole L changes then, which the
    shorter L would hide.
    """
    reduced = derivation.reduced
    velocities = frozenset(c.v for c in reduced.coordinates)
    coordinates = frozenset(c.q for c in reduced.coordinates)
    moving, left_out = moving_part(derivation.lagrangian, coordinates, velocities)
    if 0 in (moving, left_out):
        return None
    time = {reduced.names.t, *reduced.names.external.values()}
    if symbols_in(moving).isdisjoint(time) and not symbols_in(left_out).isdisjoint(time):
        return None
    terms = sp.Add.make_args(moving)
    still = [term for term in terms if symbols_in(term).isdisjoint(velocities)]
    rates = [term for term in terms if not symbols_in(term).isdisjoint(velocities)]
    constants = frozenset(reduced.names.parameters.values())
    return ShortLagrangian(sp.Add(*rates, *shortest_groups(still, constants)), left_out)


def total_energy(derivation: Uncertified, evidence: Evidence) -> tuple[sp.Expr, ...]:
    """Terms of Σ q̇ ∂L/∂q̇ − L, as those of T + V if that is the same.

    Where T is of degree 2 in velocities they are T2, −T0 and V, as printed in T and V.
    """
    velocities = [c.v for c in derivation.reduced.coordinates]
    if evidence.energy_is_sum:
        still = at_rest(derivation.potential, velocities)
        return derivation.kinetic, derivation.potential if still is None else still
    kinetic = parts_by_degree(derivation.kinetic, velocities)
    potential = parts_by_degree(derivation.potential, velocities)
    if kinetic is not None and potential is not None and potential[0] == 0:
        second, _, zeroth = kinetic
        return tuple(e for e in (second, -zeroth, potential[2]) if e != 0)
    # Σ q̇ ∂T/∂q̇ − T and V, which may hold velocities.
    constants = frozenset(derivation.reduced.names.parameters.values())
    parts = []
    for energy, sign in ((derivation.kinetic, 1), (derivation.potential, -1)):
        slopes = [v * derivative(energy, v) for v in velocities if v in symbols_in(energy)]
        whole = sign * (sp.Add(*slopes) - energy) if slopes else -sign * energy
        expanded = expand_terms(whole, _TERM_BUDGET) if slopes else None
        if expanded is not None:
            whole = by_parameters(over_roots(collected_terms(expanded)), constants, ())
        parts.append(whole)
    return tuple(e for e in parts if e != 0)
