"""Proofs of the facts that the certificate observed at some states.

The states of the certificate lie around the start, and forces that rest there may act elsewhere.
They refute facts; the others are proven here: first by the symbols that occur, then by zero tests
(:mod:`.proofs.zero_test`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.substitution import at_rest
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.findings import Conserved
from lagrange_cli.mechanics.free_symbols import symbols_in, symbols_of_all
from lagrange_cli.mechanics.proofs.finite_field import field_inverse
from lagrange_cli.mechanics.proofs.refutation import depends, is_nonzero, jumps
from lagrange_cli.mechanics.proofs.zero_test import (
    are_equal,
    does_not_depend,
    relation_holds,
    vanish,
)
from lagrange_cli.mechanics.system import Closure

_ZERO = sp.Integer(0)

#: Most closures beside which the work of forces is examined.
_CLOSURES = 24


def proven_evidence(derivation: Uncertified, evidence: Evidence) -> Evidence:
    """Keep in the evidence only facts that are proven to hold at every state.

    A coordinate counts as forced unless it is proven that it is not.
    """
    coordinates = derivation.reduced.coordinates
    symbols = _held(derivation)
    forces = _generalized_forces(derivation)
    return replace(
        evidence,
        cyclic=tuple(
            seen and (c.q not in symbols or does_not_depend(derivation.lagrangian, c.q))
            for c, seen in zip(coordinates, evidence.cyclic, strict=True)
        ),
        forced=tuple(
            seen or not vanish(force) for force, seen in zip(forces, evidence.forced, strict=True)
        ),
        energy_conserved=evidence.energy_conserved and _conserves_energy(derivation, forces),
        energy_is_sum=evidence.energy_is_sum and _energy_is_sum(derivation),
    )


def _held(derivation: Uncertified) -> frozenset[sp.Symbol]:
    """Collect the symbols in L."""
    return symbols_of_all((derivation.kinetic, derivation.potential))


def _generalized_forces(derivation: Uncertified) -> list[sp.Expr]:
    """Σ F·∂r/∂q − ∂D/∂q̇ for each coordinate."""
    drag, rows = derivation.dissipation, []
    for j, c in enumerate(derivation.reduced.coordinates):
        parts = [f.generalized[j] for f in derivation.forces]
        rows.append(sp.Add(*parts, -derivative(drag, c.v)) if parts or drag != 0 else _ZERO)
    return rows


def _conserves_energy(derivation: Uncertified, forces: Sequence[sp.Expr]) -> bool:
    """Tell whether L is proven not to depend on t, and forces to do no work."""
    reduced = derivation.reduced
    t = reduced.names.t
    if t in _held(derivation) and not does_not_depend(derivation.lagrangian, t):
        return False
    work = [f * c.v for f, c in zip(forces, reduced.coordinates, strict=True) if f != 0]
    return vanish(sp.Add(*work)) or _are_reactions(derivation.closures, forces)


def _are_reactions(closures: Sequence[Closure], forces: Sequence[sp.Expr]) -> bool:
    """Tell whether generalized forces are a combination of the closures' gradients.

    Such forces do no work in the displacements that closures without a rate admit.
    """
    if not closures or len(closures) > _CLOSURES:
        return False
    places = {j for j, force in enumerate(forces) if force != 0}
    numbers = sorted(places.union(*(c.coordinate_numbers for c in closures)))
    rows = [[forces[j] for j in numbers], *([c.gradient[j] for j in numbers] for c in closures)]
    return relation_holds(
        [e for row in rows for e in row], lambda values, p: _is_combination(values, len(numbers), p)
    )


def _is_combination(values: Sequence[int], n: int, p: int) -> bool:
    """Tell whether the first n numbers are a combination of the rows of n numbers after them."""
    first, *rows = ([*values[k : k + n]] for k in range(0, len(values), n))
    for number, row in enumerate(rows):
        pivot = next((j for j, x in enumerate(row) if x % p), None)
        if pivot is None:
            continue
        scale = field_inverse(row[pivot], p)
        for target in (first, *rows[number + 1 :]):
            factor = target[pivot] * scale
            target[:] = [(x - factor * y) % p for x, y in zip(target, row, strict=True)]
    return not any(x % p for x in first)


def _energy_is_sum(derivation: Uncertified) -> bool:
    """Σ q̇ ∂L/∂q̇ − L = T + V, with V at rest: T is quadratic in velocities, and V linear.

    The kinetic energy of particles is quadratic if no position holds t. Else T and V are compared
    with their values at a multiple of the velocities.
    """
    reduced = derivation.reduced
    bodies = reduced.names.particle_symbols
    still = not any(
        reduced.names.t in symbols_in(reduced.resolved[s]) for body in bodies for s in body
    )
    if still and derivation.extra == 0:
        return True
    velocities = frozenset(c.v for c in reduced.coordinates)
    kinetic, potential = derivation.kinetic, derivation.potential
    if _degree(kinetic, velocities) == 2 and _degree(potential, velocities) == 0:
        return True
    multiple = sp.Dummy("multiple", positive=True)
    faster = {v: multiple * v for v in velocities}
    resting = at_rest(potential, velocities)
    if resting is None:
        return False
    growth = potential.xreplace(faster) - resting - multiple * (potential - resting)
    return are_equal(kinetic.xreplace(faster), multiple**2 * kinetic) and vanish(growth)


def _degree(e: sp.Expr, velocities: frozenset[sp.Symbol]) -> int | None:
    """Degree in velocities of an expression that is plainly homogeneous in them; else None."""
    return _known_degree(e, velocities, {})


def _known_degree(
    e: sp.Expr, velocities: frozenset[sp.Symbol], known: dict[int, int | None]
) -> int | None:
    """Return the degree; ``known`` are those of earlier parts by their ``id``."""
    if id(e) not in known:
        known[id(e)] = _new_degree(e, velocities, known)
    return known[id(e)]


def _new_degree(
    e: sp.Expr, velocities: frozenset[sp.Symbol], earlier: dict[int, int | None]
) -> int | None:
    if e.is_Symbol:
        return int(e in velocities)
    degrees = [_known_degree(a, velocities, earlier) for a in e.args]
    if not any(d != 0 for d in degrees):
        return 0
    known = [d for d in degrees if d is not None]
    if len(known) < len(degrees):
        return None
    if e.is_Mul:
        return sum(known)
    if e.is_Add:
        return known[0] if len(set(known)) == 1 else None
    return known[0] * int(e.exp) if e.is_Pow and e.exp.is_Integer else None


def open_questions(
    derivation: Uncertified, seen: Evidence, facts: Evidence, conserved: Sequence[Conserved]
) -> Iterator[str]:
    """Name coordinates that may be cyclic, and quantities that may be conserved.

    They are neither proven, nor refuted at any state near the start or elsewhere.

    Parameters
    ----------
    seen, facts
        The evidence before and after facts that are not proven were left out.
    """
    reduced, known = derivation.reduced, {c.name for c in conserved}
    energy = seen.energy_conserved and known.isdisjoint(("energy", "jacobi"))
    candidates = [
        (j, c)
        for j, c in enumerate(reduced.coordinates)
        if seen.cyclic[j] and not (facts.cyclic[j] and f"p_{c.name}" in known)
    ]
    if not (energy or candidates):
        return
    lagrangian, forces = derivation.lagrangian, _generalized_forces(derivation)
    for j, c in candidates:
        if not facts.cyclic[j]:
            if depends(lagrangian, c.q):
                continue
            yield c.name
        changes = seen.forced[j] or is_nonzero(forces[j])
        if not changes and not jumps(derivative(lagrangian, c.v)):
            yield f"p_{c.name}"
    if not energy:
        return
    work = [f * c.v for f, c in zip(forces, reduced.coordinates, strict=True)]
    changes = depends(lagrangian, reduced.names.t) or is_nonzero(sp.Add(*work))
    depends_on_inputs = not symbols_in(lagrangian).isdisjoint(reduced.names.external.values())
    if not (changes or depends_on_inputs or jumps(lagrangian)):
        yield "energy"
