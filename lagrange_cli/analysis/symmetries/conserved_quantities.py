"""Conserved quantities: T + V beside Jacobi's integral h, causes of its loss, columns of a motion.

With T = T2 + T1 + T0 by degrees in the velocities, h = T2 − T0 + V, so that T + V = h + T1 + 2 T0:
moving constraints or axes do work. That T + V is conserved all the same is proven by its rate along
the motion, with accelerations from M a = f, at random points of finite fields; that it is not, by
its rate at a state in many digits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import count

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.sampled_values import SampledValues
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.energies import parts_by_degree
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.findings import FollowedQuantity
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.proofs.finite_field import field_inverse
from lagrange_cli.mechanics.proofs.zero_test import (
    are_equal,
    does_not_depend,
    relation_holds,
    vanish,
)
from lagrange_cli.mechanics.sparse import entries

#: Digits of the values that disprove, and the part of its terms that a value is zero below.
_DIGITS, _NOTHING = 50, mpf(10) ** -30

#: Coordinates up to which accelerations are solved for, operations of a rate that is shown.
_MOST_COORDINATES, _MOST_OPERATIONS = 12, 40

#: Terms that a quantity is multiplied out to; a longer one is compared with its own size.
_TERM_BUDGET = 200

#: Column of T + V, if Jacobi's integral is another function.
ENERGY_SUM = "T + V"


@dataclass(frozen=True)
class EnergySum:
    """T + V, which differs from Jacobi's integral.

    Attributes
    ----------
    difference
        T + V − h.
    conserved
        True or False if that is proven, else None.
    rate
        Its rate along a motion that does not conserve it, where that is short and h is
        conserved; else None.
    with_jacobi
        True if Jacobi's integral is conserved.
    """

    difference: sp.Expr
    conserved: bool | None
    rate: sp.Expr | None
    with_jacobi: bool


@dataclass(frozen=True)
class EnergyLoss:
    """Why an energy is not conserved.

    Attributes
    ----------
    depends_on_time
        True if L depends on t.
    inputs, states
        Names of the inputs and states that L holds.
    friction
        True if dissipation takes energy.
    forces
        Names of forces that do work.
    moving
        Names of the constraints, kept beside the coordinates, that move.
    """

    depends_on_time: bool
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    friction: bool
    forces: tuple[str, ...]
    moving: tuple[str, ...]


def energy_sum(equations: Equations) -> EnergySum | None:
    """Compare T + V with Jacobi's integral.

    None if they are equal, if Jacobi's integral is the energy all the same, as in the theory of
    relativity, if T is no polynomial of second degree in the velocities, or if neither is known to
    be conserved.
    """
    known = [c for c in equations.derivation.conserved if c.kind != "momentum"]
    if any(c.kind == "energy" or c.is_energy for c in known):
        return None
    velocities = [c.v for c in equations.system.coordinates]
    kinetic = parts_by_degree(equations.system.kinetic, velocities)
    potential = parts_by_degree(equations.system.potential, velocities)
    if kinetic is None or potential is None or potential[0] != 0:
        return None
    difference = sp.Add(kinetic[1], 2 * kinetic[2])
    if vanish(difference):
        return None
    rates = [derivative(difference, c.q) * c.v for c in equations.system.coordinates]
    still = sp.Add(derivative(difference, equations.system.t), *rates)
    slopes = [derivative(difference, v) for v in velocities]
    if not known:
        lost = _rate_of_jacobi(equations)
        if lost is not None and _is_constant(equations, sp.Add(still, lost), slopes):
            return EnergySum(difference, True, None, with_jacobi=False)
        return None
    conserved = _is_constant(equations, still, slopes)
    rate = None
    if conserved is False and not any(slopes):
        short = shortened(still)
        rate = short if sp.count_ops(short) <= _MOST_OPERATIONS else None
    return EnergySum(difference, conserved, rate, with_jacobi=True)


def _rate_of_jacobi(equations: Equations) -> sp.Expr | None:
    """Return dh/dt = −∂L/∂t + Σ (Q − ∂D/∂q̇) q̇; None if constraints or inputs contribute."""
    lagrangian = equations.system.lagrangian
    external = equations.system.external_symbols
    if equations.system.pushing or not lagrangian.free_symbols.isdisjoint(external):
        return None
    work = [_power(equations, f.generalized) for f in equations.system.forces]
    drag = [
        c.v * derivative(equations.system.dissipation, c.v) for c in equations.system.coordinates
    ]
    return sp.Add(-derivative(lagrangian, equations.system.t), *work, *(-x for x in drag))


def _is_constant(equations: Equations, still: sp.Expr, slopes: Sequence[sp.Expr]) -> bool | None:
    """Prove or refute still + slopes·a = 0 under M a = f; None if neither succeeds."""
    if not any(slopes):
        if vanish(still):
            return True
    elif equations.system.pushing or len(slopes) > _MOST_COORDINATES:
        return None
    elif _vanishes_in_fields(equations, still, slopes):
        return True
    if equations.system.pushing:
        return None  # states that obey the constraints are few
    return False if _is_nonzero(equations, still, slopes) else None


def _vanishes_in_fields(equations: Equations, still: sp.Expr, slopes: Sequence[sp.Expr]) -> bool:
    """Test still + slopes·a = 0 with M a = f solved at random points of finite fields."""
    n = len(slopes)

    def vanishes(values: Sequence[int], p: int) -> bool:
        rows = [[*values[k * n : (k + 1) * n], values[n * n + k]] for k in range(n)]
        accelerations = _solved(rows, p)
        if accelerations is None:
            return True  # M is singular at this point
        along = values[n * n + n + 1 :]
        moved = sum(s * a for s, a in zip(along, accelerations, strict=True))
        return (values[n * n + n] + moved) % p == 0

    return relation_holds([*_system(equations), still, *slopes], vanishes)


def _system(equations: Equations) -> list[sp.Expr]:
    """Return the entries of M, row by row, then those of f."""
    n = len(equations.system.coordinates)
    rows = [entries(row) for row in equations.system.mass_matrix]
    mass = [row.get(k, sp.Integer(0)) for row in rows for k in range(n)]
    return [*mass, *equations.system.forcing]


def _solved(rows: list[list[int]], p: int) -> list[int] | None:
    """Solve equations, each with its right side behind it, modulo a prime; None if singular."""
    n = len(rows)
    for k in range(n):
        pivot = next((i for i in range(k, n) if rows[i][k] % p), None)
        if pivot is None:
            return None
        rows[k], rows[pivot] = rows[pivot], rows[k]
        inverse = field_inverse(rows[k][k], p)
        rows[k] = [x * inverse % p for x in rows[k]]
        for i in range(n):
            if i != k and rows[i][k]:
                factor = rows[i][k]
                rows[i] = [(x - factor * y) % p for x, y in zip(rows[i], rows[k], strict=True)]
    return [row[n] for row in rows]


def _is_nonzero(equations: Equations, still: sp.Expr, slopes: Sequence[sp.Expr]) -> bool:
    """Say whether still + slopes·a is not zero at some state, in many digits."""
    n = len(slopes)
    wanted = [*_system(equations), still, *slopes]
    samples = SampledValues(equations, 1, seed=3)
    if not samples.values_at_states(wanted).shape[1]:
        return False
    state = {s: mpf(x) for s, x in samples.parameters.items()}
    state |= {s: mpf(float(x[0])) for s, x in samples.states.items()}
    with mpmath.workdps(_DIGITS):
        try:
            values = evaluate(wanted, state)
            terms = [values[n * n + n]]
            if any(slopes):
                accelerations = _accelerations(values[: n * n], values[n * n : n * n + n])
                along = values[n * n + n + 1 :]
                terms += [s * a for s, a in zip(along, accelerations, strict=True)]
        except (DomainError, ZeroDivisionError):
            return False
        return bool(abs(mpmath.fsum(terms)) > _NOTHING * max(map(abs, terms)))


def _accelerations(mass: Sequence[mpf], forcing: Sequence[mpf]) -> list[mpf]:
    """Solve M a = f, M row by row, in units that make the inertias of all coordinates 1.

    Inertias of very different size look singular in others; ZeroDivisionError if M is singular.
    """
    n = len(forcing)
    units = [1 / mpmath.sqrt(abs(mass[k * n + k]) or 1) for k in range(n)]
    matrix, right = mpmath.matrix(n, n), mpmath.matrix(n, 1)
    for i, unit in enumerate(units):
        right[i] = unit * forcing[i]
        for j, second_unit in enumerate(units):
            matrix[i, j] = unit * second_unit * mass[i * n + j]
    solution = mpmath.lu_solve(matrix, right)
    return [unit * x for unit, x in zip(units, solution, strict=True)]


def energy_loss(equations: Equations) -> EnergyLoss | None:
    """Find the causes of an energy's change; None if one is conserved or that is undecided."""
    if (
        any(c.kind != "momentum" for c in equations.derivation.conserved)
        or not equations.system.coordinates
    ):
        return None
    if "energy" in equations.derivation.open_questions:
        return None
    velocities = {c.v for c in equations.system.coordinates}
    system, lagrangian = equations.system, equations.system.lagrangian
    symbols = lagrangian.free_symbols
    loss = EnergyLoss(
        not does_not_depend(lagrangian, equations.system.t),
        tuple(u.name for u in system.inputs if u.symbol in symbols),
        tuple(s.name for s in system.states if s.symbol in symbols),
        not equations.system.dissipation.free_symbols.isdisjoint(velocities),
        tuple(
            f.name for f in equations.system.forces if not vanish(_power(equations, f.generalized))
        ),
        tuple(c.name for c in equations.system.pushing if _moves(equations, c.rate)),
    )
    return loss if any(vars(loss).values()) else None


def _power(equations: Equations, force: Sequence[sp.Expr]) -> sp.Expr:
    return sp.Add(*(q * c.v for c, q in zip(equations.system.coordinates, force, strict=True)))


def _moves(equations: Equations, rate: sp.Expr) -> bool:
    return not are_equal(rate, sp.Integer(0))


def with_constants_of_motion(equations: Equations) -> Equations:
    """Add all conserved quantities but the energy, which runs follow anyway, to the outputs.

    They are the momenta of cyclic coordinates, the quantities of linear symmetries, and T + V where
    it is conserved and differs from the energy function h.
    """
    outputs, followed = dict(equations.system.outputs), list[FollowedQuantity]()
    taken = {s.name for c in equations.system.coordinates for s in (c.q,)} | {
        "t",
        "energy",
        "jacobi",
    }
    taken |= {c.name for c in equations.system.cartesian_names}
    for quantity in _quantities(equations):
        name = _free_name(quantity, taken, outputs)
        outputs[name] = quantity.expression
        followed.append(replace(quantity, name=name))
        taken.add(name)
    return replace(
        equations,
        system=replace(equations.system, outputs=tuple(outputs.items())),
        derivation=replace(equations.derivation, followed=tuple(followed)),
    )


def _quantities(equations: Equations) -> Iterator[FollowedQuantity]:
    for known in equations.derivation.conserved:
        if known.kind == "momentum":
            yield _followed(known.name, known.expression)
    for symmetry in linear_symmetries(equations).proven:
        yield _followed(symmetry.name, symmetry.expression)
    energies = energy_sum(equations)
    # At impacts it changes as h does, which is reported already.
    if energies is not None and energies.conserved and not equations.system.contacts:
        whole = sp.Add(equations.system.energy, energies.difference)
        yield FollowedQuantity(ENERGY_SUM, whole, (equations.system.kinetic,))


def _followed(name: str, expression: sp.Expr) -> FollowedQuantity:
    """Multiply a quantity out, so that no term is a difference that may vanish by itself."""
    terms = expand_terms(expression, _TERM_BUDGET) or sp.Add.make_args(expression)
    return FollowedQuantity(name, expression, tuple(terms))


def _free_name(quantity: FollowedQuantity, taken: set[str], outputs: dict[str, sp.Expr]) -> str:
    """Return the name, numbered where the scene has another quantity of that name."""
    for k in count(1):
        name = quantity.name if k == 1 else f"{quantity.name}_{k}"
        if name not in taken and outputs.get(name, quantity.expression) == quantity.expression:
            return name
    raise AssertionError
