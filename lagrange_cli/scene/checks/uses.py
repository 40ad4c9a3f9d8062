"""Expressions of a scene, each with a description and the restrictions on its contents."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import Literal

from lagrange_cli.scene.bodies import Body
from lagrange_cli.scene.conditions import InitialValue
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.model import Particle, Point, Scene
from lagrange_cli.scene.reading.declarations import AXES


@dataclass(frozen=True, slots=True)
class Restrictions:
    """Restrictions on an expression at one place of a scene.

    Attributes
    ----------
    rate
        Largest number of time derivatives.
    smooth
        True if all functions must have a derivative everywhere.
    names
        ``all``; ``time``: t and constants; ``constants``; or ``parameters`` alone.
    inputs
        True if inputs may occur, whose rates are not known.
    states
        True if states may occur.
    switches
        True if states with two values may occur where states may.
    multipliers
        True if names ``lambda_...`` may occur, whether or not the constraint exists.
    momenta
        True if names ``p_...`` may occur, whether or not the coordinate exists.
    hint
        Hint of a refusal by ``rate`` or ``smooth``, and of one of multipliers.
    """

    rate: int = 0
    smooth: bool = False
    names: Literal["all", "time", "constants", "parameters"] = "all"
    inputs: bool = False
    states: bool = False
    switches: bool = True
    multipliers: bool = False
    momenta: bool = False
    hint: str = ""


_POSITION = Restrictions(smooth=True)
_CONSTRAINT = Restrictions(rate=1, smooth=True)
_ONE_SIDED = Restrictions(
    smooth=True,
    hint="a one-sided constraint holds positions and t, in functions with a derivative;"
    "\nx >= abs(y) is two inequalities: [x >= y, x >= -y]",
)
_DYNAMICS = Restrictions(rate=1, inputs=True, states=True)
_POTENTIAL = replace(_DYNAMICS, switches=False)
_ENERGY = Restrictions(rate=1, inputs=True)
_RATE = Restrictions(
    rate=1,
    inputs=True,
    states=True,
    hint="accelerations and multipliers follow from the states: a rate holds positions, velocities,"
    " states, inputs and t",
)
_SAMPLED = Restrictions(
    rate=1,
    inputs=True,
    states=True,
    hint="accelerations jump at samples: a controller has positions, velocities, states, inputs, t",
)
_CONDITION = replace(
    _RATE,
    hint="accelerations and multipliers change where it switches: a condition holds positions,"
    " velocities, states, inputs and t",
)
_NUMBER = Restrictions(names="parameters")
_CANONICAL = Restrictions(inputs=True, states=True, momenta=True)
_MOTION = Restrictions(rate=2, inputs=True, states=True, multipliers=True)


@dataclass(frozen=True, slots=True)
class Use:
    """An expression at its place.

    Attributes
    ----------
    expression
        The expression as parsed.
    what
        Description of its place, which completes ``unknown name 'a' in ...``.
    place
        Restrictions on what may stand there.
    """

    expression: Expression
    what: str
    place: Restrictions


def uses(scene: Scene, cartesian: Iterable[str]) -> Iterator[Use]:
    """Yield every expression of a scene; ``cartesian`` are the names of positions."""
    for parameter in scene.parameters:
        if parameter.value:
            yield Use(parameter.value, f"parameter '{parameter.name}'", _NUMBER)
    for declared in scene.inputs:
        if declared.expression:
            yield Use(declared.expression, f"input '{declared.name}'", Restrictions(names="time"))
    for state in scene.states:
        yield Use(state.rate, f"the rate of state '{state.name}'", _RATE)
        if state.switch is not None:
            yield from _sides(state.switch.on, f"'on' of state '{state.name}'", _CONDITION)
            yield from _sides(state.switch.off, f"'off' of state '{state.name}'", _CONDITION)
    for controller in scene.controllers:
        yield Use(controller.every, "'every' of a controller", _NUMBER)
        for value in controller.values:
            yield Use(value.expression, f"what a controller makes of '{value.name}'", _SAMPLED)
    for particle in scene.particles:
        word = "body" if isinstance(particle, Body) else "particle"
        what = f"the mass of {word} '{particle.name}'"
        yield Use(particle.mass, what, Restrictions(names="constants"))
        yield from _positions(particle, word)
        if isinstance(particle, Body):
            yield from _turning(particle)
    for point in scene.points:
        yield from _positions(point, "point")
    names = frozenset(cartesian)
    for definition in scene.definitions:
        place = _POSITION if definition.name in names else _DYNAMICS
        yield Use(definition.expression, f"definition '{definition.name}'", place)
    yield from _mechanics(scene)
    yield from _numbers(scene)
    yield from _expectations(scene)


def _positions(body: Particle | Point, word: str) -> Iterator[Use]:
    for axis, entry in zip(AXES, body.position, strict=True):
        yield Use(entry, f"the {axis} position of {word} '{body.name}'", _POSITION)


def _turning(body: Body) -> Iterator[Use]:
    for entry in body.rotation:
        yield Use(entry, f"the turns of body '{body.name}'", _POSITION)
    for row in body.inertia:
        for moment in row:
            what = f"the inertia of body '{body.name}'"
            yield Use(moment, what, Restrictions(names="constants"))


def _mechanics(scene: Scene) -> Iterator[Use]:
    for constraint in scene.constraints:
        for equation in constraint.equations:
            what = f"constraint '{constraint.name}'"
            yield from _sides(equation, what, _CONSTRAINT)
        for constant in () if constraint.joint is None else constraint.joint.constants:
            what = f"constraint '{constraint.name}'"
            yield Use(constant, what, Restrictions(names="constants"))
    for one_sided in scene.unilateral:
        what = f"constraint '{one_sided.name}'"
        yield from _sides(one_sided.inequality, what, _ONE_SIDED)
        if one_sided.restitution:
            yield Use(one_sided.restitution, f"'restitution' of {what}", _NUMBER)
    for term in scene.potentials:
        yield Use(term.expression, f"potential '{term.name}'", _POTENTIAL)
    for term in scene.kinetic:
        yield Use(term.expression, f"kinetic energy '{term.name}'", _ENERGY)
    for force in scene.forces:
        for entry in force.components:
            yield Use(entry, f"force '{force.name}'", _DYNAMICS)
    for term in scene.dissipation:
        yield Use(term.expression, f"dissipation '{term.name}'", _DYNAMICS)
    for term in scene.outputs:
        yield Use(term.expression, f"output '{term.name}'", _DYNAMICS)


def _sides(equation: Equation, what: str, place: Restrictions) -> Iterator[Use]:
    yield Use(equation.left, what, place)
    yield Use(equation.right, what, place)


def _numbers(scene: Scene) -> Iterator[Use]:
    yield from _values(scene.initial, "'initial'")
    yield from _values(scene.near, "'near'")
    simulate = scene.simulate
    for key in ("until", "start", "accuracy", "samples", "step", "rtol", "atol"):
        expression = getattr(simulate, key)
        if expression:
            shown = "from" if key == "start" else key
            yield Use(expression, f"'{shown}' of 'simulate'", _NUMBER)


def _values(values: Iterable[InitialValue], section: str) -> Iterator[Use]:
    for value in values:
        yield Use(value.value, section, _NUMBER)


def _expectations(scene: Scene) -> Iterator[Use]:
    expect = scene.expect
    for equation in expect.equations or ():
        yield from _sides(equation, "'equations' of 'expect'", _MOTION)
    if expect.lagrangian:
        yield Use(expect.lagrangian, "'lagrangian' of 'expect'", _DYNAMICS)
    if expect.hamiltonian:
        yield Use(expect.hamiltonian, "'hamiltonian' of 'expect'", _CANONICAL)
    for state in expect.states:
        yield Use(state.time, "'state' of 'expect'", _NUMBER)
        yield Use(state.within, "'state' of 'expect'", _NUMBER)
        yield from _values(state.values, "'state' of 'expect'")
    for event in expect.events:
        for number in filter(None, (event.time, event.within)):
            yield Use(number, "'events' of 'expect'", _NUMBER)
    for _, bound in expect.drift:
        yield Use(bound, "'drift' of 'expect'", _NUMBER)
