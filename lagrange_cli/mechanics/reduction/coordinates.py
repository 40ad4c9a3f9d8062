"""Generalized coordinates of a geometry: sizes, periods, random points over them, closures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import sympy as sp
from mpmath import mpf

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.constraint_manifold import Manifold
from lagrange_cli.mechanics.numerics.sampling import Sampler, typical_length
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation, Geometry
from lagrange_cli.mechanics.symbols.values import ParameterValues
from lagrange_cli.mechanics.system import Coordinate
from lagrange_cli.scene.bodies import Frame, Motion, bodies_of
from lagrange_cli.scene.checks.table import latex_names
from lagrange_cli.scene.language.expression import Name
from lagrange_cli.scene.model import Scene

#: Seed of random points: a comment in the scene changes nothing of what is found at them.
SEED = "points of a chart"


@dataclass(frozen=True)
class Chart:
    """Coordinates of a geometry, and values from which its points are drawn.

    Attributes
    ----------
    values
        Values of parameters.
    geometry
        Positions over the coordinates.
    coordinates
        The coordinates.
    """

    values: ParameterValues
    geometry: Geometry
    coordinates: tuple[Coordinate, ...]


def generalized_coordinates(
    geometry: Geometry, closures: Sequence[ClosureEquation]
) -> Iterator[Coordinate]:
    """Yield declared coordinates and open names with their units, texts and places in the scene."""
    scene = geometry.names.scene
    declared = {c.name: c for c in scene.coordinates or ()}
    expressions = [geometry.resolved[s] for s in geometry.positions]
    expressions += [side for r in (*closures, *geometry.gaps) for side in (r.left, r.right)]
    periodic = periodic_symbols(expressions)
    unplaced = set(geometry.coordinates).difference(*map(symbols_in, expressions))
    if unplaced:
        absent = unplaced.difference(*map(symbols_in, geometry.terms))
        turning = _turning_names(scene)
        periodic |= unplaced & periodic_symbols(geometry.terms)
        periodic |= {q for q in absent if q.name in turning}
    joints = (c.joint for c in scene.constraints if c.joint is not None)
    quaternions = {part.text for joint in joints for part in joint.quaternions}
    latex = {name: text for name, text, _ in latex_names(scene)}
    for q in geometry.coordinates:
        written = declared.get(q.name)
        unit = written.unit if written else None
        yield Coordinate(
            name=q.name,
            q=q,
            v=sp.Symbol(f"dot({q.name})", real=True),
            a=sp.Symbol(f"ddot({q.name})", real=True),
            is_angle=unit == "rad" or (q in periodic and not (unit and q in unplaced)),
            is_of_quaternion=q.name in quaternions,
            unit=unit,
            description=written.description if written else None,
            latex=(written.latex if written else None) or latex.get(q.name),
            mark=written.mark if written else scene.coordinates_mark,
        )


def _turning_names(scene: Scene) -> set[str]:
    """Names that are angles of turns of bodies, or of frames below them."""
    names: set[str] = set()
    for body in bodies_of(scene):
        frame: Frame | None = body.frame
        while frame is not None:
            motions = (motion for motion in frame.motions if isinstance(motion, Motion))
            turns = (motion.amount.node for motion in motions if motion.is_turn)
            names.update(node.name for node in turns if isinstance(node, Name))
            frame = frame.parent
    return names


def scales(chart: Chart) -> dict[sp.Symbol, mpf]:
    """Size of the motion of each coordinate."""
    names, reference = chart.geometry.names, chart.geometry.reference
    angles = {c.q for c in chart.coordinates if c.is_angle}
    no_lengths = {*names.parameters.values(), *angles, names.t}
    length = typical_length([x for s, x in reference.items() if s not in no_lengths])
    center = {c.q: reference.get(c.q, mpf(0)) for c in chart.coordinates}
    return {q: mpf(1) if q in angles else max(length, abs(x)) for q, x in center.items()}


def sampler_of(
    chart: Chart, domain: list[sp.Expr], manifold: Manifold, seed: str = SEED
) -> Sampler:
    names, reference = chart.geometry.names, chart.geometry.reference
    exact = chart.values.exact
    gaps = (gap.left - gap.right for gap in chart.geometry.gaps)
    return Sampler(
        names.t,
        [c.q for c in chart.coordinates],
        {names.parameters[n]: reference[names.parameters[n]] for n in exact},
        [*(s for n, s in names.parameters.items() if n not in exact), *names.external_symbols],
        {c.q: reference.get(c.q, mpf(0)) for c in chart.coordinates},
        scales(chart),
        [*chart.geometry.resolved.values(), *gaps, *domain],
        seed=seed,
        place=manifold.placed if manifold.all else None,
        positive=[e for _, e in positive_places(chart.geometry)],
    )


def positive_places(geometry: Geometry) -> list[tuple[str, sp.Expr]]:
    """Names that are declared to stay above zero, with their expressions over coordinates.

    A coordinate that the constraints have eliminated is an expression in the others.
    """
    moving = {q.name: q for q in geometry.coordinates}
    places = {**{s.name: e for s, e in geometry.resolved.items()}, **moving}
    return [(name, places[name]) for name in sorted(geometry.names.scene.positive & places.keys())]


def manifold_of(chart: Chart, closures: Sequence[ClosureEquation]) -> Manifold:
    names = chart.geometry.names
    return Manifold(
        [(r.left, r.right) for r in closures if r.kind == "position"],
        [r.left - r.right for r in closures if r.kind == "velocity"],
        names.t,
        [c.q for c in chart.coordinates],
        [c.v for c in chart.coordinates],
        list(names.parameters.values()),
        scales(chart),
    )


def periodic_symbols(positions: Iterable[sp.Expr]) -> set[sp.Symbol]:
    """Collect symbols that enter the positions only through 2π-periodic functions.

    A symbol does where every occurrence stands under sin, cos or tan in an
    argument ``k·q + rest`` with an integer k.
    """
    present: set[sp.Symbol] = set()
    aperiodic: set[sp.Symbol] = set()
    seen: set[sp.Expr] = set()
    stack = list(positions)
    while stack:
        top = stack.pop()
        if top in seen:
            continue
        seen.add(top)
        if top.is_Symbol:
            present.add(top)
            aperiodic.add(top)
        elif top.func in (sp.sin, sp.cos, sp.tan):
            argument = top.args[0]
            inside = symbols_in(argument)
            present |= inside
            aperiodic |= {q for q in inside if argument != q and not argument.diff(q).is_Integer}
        else:
            stack.extend(top.args)
    return present - aperiodic
