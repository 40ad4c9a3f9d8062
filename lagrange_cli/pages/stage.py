"""Parts of a drawing that moves: where each body is, by the functions of the emitted module.

What a sketch of the start finds (links, angles, wheels, curves) is kept here by what it hangs on
instead of by its place: a body is at numbers that ``positions`` or the state of the emitted module
give, so that the page can draw any state of any motion.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from sympy import Integer

from lagrange_cli.mechanics.depiction import joint_components
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.system import CartesianName, State
from lagrange_cli.notation.symbols import printable
from lagrange_cli.pictures.sketch.links import parts_of
from lagrange_cli.pictures.sketch.outlines import FACTORS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.mechanics.depiction import BodyOutline
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.pictures.sketch.configurations import Configurations
    from lagrange_cli.pictures.sketch.findings import Findings, Link
    from lagrange_cli.pictures.sketch.guides import Guide
    from lagrange_cli.pictures.sketch.links import Parts
    from lagrange_cli.pictures.sketch.view import View
    from lagrange_cli.pictures.sketch.wheels import Wheel

    Array: TypeAlias = NDArray[np.float64]

#: Significant digits of places of curves, and relative agreement of places that are the same.
_DIGITS, _SAME = 6, 1e-9

#: Most bodies with a name beside them.
_MOST_NAMED = 12


def drawn_equations(equations: Equations) -> Equations:
    """Return equations whose emitted ``positions`` have also what rigid bodies are drawn by.

    These are the places of points that the scene does not name, as their origins, and the vectors
    that span their outlines, behind the names of the scene.
    """
    depiction, system = equations.presentation.depiction, equations.system
    if depiction is None:
        return equations
    drawn = depiction.completed(system.particles, {c.q: c.is_angle for c in system.coordinates})
    added = drawn.points[len(depiction.points) :]
    vectors = [(point.position, point.components) for point in added]
    for body in depiction.bodies:
        vectors += zip(body.spans, _span_names(body), strict=True)
    names = (
        CartesianName(name, part, Integer(0))
        for vector, vector_names in vectors
        for part, name in zip(vector, vector_names, strict=True)
    )
    known = (*system.cartesian_names, *names)
    return replace(equations, system=replace(system, cartesian_names=known))


def with_held_states(equations: Equations) -> tuple[Equations, list[dict[str, Any]]]:
    """Return equations in which inputs that controllers hold are states, and the samplers.

    A sampler has the time between its samples, a number or that of a parameter where
    ``isParameter``, and ``changes``: pairs of numbers of the state with positions that are their
    next values, those of the ``held`` inputs first. The emitted ``positions`` have the laws behind
    the places.
    """
    system, initial = equations.system, equations.system.initial
    if not system.controllers or initial is None:
        return equations, []
    held_names = {name for c in system.controllers for name, _ in c.held_inputs}
    held_inputs = [u for u in system.inputs if u.name in held_names]
    held_states = tuple(State(u.name, u.symbol, Integer(0)) for u in held_inputs)
    states = (*system.states, *held_states)
    zeros = [0.0] * len(held_states)
    start = replace(
        initial,
        states=(*initial.states, *zeros),
        decimals=(*initial.decimals, *map(str, zeros)),
    )
    names = [*system.cartesian_names]
    first = 2 * len(system.coordinates)
    numbers = {state.name: first + k for k, state in enumerate(states)}
    parameters = [p.symbol for p in system.parameters]
    samplers = []
    for controller in system.controllers:
        changes = []
        for name, law in (*controller.held_inputs, *controller.memory):
            changes.append([numbers[name], len(names)])
            names.append(CartesianName(f"next value of {name}", law, Integer(0)))
        every = controller.every
        is_parameter = every in parameters
        samplers.append(
            {
                "every": parameters.index(every) if is_parameter else float(every),
                "isParameter": is_parameter,
                "changes": changes,
                "held": len(controller.held_inputs),
            }
        )
    changed = replace(
        system,
        inputs=tuple(u for u in system.inputs if u.name not in held_names),
        states=states,
        controllers=(),
        initial=start,
        cartesian_names=tuple(names),
    )
    return replace(equations, system=changed), samplers


def _span_names(body: BodyOutline) -> list[tuple[str, str, str]]:
    return [joint_components(f"span {k} of {body.name}") for k in range(len(body.spans))]


def stage_of(equations: Equations) -> dict[str, Any]:
    """Return what the page draws, as plain values.

    Parameters
    ----------
    equations
        Those that :func:`drawn_equations` returns.

    Returns
    -------
    dict
        ``bodies``: name, kind (``mass``, ``joint``, ``origin``) and ``at``, for each axis
        ``["position", k]``, ``["coordinate", k]`` or a number; for a pivot that no expression
        gives, ``about: [body, coordinate]``: it is halfway between the body and where half a turn
        of the coordinate would take it. ``links``: kind, two bodies, and the length of a rope that
        may be slack: a number, or that of a parameter where ``isParameter``. ``outlines`` of rigid
        bodies: the body, its shape, the sources of its spans, and factors of these along lines.
        ``wheels``, ``curves``, ``view`` (rows of the projection, whether it is flat) and ``down``.

    Raises
    ------
    InputError
        There are no particles and no points, or too many, or no start is known.
    """
    parts = parts_of(equations)
    known, down = parts.known, parts.down
    return {
        "bodies": list(_bodies(known)),
        "links": [_link(known, link) for link in known.links],
        "outlines": list(_outlines(parts)),
        "wheels": [_wheel(known.configurations, wheel) for wheel in parts.wheels],
        "curves": [_curve(known, guide) for guide in parts.curves],
        "view": _view(parts.view),
        "down": None if down is None else _numbers(down / np.linalg.norm(down)),
    }


def _bodies(known: Findings) -> Iterator[dict[str, Any]]:
    """Yield particles, points, the origin and pivots, numbered as in links."""
    components = known.configurations.components
    places = _sources(known.configurations.equations)
    for number, name in enumerate(known.names):
        kind = "mass" if known.is_particle(number) else "joint"
        if number < known.declared:
            shown = name if known.declared <= _MOST_NAMED else ""
            at = [places[component] for component in components[number]]
            yield {"name": printable(shown), "kind": kind, "at": at}
        elif name:
            yield {"name": "", "kind": "origin", "at": [0, 0, 0]}
        else:
            yield {"name": "", "kind": kind, **_pivot(known, number)}


def _sources(equations: Equations) -> dict[str, tuple[str, int]]:
    """Return where the emitted module has each Cartesian name: in its positions, or its state."""
    system = equations.system
    places = {c.name: ("coordinate", k) for k, c in enumerate(system.coordinates)}
    return places | {c.name: ("position", k) for k, c in enumerate(system.cartesian_names)}


def _link(known: Findings, link: Link) -> dict[str, Any]:
    shown: dict[str, Any] = {"kind": link.kind, "ends": list(link.ends)}
    if link.length is not None:
        sizes = [p.symbol for p in known.configurations.equations.system.parameters]
        is_parameter = link.size in sizes
        length = sizes.index(link.size) if is_parameter else link.length
        shown |= {"length": length, "isParameter": is_parameter}
    return shown


def _pivot(known: Findings, number: int) -> dict[str, Any]:
    """Return the body and the coordinate that turns it about a pivot, or the pivot's place."""
    for angle in known.angles:
        if angle.ends[0] == number and _is_halfway(known, number, angle.ends[1], angle.coordinate):
            return {"about": [angle.ends[1], angle.coordinate]}
    return {"at": _numbers(known.places[0, number])}


def _is_halfway(known: Findings, pivot: int, body: int, coordinate: int) -> bool:
    if body >= known.declared:
        return False
    configurations = known.configurations
    try:
        states = range(len(configurations.q))
        across = np.array([configurations.turned(coordinate, np.pi, k)[body] for k in states])
    except DomainError:
        return False
    off = np.abs((across + known.places[:, body]) / 2 - known.places[:, pivot])
    return bool(off.max() <= _SAME * configurations.size)


def _wheel(configurations: Configurations, wheel: Wheel) -> dict[str, Any]:
    """Return the particle at its centre, its plane, and where its radius and angle are found."""
    system = configurations.equations.system
    sizes = [p.symbol for p in system.parameters]
    ground = wheel.ground
    is_straight = ground is not None and len(ground) == 2
    return {
        "body": wheel.particle,
        "radius": sizes.index(wheel.size) if wheel.size in sizes else wheel.radius,
        "isParameter": wheel.size in sizes,
        "angle": _sources(configurations.equations).get(wheel.name),
        "normal": _numbers(wheel.normal),
        "towards": _numbers(wheel.towards),
        "ground": None if ground is None else [_numbers(place) for place in ground],
        "isStraight": is_straight,
    }


def _curve(known: Findings, guide: Guide) -> dict[str, Any]:
    """Return a curve with the parameters that it depends on: it is drawn where they are as here."""
    return {
        "points": [_numbers(place) for place in guide.curve.points],
        "parameters": _shaping(known, guide),
    }


def _shaping(known: Findings, guide: Guide) -> list[int] | None:
    """Return the parameters of a curve; None where it moves with time."""
    equations = known.configurations.equations
    depiction = known.configurations.depiction
    components = known.configurations.components[guide.particle]
    stated = [r.expression for r in depiction.relations]
    holding = [e for e in stated if any(s.name in components for s in e.free_symbols)]
    positions = [p.position for p in equations.system.particles]
    positions += [point.position for point in depiction.points]
    symbols = set().union(*(e.free_symbols for e in (*holding, *positions[guide.particle])))
    if equations.system.t in symbols:
        return None
    return [k for k, p in enumerate(equations.system.parameters) if p.symbol in symbols]


def _outlines(parts: Parts) -> Iterator[dict[str, Any]]:
    """Yield the shapes of rigid bodies that do not roll, whose rims wheels have."""
    places = _sources(parts.known.configurations.equations)
    rolling = {wheel.particle for wheel in parts.wheels}
    for number, body in parts.outlines.bodies:
        if number not in rolling:
            spans = [[places[name] for name in names] for names in _span_names(body)]
            lines = [[_numbers(row) for row in factors] for factors in FACTORS[body.kind]]
            yield {"body": number, "shape": body.kind, "spans": spans, "lines": lines}


def _view(view: View) -> dict[str, Any]:
    return {"rows": [_numbers(row) for row in view.matrix], "isFlat": view.is_flat}


def _numbers(values: Array) -> list[float]:
    """Return numbers in the digits that a picture needs, without negative zeros."""
    return [float(f"{value:.{_DIGITS}g}") + 0.0 for value in values]
