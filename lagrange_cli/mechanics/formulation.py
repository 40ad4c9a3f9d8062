"""Choice of formulation: few coordinates, or many with multipliers.

``minimal`` keeps as few coordinates as there are degrees of freedom; its mass matrix is
full where positions hold many of them, and solving with it costs the cube of their
number. ``multiplier`` keeps Cartesian names with closures (:mod:`.reduction.cartesian_form`), of
which each holds few: elimination in a good order costs little more than there are entries. A body
that three angles turn has a quaternion there.
Predicted are operations of one right-hand side, from sizes and from which name stands in
which equation alone.

Declared coordinates may be related by integrated rates: ``a*dot(phi) = (R + a)*dot(theta)`` is kept
beside the coordinates with a multiplier, since both were asked for. Where as few coordinates as
degrees of freedom are asked for instead, its integral gives one of them by the other.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Mark, Problem, SingularError
from lagrange_cli.mechanics.algebra.derivatives import Kinematics
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified, derive_uncertified
from lagrange_cli.mechanics.dynamics.singular_configurations import (
    MOST_COORDINATES,
    conserved_momenta,
)
from lagrange_cli.mechanics.elimination.solve_equation import linear_parts, solves_everywhere
from lagrange_cli.mechanics.findings import FormulationChoice
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.initial.projection import state_of
from lagrange_cli.mechanics.initial.state import initial_state
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.reduction.cartesian_form import cartesian_form, closure_incidence
from lagrange_cli.mechanics.reduction.no_minimal_form import no_minimal_form_error
from lagrange_cli.mechanics.reduction.reduce import reduce
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import must_stay
from lagrange_cli.mechanics.symbols.values import evaluated
from lagrange_cli.mechanics.system import CartesianName, InitialState, ReplacedChart
from lagrange_cli.scene.checks.table import name_table
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading.quaternions import by_quaternions, replaced_angles

#: Ratio of predicted operations above which multipliers are taken: the prediction is rough, and
#: minimal form is kept where it may be as good. These numbers count operations of emitted code by
#: its statements; none is tuned.
_CLEARLY = 2
#: Operations of minimal form below which nothing is to be gained.
_WORTHWHILE = 400
#: Operations of a product of derivatives in M and f.
_PRODUCT = 12
#: Operations of an entry of a closure's gradient, with its part of the bias.
_ENTRY = 6
#: Further operations of a closure.
_CLOSURE = 4

#: Decimal digits of a state that is carried over to other coordinates.
_DIGITS = 50


def reduced_for(scene: Scene, wanted: Formulation) -> tuple[Reduced, tuple[str, ...]]:
    """The scene reduced, with remarks.

    If a branch of a constraint ends at the initial state and all declared coordinates are
    Cartesian names, the coordinates are left to be chosen: the constraint stays as a closure.

    Raises
    ------
    InputError
        As :func:`.reduction.reduce.reduce`.
    """
    try:
        reduced = reduce(scene)
        return minimal_form(reduced) if wanted == "minimal" else reduced, ()
    except SingularError as refusal:
        if wanted == "minimal":
            raise
        names = Names(scene)
        if not names.coordinates.keys() <= names.cartesian.keys():
            raise
        try:
            undeclared = reduce(replace(scene, coordinates=None))
        except InputError:
            raise refusal from None
        if not undeclared.closures:
            raise
        return undeclared, (
            "in multiplier form: the declared coordinates are singular at the initial state",
        )


def in_formulation(
    reduced: Reduced, wanted: Formulation
) -> tuple[Reduced, FormulationChoice | None]:
    """The scene in the form that is wanted, and why it is this one.

    ``auto`` keeps declared coordinates. Without any it takes closures if clearly fewer
    operations are predicted for them.

    Returns
    -------
    The scene, and the choice; None if there was none to make.

    Raises
    ------
    InputError
        There is no such form.
    """
    if reduced.closures:
        if wanted == "minimal":
            raise no_minimal_form_error(reduced)
        return reduced, None
    incidence = None if reduced.scene.unilateral else closure_incidence(reduced)
    if wanted == "multiplier":
        return _multiplier_form(reduced, incidence)
    if not incidence:
        return reduced, None
    minimal, multiplier = _minimal(reduced), _multiplier(incidence)
    cheaper = minimal > _WORTHWHILE and _CLEARLY * multiplier < minimal
    declared = reduced.scene.coordinates is not None
    if wanted == "auto" and cheaper and not declared:
        form = cartesian_form(reduced)
        if form is not None and form.closures:
            return form, FormulationChoice("multiplier", minimal, multiplier, "fewer operations")
    why = "as asked" if wanted == "minimal" else "the coordinates are declared" if cheaper else ""
    return reduced, FormulationChoice("minimal", minimal, multiplier, why)


def _multiplier_form(
    reduced: Reduced, incidence: Sequence[frozenset[sp.Symbol]] | None
) -> tuple[Reduced, FormulationChoice | None]:
    """The scene with closures: with Cartesian names, or with quaternions if those replace nothing.

    Raises
    ------
    InputError
        There is no such form.
    """
    form = cartesian_form(reduced) if incidence else None
    if form is None or not form.closures or _holds_all_coordinates(form, reduced):
        turned = _quaternion_form(reduced)
        if turned is not None:
            return turned, None
    if form is None or not form.closures or not incidence:
        raise _no_multiplier(reduced)
    predicted = _minimal(reduced), _multiplier(incidence)
    return form, FormulationChoice("multiplier", *predicted, "as asked")


def _holds_all_coordinates(form: Reduced, reduced: Reduced) -> bool:
    """Tell whether a form replaces no coordinate, and merely has more."""
    return {c.q for c in reduced.coordinates} <= {c.q for c in form.coordinates}


def _quaternion_form(reduced: Reduced) -> Reduced | None:
    """Return the scene with quaternions in place of three angles that turn a body.

    None if no body is turned by three angles that the scene names nowhere else.
    """
    scene = reduced.scene
    form = None if scene.unilateral else by_quaternions(scene, name_table(scene))
    if form is None:
        return None
    turned = reduce(form.scene)
    parts = {
        turned.names.coordinates[name]: reduced.resolve(reduced.convert(part))
        for name, part in form.parts.items()
    }
    return replace(turned, origin=replace(reduced, resolved={**reduced.resolved, **parts}))


def _no_multiplier(reduced: Reduced) -> InputError:
    scene = reduced.scene
    constraint = scene.constraints[0].mark if scene.constraints else None
    what = "no constraint is left to keep beside Cartesian names"
    if not scene.particles:
        what = "there are no particles whose positions could be constrained"
    elif scene.unilateral:
        what = "beside one-sided constraints coordinates stay as they are"
    return InputError(
        Problem(
            f"there is no form with multipliers: {what}",
            constraint or scene.coordinates_mark or Mark(scene.file, 1, 1),
            hint="leave the formulation out, or take minimal",
            rule="formulation",
        )
    )


# Predicted operations.


def _minimal(reduced: Reduced) -> int:
    """Products of derivatives in M and f, and elimination of a full matrix.

    If positions are linear in the coordinates, M is constant and f has no such products.
    """
    q = {c.q for c in reduced.coordinates}
    number = {c.q: j for j, c in enumerate(reduced.coordinates)}
    coupled = [0] * len(number)  # coordinates that stand in a position with each, as bits
    constant = True
    for place in {reduced.resolved[s] for body in reduced.names.particle_symbols for s in body}:
        numbers = [number[s] for s in symbols_in(place) if s in number]
        bits = sum(1 << j for j in numbers)
        for j in numbers:
            coupled[j] |= bits
        constant = constant and _is_linear(place, q)
    n = len(q)
    pairs = (sum(map(int.bit_count, coupled)) + sum(map(bool, coupled))) // 2
    full = 2 * n**2 + (0 if constant else n**3 // 3)
    solve = n if all(bits.bit_count() <= 1 for bits in coupled) else full
    return solve + (0 if constant else _PRODUCT * pairs)


def _is_linear(place: sp.Expr, q: set[sp.Symbol]) -> bool:
    """Tell whether every term is a coordinate times what does not move."""
    return all(
        sum(not symbols_in(f).isdisjoint(q) for f in sp.Mul.make_args(term)) <= 1
        and all(f in q or symbols_in(f).isdisjoint(q) for f in sp.Mul.make_args(term))
        for term in sp.Add.make_args(place)
    )


def _multiplier(incidence: Iterable[frozenset[sp.Symbol]]) -> int:
    """Gradients and their products, and elimination of closures, the least connected first."""
    closures = list(incidence)
    holders: dict[sp.Symbol, list[int]] = {}
    for k, names in enumerate(closures):
        for s in names:
            holders.setdefault(s, []).append(k)
    near: dict[int, set[int]] = {k: set() for k in range(len(closures))}
    for numbers in holders.values():
        for k in numbers:
            near[k].update(numbers)
    operations = sum(_CLOSURE + _ENTRY * len(names) for names in closures)
    operations += sum(len(numbers) ** 2 for numbers in holders.values())
    return operations + _elimination(near)


def _elimination(near: Mapping[int, set[int]]) -> int:
    """Operations of eliminating the nodes of a graph, the least connected first."""
    left = {k: neighbours - {k} for k, neighbours in near.items()}
    operations = 0
    while left:
        k = min(left, key=lambda k: (len(left[k]), k))
        neighbours = left.pop(k)
        operations += len(neighbours) ** 2 + 5 * len(neighbours) + 1
        for j in neighbours:
            left[j] |= neighbours
            left[j] -= {j, k}
    return operations


# The initial state.


@dataclass(frozen=True)
class _Late:
    """A reduced scene whose mass matrix is derived when it is asked for."""

    reduced: Reduced

    @cached_property
    def mass(self) -> Sequence[Mapping[int, Sequence[sp.Expr]]]:
        return derive_uncertified(self.reduced).mass


def starting_state(derivation: Uncertified, chart: ReplacedChart | None) -> InitialState | None:
    """The initial state; from the coordinates of the scene where these have replaced them.

    Raises
    ------
    InputError
        As :func:`.initial.state.initial_state`.
    """
    reduced = derivation.reduced
    origin = reduced.origin
    if origin is None or all(_is_known(reduced, e.name) for e in reduced.scene.initial):
        return initial_state(derivation)
    assert chart is not None  # it is what has replaced the coordinates of the origin
    former = chart.start or initial_state(_Late(origin))
    return None if former is None else _carried_over(origin, chart, former)


def _is_known(reduced: Reduced, name: str) -> bool:
    symbol = reduced.names.lookup(name)
    return symbol in reduced.resolved or symbol in {c.q for c in reduced.coordinates}


def replaced_chart(derivation: Uncertified) -> ReplacedChart | None:
    """The coordinates that the scene's own form has where these have replaced them."""
    reduced = derivation.reduced
    origin = reduced.origin
    if origin is None:
        return None
    try:
        former = initial_state(_Late(origin))
    except InputError:
        former = None  # the start has no place in these coordinates
    turns = tuple(replaced_angles(origin.scene, reduced.scene))
    positions = {c.q: origin.resolved.get(c.q, c.q) for c in reduced.coordinates}
    q, v = [c.q for c in origin.coordinates], [c.v for c in origin.coordinates]
    kinematics = Kinematics(positions, q, v, origin.names.t)
    named = tuple(
        CartesianName(s.name, place, sp.Add(*kinematics.velocity(s)))
        for s, place in positions.items()
    )
    # Past gimbal lock any angles serve that give the orientation, whatever is conserved.
    is_asked = len(origin.coordinates) <= MOST_COORDINATES and not turns
    steady = conserved_momenta(derive_uncertified(origin)) if is_asked else ()
    return ReplacedChart(origin.coordinates, named, former, steady, turns)


def _carried_over(origin: Reduced, chart: ReplacedChart, former: InitialState) -> InitialState:
    """Positions and velocities in other coordinates."""
    state = former.decimals or tuple(map(repr, (*former.positions, *former.velocities)))
    symbols = [*(c.q for c in origin.coordinates), *(c.v for c in origin.coordinates)]
    with mpmath.workdps(_DIGITS):
        point = dict(zip(symbols, map(mpf, state), strict=True))
        for name, value in origin.values.exact.items():
            point[origin.names.parameters[name]] = evaluated(value, _DIGITS)
        point[origin.names.t] = origin.reference[origin.names.t]
        q = evaluate([place.position for place in chart.places], point)
        v = evaluate([place.velocity for place in chart.places], point)
        carried = state_of(q, v, former.projected)
    return carried if former.decimals else replace(carried, decimals=())


def minimal_form(reduced: Reduced) -> Reduced:
    """Eliminate declared coordinates that closures give by others at all configurations.

    Raises
    ------
    InputError
        As :func:`.reduce.reduce`.
    """
    while (name := _given_by_others(reduced)) is not None:
        scene = reduced.scene
        remaining = tuple(c for c in scene.coordinates or () if c.name != name)
        reduced = reduce(
            replace(scene, coordinates=remaining, eliminated=(*scene.eliminated, name))
        )
    return reduced


def _given_by_others(reduced: Reduced) -> str | None:
    """A declared coordinate that a closure is linear in, and that no force acts on.

    The last declared, those that the scene asks for only where there are no others.
    """
    scene, names = reduced.scene, reduced.names
    constants = frozenset(names.parameters.values())
    forced = {force.on for force in scene.forces}
    candidates = []
    for closure in reduced.closures:
        phi = closure.left - closure.right
        if closure.kind != "position" or any(
            c.q in phi.free_symbols for c in reduced.coordinates if c.name not in names.coordinates
        ):
            continue  # what is not declared is to be eliminated, not what is
        for name, q in names.coordinates.items():
            parts = linear_parts(phi, q) if q in phi.free_symbols and name not in forced else None
            if parts is not None and solves_everywhere(*parts, constants):
                candidates.append(name)
    candidates.sort(key=lambda name: (not must_stay(scene, name), [*names.coordinates].index(name)))
    return candidates[-1] if candidates else None
