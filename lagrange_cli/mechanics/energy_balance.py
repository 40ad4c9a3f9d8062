"""The rate of an energy that is not conserved, compared with the motion before it is reported.

Along a motion Σ q̇ ∂L/∂q̇ − L changes at the rate

    Σ Q q̇ − Σ q̇ ∂D/∂q̇ − ∂L/∂t − Σ λ b,

with the forces Q, Rayleigh's dissipation function D, and the constraints that move in time, whose
φ̇ = gradient·q̇ + b (Goldstein, Poole and Safko, *Classical Mechanics*, 3rd ed., section 2.7).
Where D is quadratic in velocities, Σ q̇ ∂D/∂q̇ is 2D.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.certify.certificate import Evidence
from lagrange_cli.mechanics.certify.printed import along_motion, attempts
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.findings import EnergyBalance
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape
from lagrange_cli.mechanics.numerics.rank import SymbolValues
from lagrange_cli.mechanics.proofs.zero_test import are_equal
from lagrange_cli.mechanics.sparse import entries

#: Most operations of a rate that is reported: about a line of print. Not tuned.
_MOST_OPERATIONS = 40
#: Most operations of one that is put into a short form.
_MOST_UNSHORTENED = 400
#: Degree in velocities of Rayleigh's dissipation function.
_RAYLEIGH = 2


def energy_balance(
    derivation: Uncertified, evidence: Evidence, energy: tuple[sp.Expr, ...]
) -> EnergyBalance | None:
    """The rate of the energy, a sum; None if that is zero, long, or holds rates of inputs.

    Raises
    ------
    InternalError
        It is not the rate of the energy at a state of the certificate.
    """
    reduced = derivation.reduced
    if not symbols_in(derivation.lagrangian).isdisjoint(reduced.names.external.values()):
        return None
    drag, friction = _friction(derivation)
    rate = sp.Add(_work(derivation), -friction)
    is_dissipation = drag and rate == -friction
    rate = shortened(rate) if sp.count_ops(rate) <= _MOST_UNSHORTENED else rate
    if rate == 0 or (not is_dissipation and sp.count_ops(rate) > _MOST_OPERATIONS):
        return None
    if not _is_confirmed(derivation, evidence, sp.Add(*energy), rate):
        return None
    kind: Literal["energy", "jacobi"] = "energy" if evidence.energy_is_sum else "jacobi"
    return EnergyBalance(kind, rate, is_dissipation, energy)


def _friction(derivation: Uncertified) -> tuple[bool, sp.Expr]:
    """Tell whether D is quadratic in velocities, and give Σ q̇ ∂D/∂q̇."""
    drag = derivation.dissipation
    velocities = [c.v for c in derivation.reduced.coordinates if c.v in symbols_in(drag)]
    friction = sp.Add(*(v * derivative(drag, v) for v in velocities))
    is_quadratic = friction != 0 and are_equal(friction, _RAYLEIGH * drag)
    return is_quadratic, _RAYLEIGH * drag if is_quadratic else friction


def _work(derivation: Uncertified) -> sp.Expr:
    """The rate but for friction."""
    coordinates, t = derivation.reduced.coordinates, derivation.reduced.names.t
    forces = [
        q * c.v
        for force in derivation.forces
        for c, q in zip(coordinates, force.generalized, strict=True)
    ]
    moved = [closure.multiplier * closure.rate for closure in derivation.pushing]
    return sp.Add(*forces, -derivative(derivation.lagrangian, t), *(-x for x in moved))


def _is_confirmed(
    derivation: Uncertified, evidence: Evidence, energy: sp.Expr, rate: sp.Expr
) -> bool:
    """Compare with the energy, differentiated along a motion; False if that has no value.

    At a state of the certificate with any accelerations, the equations of motion have residuals:
    these do work too, and so do contacts where the state does not keep their gaps.
    """
    if not evidence.states:
        return False
    for digits, residuals in attempts(evidence):
        with mpmath.workdps(digits):
            try:
                difference, size = _difference(
                    derivation, evidence.states[0], residuals, energy, rate
                )
            except DomainError:
                return False
            if difference <= mpf(10) ** (5 - evidence.certificate.digits) * size:
                return True
    raise InternalError(Problem("the rate of the energy is not that along a motion"))


def _difference(
    derivation: Uncertified,
    state: SymbolValues,
    residuals: Sequence[tuple[mpf, mpf]],
    energy: sp.Expr,
    rate: sp.Expr,
) -> tuple[mpf, mpf]:
    """Return how far the rate is from that along the motion, and the size of the terms.

    Raises
    ------
    DomainError
        One of them has no value.
    """
    reduced = derivation.reduced
    contacts = [contact.closure for contact in derivation.contacts]
    gaps = [
        sp.Add(k.rate, *(g * reduced.coordinates[i].v for i, g in entries(k.gradient).items()))
        for k in contacts
    ]
    along = along_motion(state, reduced)
    terms = sp.Add.make_args(energy)
    outputs = Tape([*terms, rate, *gaps], list(along)).run([*along.values()], 1).outputs
    changes = [x[1] for x in outputs[: len(terms)]]
    stated, *gap_rates = (x[0] for x in outputs[len(terms) :])
    work = [
        state[c.v] * residual
        for c, (residual, _) in zip(reduced.coordinates, residuals, strict=True)
    ]
    work += [state[k.multiplier] * x for k, x in zip(contacts, gap_rates, strict=True)]
    size = sum(map(abs, (*changes, *work)), abs(stated))
    return abs(sum(changes) - stated - sum(work)), size
