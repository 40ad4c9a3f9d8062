"""From a scene to generalized coordinates: 3N Cartesian components, K constraints, 3N − K.

The reduction eliminates Cartesian names (:mod:`elimination`), keeps the equations that
have no closed form in one chart (:mod:`selection`), looks at what came of the others
(:mod:`account`) and yields every raw symbol as a function of q and t.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.account import (
    balance,
    level_remarks,
    level_warnings,
    with_levels,
)
from lagrange_cli.mechanics.angles import periodic_symbols
from lagrange_cli.mechanics.contradictions import explained, nowhere
from lagrange_cli.mechanics.elimination import Elimination, ImpossibleError, Stated, eliminate
from lagrange_cli.mechanics.equations import Account, Coordinate
from lagrange_cli.mechanics.geometry import Geometry, Restriction, related
from lagrange_cli.mechanics.language import Rate, total_derivative
from lagrange_cli.mechanics.manifold import Manifold
from lagrange_cli.mechanics.masses import mass_of
from lagrange_cli.mechanics.names import Names
from lagrange_cli.mechanics.parameters import Values
from lagrange_cli.mechanics.refusals import require_enough
from lagrange_cli.mechanics.sampling import Drawn, Sampler, typical_length, working_digits
from lagrange_cli.mechanics.selection import independent_closures, require_determined
from lagrange_cli.mechanics.terms import tidy
from lagrange_cli.mechanics.velocity import Level, independent_levels, integrals
from lagrange_cli.scene.expression import Equation
from lagrange_cli.scene.model import Scene

__all__ = ["Reduced", "in_coordinates", "reduce"]

#: Decimal digits of the numbers that tests of identity and rank work with.
_DIGITS = 30

#: Configurations at which identities and ranks are looked at.
POINTS = 3

#: The same on closures of many coordinates: what is constant is told from what is not.
FEWEST_POINTS = 2


@dataclass(frozen=True)
class Chart:
    """Coordinates of a geometry, with what points are drawn from."""

    values: Values
    geometry: Geometry
    coordinates: tuple[Coordinate, ...]


@dataclass(frozen=True)
class Reduced:
    """A scene over its generalized coordinates.

    Attributes
    ----------
    resolved
        Raw symbol → r(q, t).
    masses
        One expression for each particle.
    reference
        Values of symbols that ``initial`` and ``near`` give.
    closures
        Independent equations that restrict the coordinates and their velocities.
    origin
        The scene as it was reduced, where these coordinates replace others.
    """

    scene: Scene
    names: Names
    values: Values
    coordinates: tuple[Coordinate, ...]
    resolved: Mapping[sp.Symbol, sp.Expr]
    masses: tuple[sp.Expr, ...]
    account: Account
    reference: Mapping[sp.Symbol, mpf]
    warnings: tuple[Problem, ...]
    remarks: tuple[str, ...]
    closures: tuple[Restriction, ...]
    chart: Chart
    origin: Reduced | None = None

    def resolve(self, expr: sp.Expr) -> sp.Expr:
        """``expr`` with raw symbols replaced by their r(q, t)."""
        present = {s: self.resolved[s] for s in expr.free_symbols if s in self.resolved}
        return expr.xreplace(present) if present else expr

    @property
    def scales(self) -> Mapping[sp.Symbol, mpf]:
        """Size of the motion of each coordinate."""
        return _scales(self.chart)

    @property
    def gaps(self) -> tuple[Restriction, ...]:
        """One-sided constraints, ``left`` ≥ ``right``."""
        return self.chart.geometry.gaps

    @property
    def rate(self) -> Rate:
        """Total time derivative of an expression over raw symbols, q, v and t.

        Raw symbols move with ṙ(q, v, t); velocities with accelerations.
        """
        return partial(_rate, self)

    def sampler(self, domain: list[sp.Expr]) -> Sampler:
        """Random feasible configurations at which ``domain`` is real as well."""
        return _sampler(self.chart, domain, self.manifold())

    def manifold(self, gaps: Sequence[Restriction] = ()) -> Manifold:
        """The states that the closures leave, and ``gaps`` that are closed."""
        return _manifold(self.chart, [*self.closures, *gaps]) if gaps else self._manifold

    @cached_property
    def _manifold(self) -> Manifold:
        return _manifold(self.chart, self.closures)


def _rate(reduced: Reduced, expr: sp.Expr) -> sp.Expr:
    motion = [(c.q, c.v) for c in reduced.coordinates]
    accelerated = [*motion, *((c.v, c.a) for c in reduced.coordinates)]
    moving = {c.q for c in reduced.coordinates}
    t = reduced.names.t
    chain = list(accelerated)
    for symbol in sorted(expr.free_symbols & reduced.resolved.keys(), key=str):
        if symbol not in moving:
            chain.append((symbol, total_derivative(reduced.resolved[symbol], t, motion)))
    return total_derivative(expr, t, chain)


def reduce(scene: Scene) -> Reduced:
    """Reduce a scene to generalized coordinates.

    Raises
    ------
    InputError
        Located and explained: too few or too many coordinates, constraints that
        contradict each other, a branch that nothing chooses, a mass that is not positive.
    """
    with mpmath.workdps(working_digits(_DIGITS)):
        problem = _problem(scene)
        reduced, equations, remarks = _integrated(problem)
        geometry = reduced.chart.geometry
        require_enough(scene, geometry.found)
        if reduced.closures:
            draw = partial(_drawn, geometry, reduced.sampler([]), ())
            require_determined(geometry, reduced.manifold(), draw)
        reduced = replace(reduced, remarks=(*reduced.remarks, *remarks))
        return _with_levels(reduced, _levels(reduced, equations)) if equations else reduced


def in_coordinates(
    reduced: Reduced,
    names: Names,
    resolved: Mapping[sp.Symbol, sp.Expr],
    coordinates: Sequence[sp.Symbol],
    closures: Sequence[Restriction],
    reference: Mapping[sp.Symbol, mpf],
) -> Reduced:
    """The same scene over other coordinates with closures beside them; its account stays."""
    found = reduced.chart.geometry.found
    geometry = Geometry(names, found, resolved, coordinates, reference)
    chart = Chart(reduced.values, geometry, tuple(_coordinates(geometry, closures)))
    return replace(
        reduced,
        names=names,
        coordinates=chart.coordinates,
        resolved=resolved,
        reference=reference,
        remarks=tuple(r for r in reduced.remarks if r not in found.remarks),
        closures=tuple(closures),
        chart=chart,
        origin=reduced,
    )


@dataclass(frozen=True)
class _Problem:
    """What does not change while velocity constraints are integrated."""

    scene: Scene
    names: Names
    values: Values
    masses: tuple[sp.Expr, ...]
    reference: dict[sp.Symbol, mpf]


def _problem(scene: Scene) -> _Problem:
    names, values = Names(scene), Values(scene)
    masses = tuple(mass_of(names, values, p) for p in scene.particles)
    return _Problem(scene, names, values, masses, _reference(names, values, scene))


#: A constraint's name and one of its equations.
_Written = tuple[str, Equation]


def _integrated(problem: _Problem) -> tuple[Reduced, list[_Written], list[str]]:
    """The scene with all velocity constraints integrated that can be; the others; remarks."""
    names = problem.names
    written = [(c.name, e) for c in problem.scene.constraints for e in c.equations]
    open_ones = [x for x in written if _holds_rate(names, x)]
    stated = [_stated(names, x) for x in written if not _holds_rate(names, x)]
    remarks: list[str] = []
    while True:
        reduced = _reduced(problem, stated, strict=not open_ones)
        if not open_ones:
            return reduced, [], remarks
        points = _drawn(reduced.chart.geometry, reduced.sampler([]), ())
        levels = _levels(reduced, open_ones)
        found, new = integrals(names, levels, reduced.coordinates, points, problem.reference)
        if not found:
            return reduced, open_ones, remarks
        stated += found.values()
        remarks += new
        open_ones = [x for k, x in enumerate(open_ones) if k not in found]


def _holds_rate(names: Names, written: _Written) -> bool:
    return any(names.holds_rate(side) for side in (written[1].left, written[1].right))


def _levels(reduced: Reduced, equations: Sequence[_Written]) -> list[Level]:
    convert = reduced.names.convert
    return [
        Level(
            name,
            equation,
            reduced.resolve(convert(equation.left, reduced.rate)),
            reduced.resolve(convert(equation.right, reduced.rate)),
        )
        for name, equation in equations
    ]


def _reduced(problem: _Problem, stated: list[Stated], strict: bool) -> Reduced:
    """The scene without its velocity constraints; names may be open unless ``strict``."""
    scene, names, reference = problem.scene, problem.names, problem.reference
    found = _eliminate(names, scene, stated, reference, strict)
    symbols = _coordinate_symbols(names, found)
    resolved = {s: _placed(found, s) for s in names.cartesian.values()}
    geometry = Geometry(names, found, resolved, symbols, reference)
    chart = Chart(problem.values, geometry, tuple(_coordinates(geometry, ())))
    chart, points, kept = _restricted(chart)
    account, warnings = balance(geometry, points, kept)
    return Reduced(
        scene,
        names,
        problem.values,
        chart.coordinates,
        resolved,
        problem.masses,
        account,
        reference,
        (*scene.warnings, *warnings),
        tuple(found.remarks),
        tuple(geometry.restriction(k) for k in kept),
        chart,
    )


def _with_levels(reduced: Reduced, levels: Sequence[Level]) -> Reduced:
    """The scene with constraints on velocities beside those on positions."""
    coordinates, t = reduced.coordinates, reduced.names.t
    everything = [*reduced.closures, *(x.restriction() for x in levels)]
    manifold = _manifold(reduced.chart, everything)
    points = _drawn(reduced.chart.geometry, reduced.sampler([]), ())
    found = independent_levels(levels, coordinates, reduced.closures, t, manifold, points)
    kept = tuple(levels[k].restriction() for k in found.kept)
    return replace(
        reduced,
        account=with_levels(reduced.account, levels, found),
        warnings=(*reduced.warnings, *level_warnings(levels, found)),
        remarks=(*reduced.remarks, *level_remarks(levels, found)),
        closures=(*reduced.closures, *kept),
    )


def _restricted(chart: Chart) -> tuple[Chart, list[Drawn], tuple[int, ...]]:
    """The chart, feasible points of it, and the numbers of the equations that it keeps."""
    geometry = chart.geometry
    points = _drawn(geometry, _sampler(chart, [], _manifold(chart, ())), ())
    numbers = related(geometry, points)
    if not numbers:
        return chart, points, ()
    restrictions = [geometry.restriction(k) for k in numbers]
    chart = replace(chart, coordinates=tuple(_coordinates(geometry, restrictions)))
    manifold = _manifold(chart, restrictions)
    sampler = _sampler(chart, [], manifold)
    points = _drawn(geometry, sampler, numbers, 1 if sampler.many else POINTS)
    kept = independent_closures(geometry, numbers, manifold, sampler, points)
    if len(kept) < len(numbers) and sampler.many:  # one point proves independence only
        points += _drawn(geometry, sampler, numbers, FEWEST_POINTS - 1)
        kept = independent_closures(geometry, numbers, manifold, sampler, points)
    return chart, points, kept


def _drawn(
    geometry: Geometry, sampler: Sampler, restricting: Sequence[int], wanted: int | None = None
) -> list[Drawn]:
    wanted = wanted or (FEWEST_POINTS if sampler.many else POINTS)
    points = [p for p in (sampler.draw() for _ in range(wanted)) if p is not None]
    if len(points) < wanted:
        found, reference = geometry.found, geometry.reference
        raise nowhere(geometry.names, found, restricting, sampler, reference)
    return points


def _placed(found: Elimination, symbol: sp.Symbol) -> sp.Expr:
    """r(q, t) of a raw symbol, with sums under roots collected."""
    expr = found.solved.get(symbol, symbol)
    rooted = any(p.exp.q != 1 and p.base.is_Add for p in expr.atoms(sp.Pow) if p.exp.is_Rational)
    return tidy(expr) if rooted else expr


def _stated(names: Names, written: _Written) -> Stated:
    name, equation = written
    return Stated(name, equation, names.convert(equation.left), names.convert(equation.right))


def _reference(names: Names, values: Values, scene: Scene) -> dict[sp.Symbol, mpf]:
    """Values of symbols at ``initial`` and ``near`` (``initial`` wins), and of parameters."""
    found: dict[sp.Symbol, mpf] = {}
    for entry in (*scene.near, *scene.initial):
        value = values.number(entry.value) if entry.order == 0 else None
        symbol = names.lookup(entry.name)
        if value is not None and symbol is not None and symbol.is_Symbol:
            found[symbol] = mpf(value.evalf(mpmath.mp.dps))
    for name, value in values.exact.items():
        found[names.parameters[name]] = mpf(value.evalf(mpmath.mp.dps))
    start = scene.simulate.start
    at = values.number(start) if start is not None else None
    found[names.t] = mpf(at.evalf(mpmath.mp.dps)) if at is not None else mpf(0)
    return found


def _eliminate(
    names: Names,
    scene: Scene,
    stated: list[Stated],
    reference: dict[sp.Symbol, mpf],
    strict: bool,
) -> Elimination:
    declared = set(names.coordinates.values())
    unknowns = [s for s in names.cartesian.values() if s not in names.given and s not in declared]
    constants = frozenset(names.parameters.values())
    try:
        return eliminate(
            stated,
            names.given,
            unknowns,
            reference,
            constants,
            check=partial(require_enough, scene) if strict else lambda _: None,
            declared=scene.coordinates is not None,
        )
    except ImpossibleError as error:
        raise explained(names, stated, error.numbers, reference) or error from None


def _coordinate_symbols(names: Names, found: Elimination) -> list[sp.Symbol]:
    """Declared coordinates and the names that the constraints leave, in reading order."""
    opened = [s for s in names.cartesian.values() if s in found.unknowns]
    return [*names.coordinates.values(), *opened]


def _coordinates(geometry: Geometry, restrictions: Sequence[Restriction]) -> Iterator[Coordinate]:
    scene = geometry.names.scene
    declared = {c.name: c for c in scene.coordinates or ()}
    expressions = [geometry.resolved[s] for s in geometry.positions]
    expressions += [side for r in (*restrictions, *geometry.gaps) for side in (r.left, r.right)]
    periodic = periodic_symbols(expressions)
    for q in geometry.coordinates:
        written = declared.get(q.name)
        unit = written.unit if written else None
        yield Coordinate(
            name=q.name,
            q=q,
            v=sp.Symbol(f"dot({q.name})", real=True),
            a=sp.Symbol(f"ddot({q.name})", real=True),
            is_angle=unit == "rad" or q in periodic,
            unit=unit,
            description=written.description if written else None,
            latex=written.latex if written else None,
            mark=written.mark if written else scene.coordinates_mark,
        )


def _scales(chart: Chart) -> dict[sp.Symbol, mpf]:
    """Size of the motion of each coordinate."""
    names, reference = chart.geometry.names, chart.geometry.reference
    angles = {c.q for c in chart.coordinates if c.is_angle}
    no_lengths = {*names.parameters.values(), *angles, names.t}
    length = typical_length([x for s, x in reference.items() if s not in no_lengths])
    center = {c.q: reference.get(c.q, mpf(0)) for c in chart.coordinates}
    return {q: mpf(1) if q in angles else max(length, abs(x)) for q, x in center.items()}


def _sampler(chart: Chart, domain: list[sp.Expr], manifold: Manifold) -> Sampler:
    names, reference = chart.geometry.names, chart.geometry.reference
    exact = chart.values.exact
    return Sampler(
        names.t,
        [c.q for c in chart.coordinates],
        {names.parameters[n]: reference[names.parameters[n]] for n in exact},
        [*(s for n, s in names.parameters.items() if n not in exact), *names.inputs.values()],
        {c.q: reference.get(c.q, mpf(0)) for c in chart.coordinates},
        _scales(chart),
        [*chart.geometry.resolved.values(), *_differences(chart.geometry.gaps), *domain],
        seed=names.scene.digest,
        place=manifold.placed if manifold.all else None,
    )


def _differences(restrictions: Sequence[Restriction]) -> list[sp.Expr]:
    return [r.left - r.right for r in restrictions]


def _manifold(chart: Chart, restrictions: Sequence[Restriction]) -> Manifold:
    names = chart.geometry.names
    return Manifold(
        [(r.left, r.right) for r in restrictions if r.kind == "position"],
        [r.left - r.right for r in restrictions if r.kind == "velocity"],
        names.t,
        [c.q for c in chart.coordinates],
        [c.v for c in chart.coordinates],
        list(names.parameters.values()),
        _scales(chart),
    )
