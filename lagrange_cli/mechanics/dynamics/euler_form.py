"""Euler's equations of one body that a quaternion turns, in place of Lagrange's with a multiplier.

The rates of a quaternion q of length 1 are q̇ = ½ q ∘ ω with ω along the axes of the body.
Lagrange's equations of its four parts, multiplied by ½ q ∘ e_k, are the equations along these axes,

    (I ω̇ + ω × I ω)_k = M_k,

without the multiplier, which acts along q (L. D. Landau and E. M. Lifshitz, *Mechanics*, 3rd ed.
1976, section 36).
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import factored
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.equations import EulerForm
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.step_values import rate_symbol, spin_symbol
from lagrange_cli.mechanics.system import Coordinate
from lagrange_cli.scene.bodies import Body, QuaternionTurn, rotation_term
from lagrange_cli.scene.language.expression import Expression

_ZERO = sp.Integer(0)
_HALF = sp.Rational(1, 2)
_AXES = "123"
#: Terms that a torque is multiplied out to, to use |q| = 1 in it.
_MOST_TERMS = 400


def euler_form(derivation: Uncertified) -> EulerForm | None:
    """Return Euler's equations; None unless the scene is one body, by a quaternion against space.

    The body turns about its centre of mass, wherever that moves, or about its origin, at rest.
    """
    reduced = derivation.reduced
    body = _lone_body(derivation)
    if body is None:
        return None
    parts = [reduced.names.convert(part) for part in lone_quaternion(body)]
    numbers = tuple(k for part in parts for k, c in enumerate(reduced.coordinates) if c.q == part)
    if len(numbers) != 4 or not _is_apart(derivation, body, numbers):
        return None
    tensor = _tensor(reduced, body, is_pivot=len(reduced.coordinates) == 4)
    spins = tuple(spin_symbol(body.name, axis) for axis in _AXES)
    quaternion = [reduced.coordinates[k] for k in numbers]
    steps = rates_of_quaternion([c.q for c in quaternion])
    loads = [_load(derivation, k) for k in numbers]
    torques = tuple(
        _torque([g * load for g, load in zip(step, loads, strict=True)], quaternion)
        for step in steps
    )
    motions = [derivation.velocity[s] for s in reduced.elements[0].centre]
    moving = sp.Add(*(v**2 for v in motions)) if len(reduced.coordinates) > 4 else _ZERO
    return EulerForm(
        body=body.name,
        numbers=numbers,
        spins=tuple(
            _scaled(sp.Integer(2), [2 * step[j] * c.v for j, c in enumerate(quaternion)])
            for step in steps
        ),
        inertia=tuple(_rate_of_momentum(tensor, spins, k) for k in range(3)),
        gyroscopic=tuple(_gyroscopic(tensor, spins, k) for k in range(3)),
        torques=torques,
        rates=tuple(
            _scaled(_HALF, [2 * step[j] * w for step, w in zip(steps, spins, strict=True)])
            for j in range(4)
        ),
        kinetic=reduced.masses[0] * moving / 2 + _energy(tensor, spins),
    )


def rates_of_quaternion(q: Sequence[sp.Expr]) -> list[list[sp.Expr]]:
    """Return ½ q ∘ e_k for each of the three axes: ∂q̇/∂ω_k."""
    a, b, c, d = q
    products = ([-b, a, d, -c], [-c, -d, a, b], [-d, c, -b, a])
    return [[_HALF * part for part in product] for product in products]


def _lone_body(derivation: Uncertified) -> Body | None:
    scene = derivation.reduced.scene
    if len(scene.particles) != 1 or derivation.contacts or len(derivation.closures) != 1:
        return None
    (body,) = scene.particles
    if not isinstance(body, Body) or body.on is not None:
        return None
    declared = [term for term in scene.kinetic if term.name != rotation_term(body.name)]
    return None if declared or not lone_quaternion(body) else body


def lone_quaternion(body: Body) -> tuple[Expression, ...]:
    """Return the parts of the quaternion that is the only turn of a body; none of others."""
    if len(body.turns) != 1 or not isinstance(body.turns[0], QuaternionTurn):
        return ()
    return body.turns[0].parts


def _is_apart(derivation: Uncertified, body: Body, numbers: Sequence[int]) -> bool:
    """Say whether no place moves with the quaternion, or nothing else moves."""
    reduced = derivation.reduced
    quaternion = {reduced.coordinates[k].q for k in numbers}
    speeds = {c.v for c in reduced.coordinates}
    if not speeds.isdisjoint(symbols_in(derivation.potential)):
        return False
    if not set(entries(derivation.closures[0].gradient)) <= set(numbers):
        return False
    places = [reduced.resolved[s] for s in reduced.elements[0].centre]
    if len(reduced.coordinates) == 4:
        rotation = [_resolved(reduced, e) for e in body.rotation]
        arm = [_resolved(reduced, part) for part in body.centre or ()] or [_ZERO] * 3
        turned = [
            sp.Add(*(r * a for r, a in zip(rotation[k : k + 3], arm, strict=True)))
            for k in (0, 3, 6)
        ]
        places = [sp.expand(p - e) for p, e in zip(places, turned, strict=True)]
        quaternion |= {reduced.names.t}
    elif body.centre is not None:
        return False
    return quaternion.isdisjoint({s for p in places for s in symbols_in(p)})


def _resolved(reduced: Reduced, expression: Expression) -> sp.Expr:
    return reduced.resolve(reduced.convert(expression))


def _tensor(reduced: Reduced, body: Body, *, is_pivot: bool) -> list[sp.Expr]:
    """Return the entries of the tensor about the centre of mass, or about a pivot beside it."""
    tensor = [_resolved(reduced, e) for row in body.inertia for e in row]
    if not is_pivot or body.centre is None:
        return tensor
    arm = [_resolved(reduced, part) for part in body.centre]
    square, mass = sp.Add(*(a**2 for a in arm)), reduced.masses[0]
    return [
        sp.expand(entry + mass * ((square if i == j else 0) - arm[i] * arm[j]))
        for entry, (i, j) in zip(tensor, ((i, j) for i in range(3) for j in range(3)), strict=True)
    ]


def _load(derivation: Uncertified, number: int) -> sp.Expr:
    """Q − ∂D/∂v − ∂V/∂q of a coordinate."""
    c = derivation.reduced.coordinates[number]
    forces = [force.generalized[number] for force in derivation.forces]
    drag, slope = (
        derivative(derivation.dissipation, c.v),
        derivative(derivation.potential, c.q),
    )
    return sp.Add(*forces, -drag, -slope)


def on_unit_sphere(expr: sp.Expr, quaternion: Sequence[sp.Expr], budget: int) -> sp.Expr | None:
    """Multiply out, with 1 less the other squares for the square of the first part: |q| = 1.

    None if there are more than ``budget`` terms.
    """
    terms = expand_terms(expr, budget)
    if terms is None:
        return None
    scalar, *vector = quaternion
    square = 1 - sp.Add(*(part**2 for part in vector))
    reduced = []
    for term in terms:
        power = term.as_powers_dict().get(scalar, _ZERO)
        if power.is_Integer and power > 1:
            term = term / scalar ** (2 * (power // 2)) * square ** (power // 2)
        reduced.append(term)
    return sp.expand(sp.Add(*reduced))


def _torque(works: Sequence[sp.Expr], quaternion: Sequence[Coordinate]) -> sp.Expr:
    """Sum the works of a small turn, shortened by |q| = 1."""
    total = sp.Add(*works)
    reduced = on_unit_sphere(total, [c.q for c in quaternion], _MOST_TERMS)
    return total if reduced is None else factored(sp.Add.make_args(reduced))


def _rate_of_momentum(tensor: Sequence[sp.Expr], spins: Sequence[sp.Symbol], k: int) -> sp.Expr:
    return sp.Add(*(tensor[3 * k + j] * rate_symbol(s.name) for j, s in enumerate(spins)))


def _gyroscopic(tensor: Sequence[sp.Expr], spins: Sequence[sp.Symbol], k: int) -> sp.Expr:
    """−(ω × I ω) along an axis, each product of components once."""
    i, j = (k + 1) % 3, (k + 2) % 3
    products: dict[sp.Expr, list[sp.Expr]] = {}
    for m, s in enumerate(spins):
        products.setdefault(spins[j] * s, []).append(tensor[3 * i + m])
        products.setdefault(spins[i] * s, []).append(-tensor[3 * j + m])
    return sp.Add(*(sp.Add(*moments) * both for both, moments in products.items()))


def _scaled(number: sp.Expr, terms: Sequence[sp.Expr]) -> sp.Expr:
    """Return a sum times a number, which is not multiplied out."""
    return sp.Mul(number, sp.Add(*terms), evaluate=False)


def _energy(tensor: Sequence[sp.Expr], spins: Sequence[sp.Symbol]) -> sp.Expr:
    groups: dict[sp.Expr, list[sp.Expr]] = {}
    for k, s in enumerate(spins):
        groups.setdefault(tensor[4 * k], []).append(s**2)
    squares = (_HALF * moment * sp.Add(*parts) for moment, parts in groups.items())
    mixed = (tensor[3 * j + k] * spins[j] * spins[k] for j, k in ((0, 1), (0, 2), (1, 2)))
    return sp.Add(*squares, *mixed)
