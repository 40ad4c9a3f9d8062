"""Euler's equations of one body, and the rates of what turns it over its angular velocity.

Of a quaternion q of length 1 these are q̇ = ½ q ∘ ω with ω along the axes of the body, of three
angles the inverse of ω = B(q) q̇, which ends where det B vanishes. Lagrange's equations of the
four parts or three angles, multiplied by ∂q̇/∂ω_k, are the equations along these axes,

    (I ω̇ + ω × I ω)_k = M_k,

without the multiplier of a quaternion, which acts along q (L. D. Landau and E. M. Lifshitz,
*Mechanics*, 3rd ed. 1976, sections 35 and 36).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.factor import factored
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.shorten import shortened
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
    """Return Euler's equations; None unless the scene is one body that turns freely in space.

    A quaternion or three angles turn it, about its centre of mass, wherever that moves, or about
    its origin, at rest.
    """
    reduced = derivation.reduced
    body = _lone_body(derivation)
    if body is None:
        return None
    spins = [_resolved(reduced, e) for e in body.spin]
    turned = _by_quaternion(reduced, body) or _by_angles(reduced, spins)
    if turned is None or not _is_apart(derivation, body, turned.numbers):
        return None
    coordinates = [reduced.coordinates[k] for k in turned.numbers]
    is_pivot = len(coordinates) == len(reduced.coordinates)
    tensor = _tensor(reduced, body, is_pivot=is_pivot)
    symbols = tuple(spin_symbol(body.name, axis) for axis in _AXES)
    loads = [_load(derivation, k) for k in turned.numbers]
    over_spins = _over_spins(turned.steps, symbols)
    moved = {c.v: sp.Add(*terms) for c, terms in zip(coordinates, over_spins, strict=True)}
    loads = [load.xreplace(moved) for load in loads]
    works = [[g * load for g, load in zip(step, loads, strict=True)] for step in turned.steps]
    motions = [derivation.velocity[s] for s in reduced.elements[0].centre]
    moving = _ZERO if is_pivot else sp.Add(*(v**2 for v in motions))
    if turned.is_quaternion:
        doubled = [[2 * g for g in step] for step in turned.steps]
        shown = tuple(
            _scaled(sp.Integer(2), [g * c.v for g, c in zip(step, coordinates, strict=True)])
            for step in doubled
        )
        rates = tuple(_scaled(_HALF, terms) for terms in _over_spins(doubled, symbols))
        torques = tuple(_torque(work, coordinates) for work in works)
    else:
        shown = tuple(spins)
        rates = tuple(map(_over_denominators, over_spins))
        torques = tuple(shortened(sp.Add(*work)) for work in works)
    return EulerForm(
        body=body.name,
        numbers=turned.numbers,
        spins=shown,
        inertia=tuple(_rate_of_momentum(tensor, symbols, k) for k in range(3)),
        gyroscopic=tuple(_gyroscopic(tensor, symbols, k) for k in range(3)),
        torques=torques,
        rates=rates,
        kinetic=reduced.masses[0] * moving / 2 + _energy(tensor, symbols),
    )


@dataclass(frozen=True)
class _Turned:
    """The coordinates that turn a body.

    Attributes
    ----------
    numbers
        Numbers of the four parts of a quaternion, or of three angles.
    steps
        ∂q̇/∂ω_k for each of the three axes.
    """

    numbers: tuple[int, ...]
    steps: Sequence[Sequence[sp.Expr]]

    @property
    def is_quaternion(self) -> bool:
        return len(self.numbers) == 4


def _by_quaternion(reduced: Reduced, body: Body) -> _Turned | None:
    parts = [reduced.names.convert(part) for part in lone_quaternion(body)]
    numbers = tuple(k for part in parts for k, c in enumerate(reduced.coordinates) if c.q == part)
    return _Turned(numbers, rates_of_quaternion(parts)) if len(numbers) == 4 else None


def _by_angles(reduced: Reduced, spins: Sequence[sp.Expr]) -> _Turned | None:
    """Return three coordinates over whose rates alone ω is linear, with the inverse of that."""
    present = {s for spin in spins for s in symbols_in(spin)}
    numbers = tuple(k for k, c in enumerate(reduced.coordinates) if c.v in present)
    if len(numbers) != 3:
        return None
    rates = [reduced.coordinates[k].v for k in numbers]
    slopes = sp.Matrix([[derivative(spin, v) for v in rates] for spin in spins])
    lacking = [
        spin - sp.Add(*(g * v for g, v in zip(row, rates, strict=True)))
        for spin, row in zip(spins, slopes.tolist(), strict=True)
    ]
    if any(sp.expand(e) != 0 for e in lacking):
        return None  # turned in time, too
    determinant = shortened(slopes.det(method="berkowitz"))
    if determinant == 0:
        return None
    inverse = slopes.adjugate().applyfunc(lambda e: shortened(shortened(e) / determinant))
    return _Turned(numbers, inverse.T.tolist())


def _over_spins(
    steps: Sequence[Sequence[sp.Expr]], symbols: Sequence[sp.Symbol]
) -> list[list[sp.Expr]]:
    """Terms of q̇ over the components of ω, of each coordinate."""
    return [
        [g * w for g, w in zip(column, symbols, strict=True)] for column in zip(*steps, strict=True)
    ]


def rates_of_quaternion(q: Sequence[sp.Expr]) -> list[list[sp.Expr]]:
    """Return ½ q ∘ e_k for each of the three axes: ∂q̇/∂ω_k."""
    a, b, c, d = q
    products = ([-b, a, d, -c], [-c, -d, a, b], [-d, c, -b, a])
    return [[_HALF * part for part in product] for product in products]


def _over_denominators(terms: Sequence[sp.Expr]) -> sp.Expr:
    """Sum terms, those over one denominator together."""
    numerators: dict[sp.Expr, list[sp.Expr]] = {}
    for term in terms:
        above, below = sp.fraction(term)
        numerators.setdefault(below, []).append(above)
    return sp.Add(*(factored(above) / below for below, above in numerators.items()))


def _lone_body(derivation: Uncertified) -> Body | None:
    scene = derivation.reduced.scene
    closures = tuple(closure.name for closure in derivation.closures)
    if len(scene.particles) != 1 or derivation.contacts or closures != scene.lengths:
        return None
    (body,) = scene.particles
    if not isinstance(body, Body) or body.on is not None or body.planar:
        return None
    declared = [term for term in scene.kinetic if term.name != rotation_term(body.name)]
    return None if declared else body


def lone_quaternion(body: Body) -> tuple[Expression, ...]:
    """Return the parts of the quaternion that is the only turn of a body; none of others."""
    if len(body.turns) != 1 or not isinstance(body.turns[0], QuaternionTurn):
        return ()
    return body.turns[0].parts


def _is_apart(derivation: Uncertified, body: Body, numbers: Sequence[int]) -> bool:
    """Say whether no place moves with the turn, or nothing else moves."""
    reduced = derivation.reduced
    turning = {reduced.coordinates[k].q for k in numbers}
    speeds = {c.v for c in reduced.coordinates}
    if not speeds.isdisjoint(symbols_in(derivation.potential)):
        return False
    for closure in derivation.closures:
        if not set(entries(closure.gradient)) <= set(numbers):
            return False
    places = [reduced.resolved[s] for s in reduced.elements[0].centre]
    if len(reduced.coordinates) == len(numbers):
        rotation = [_resolved(reduced, e) for e in body.rotation]
        arm = [_resolved(reduced, part) for part in body.centre or ()] or [_ZERO] * 3
        turned = [
            sp.Add(*(r * a for r, a in zip(rotation[k : k + 3], arm, strict=True)))
            for k in (0, 3, 6)
        ]
        places = [sp.expand(p - e) for p, e in zip(places, turned, strict=True)]
        turning |= {reduced.names.t}
    elif body.centre is not None:
        return False
    return turning.isdisjoint({s for p in places for s in symbols_in(p)})


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
