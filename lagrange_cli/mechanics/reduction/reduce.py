"""From a scene to generalized coordinates: 3N Cartesian components, K constraints, 3N − K.

The reduction eliminates Cartesian names (:mod:`.elimination.eliminate`), keeps the equations
without a closed form in one chart (:mod:`.independence`), classifies the others
(:mod:`.dof_account`) and yields every raw symbol as a function of q and t.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InconsistentError, Mark, SingularError
from lagrange_cli.mechanics.algebra.factor import tidy
from lagrange_cli.mechanics.algebra.shorten import drawn_from_roots
from lagrange_cli.mechanics.diagnosis.errors import (
    not_positive,
    remaining_coordinates,
    require_enough,
)
from lagrange_cli.mechanics.diagnosis.inconsistency import (
    diagnose_no_configuration,
    proven_inconsistency,
)
from lagrange_cli.mechanics.elimination.branches import AmbiguousFactorError, NoRealSolutionError
from lagrange_cli.mechanics.elimination.eliminate import Elimination, StatedEquation, eliminate
from lagrange_cli.mechanics.free_symbols import distinct_parts, holds
from lagrange_cli.mechanics.numerics.sampling import SamplePoint, Sampler, working_digits
from lagrange_cli.mechanics.reduction.coordinates import (
    Chart,
    generalized_coordinates,
    manifold_of,
    sampler_of,
)
from lagrange_cli.mechanics.reduction.dof_account import (
    balanced_account,
    with_partial_identities,
)
from lagrange_cli.mechanics.reduction.geometry import Geometry, restricting_equations
from lagrange_cli.mechanics.reduction.independence import (
    independent_closures,
    require_determined,
    require_no_border,
)
from lagrange_cli.mechanics.reduction.local_identities import (
    EquationSides,
    has_branches,
    identities_around,
    violating_configurations,
)
from lagrange_cli.mechanics.reduction.rate_redundancy import RedundantRate, redundant_rates
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.reduction.velocity_account import (
    redundant_rate_warnings,
    velocity_remarks,
    velocity_warnings,
    with_velocities,
    without_redundant_rates,
)
from lagrange_cli.mechanics.reduction.velocity_constraints import (
    StartNeededError,
    VelocityConstraint,
    from_start,
    independent_constraints,
    integrate_constraints,
)
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.values import (
    ParameterValues,
    evaluated,
    particle_mass,
    require_positive_radii,
    require_possible_inertia,
)
from lagrange_cli.mechanics.system import tagged
from lagrange_cli.scene.bodies import ComposedExpression
from lagrange_cli.scene.checks.table import name_table
from lagrange_cli.scene.declared_numbers import DeclaredParameter
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.model import Scene

#: Decimal digits of the numbers that tests of identity and rank work with.
_DIGITS = 30

#: Configurations at which identities and ranks are checked.
RANK_POINTS = 3
#: Distance of a point from the given configuration over that of the one before. Not tuned.
_CLOSER = mpf(1) / 8

#: Configurations on closures of many coordinates: two distinguish constant from varying numbers.
_FEWEST_POINTS = 2


def reduce(scene: Scene) -> Reduced:
    """Reduce a scene to generalized coordinates.

    Raises
    ------
    InputError
        Located and explained: too few or too many coordinates, constraints that
        contradict each other, a branch that nothing chooses, a mass that is not positive, or a
        value of ``initial`` or ``near`` that is not where its coordinate has to be.
    """
    try:
        return _reduced_scene(scene)
    except StartNeededError as needed:
        return reduce(_with_starts(scene, needed.names))


def _with_starts(scene: Scene, coordinates: Sequence[str]) -> Scene:
    """Add parameters for the starts of some coordinates, or of ``t``, to a scene."""
    parameters, starts = list(scene.parameters), dict(scene.starts)
    declared = {c.name: c for c in scene.coordinates or ()}
    table = name_table(scene)
    place = scene.coordinates_mark or Mark(scene.file, 1, 1)
    initial_values = {e.name: e.value for e in scene.initial if e.order == 0}
    for q in coordinates:
        name = tagged(q, "_0")
        while name in table:
            name = tagged(name, "_")
        starts[q] = name
        unit = declared[q].unit if q in declared else None
        latex = declared[q].latex if q in declared else None
        if latex is not None:
            latex = f"{{{latex}}}_{{0}}" if "_" in latex else f"{latex}_{{0}}"
        description, positive = f"{q} at the start", q in scene.positive
        value = scene.simulate.start if q == "t" else initial_values.get(q)
        parameters.append(DeclaredParameter(name, place, value, unit, positive, description, latex))
    return replace(scene, parameters=tuple(parameters), starts=tuple(starts.items()))


def _reduced_scene(scene: Scene) -> Reduced:
    with mpmath.workdps(working_digits(_DIGITS)):
        basis = _basis(scene)
        integrated = _integrated(basis)
        reduced, equations = integrated.reduced, integrated.remaining
        geometry = reduced.chart.geometry
        require_enough(scene, geometry.elimination)
        if reduced.closures:
            draw = partial(_drawn, geometry, reduced.sampler([]), ())
            require_determined(geometry, reduced.manifold(), draw)
        reduced = replace(
            reduced,
            account=without_redundant_rates(reduced.account, integrated.redundant, equations),
            remarks=(*reduced.remarks, *integrated.remarks),
            warnings=(*reduced.warnings, *redundant_rate_warnings(integrated.redundant)),
        )
        return _with_levels(reduced, _levels(reduced, equations)) if equations else reduced


@dataclass(frozen=True)
class _Basis:
    """Values that stay while velocity constraints are integrated.

    Attributes
    ----------
    scene
        The scene.
    names
        Its names as symbols.
    values
        Values of its parameters.
    masses
        One expression for each particle.
    reference
        Values of symbols that ``initial`` and ``near`` give.
    """

    scene: Scene
    names: Names
    values: ParameterValues
    masses: tuple[sp.Expr, ...]
    reference: dict[sp.Symbol, mpf]


def _basis(scene: Scene) -> _Basis:
    names, values = Names(scene), ParameterValues(scene)
    masses = tuple(particle_mass(names, values, p) for p in scene.particles)
    require_possible_inertia(scene, values)
    require_positive_radii(scene, values)
    return _Basis(scene, names, values, masses, _reference(names, values, scene))


#: A constraint's name and one of its equations.
_Written = tuple[str, Equation]


@dataclass(frozen=True)
class _Integrated:
    """A scene whose integrable velocity constraints are integrated.

    Attributes
    ----------
    reduced
        The scene in coordinates that satisfy them.
    remaining
        Velocity constraints that are not integrated.
    redundant
        Velocity constraints that others imply.
    remarks
        Findings to be reported.
    """

    reduced: Reduced
    remaining: Sequence[_Written] = ()
    redundant: Sequence[RedundantRate] = ()
    remarks: Sequence[str] = ()


def _integrated(basis: _Basis) -> _Integrated:
    """Integrate the velocity constraints of a scene, one after another."""
    names = basis.names
    written = [(c.name, e) for c in basis.scene.constraints for e in c.equations]
    remaining = [x for x in written if _holds_rate(names, x)]
    joints = {c.name for c in basis.scene.constraints if c.joint}
    stated = [_stated(names, x, x[0] in joints) for x in written if not _holds_rate(names, x)]
    integrated = _Integrated(_reduced(basis, stated, strict=not remaining))
    if not remaining:
        return integrated
    geometry, reference = integrated.reduced.chart.geometry, basis.reference
    points = _drawn(geometry, integrated.reduced.sampler([]), ())
    resolved, elimination = integrated.reduced.resolved, geometry.elimination
    implied = redundant_rates(names, elimination, remaining, resolved, points, reference)
    remaining = [x for k, x in enumerate(remaining) if k not in implied]
    integrated = replace(integrated, remaining=remaining, redundant=tuple(implied.values()))
    while integrated.remaining:
        reduced = integrated.reduced
        levels = _levels(reduced, integrated.remaining)
        points = _drawn(reduced.chart.geometry, reduced.sampler([]), ())
        whole, new = integrate_constraints(
            names, levels, reduced.coordinates, points, basis.reference
        )
        if not whole:
            break
        stated += whole.values()
        remaining = [x for k, x in enumerate(integrated.remaining) if k not in whole]
        try:
            reduced = _reduced(basis, stated, strict=not remaining)
        except (InconsistentError, SingularError):
            if basis.scene.initial:
                raise
            break  # they may hold with nonzero constants of integration
        remarks = [*integrated.remarks, *new]
        integrated = replace(integrated, reduced=reduced, remaining=remaining, remarks=remarks)
    return integrated


def _holds_rate(names: Names, written: _Written) -> bool:
    return any(names.holds_rate(side) for side in (written[1].left, written[1].right))


def _levels(reduced: Reduced, equations: Sequence[_Written]) -> list[VelocityConstraint]:
    def side(expression: Expression) -> sp.Expr:
        return reduced.resolve(reduced.names.convert(expression, reduced.rate))

    levels = [VelocityConstraint(name, e, side(e.left), side(e.right)) for name, e in equations]
    composed = (isinstance(x.equation.left, ComposedExpression) for x in levels)
    velocities = [c.v for c in reduced.coordinates]
    return [
        x.shortened(velocities) if by_us else x for x, by_us in zip(levels, composed, strict=True)
    ]


def _reduced(basis: _Basis, stated: list[StatedEquation], strict: bool) -> Reduced:
    """Reduce a scene without its velocity constraints; names may stay open unless ``strict``."""
    scene, names, reference = basis.scene, basis.names, basis.reference
    elimination = _eliminate(names, scene, stated, reference, strict)
    symbols = _coordinate_symbols(names, elimination)
    resolved = {s: _placed(elimination, s, symbols) for s in names.cartesian.values()}
    starts = {names.parameters[name]: q for q, name in scene.starts}
    pairs = [(s, start) for start, q in starts.items() for s in symbols if s.name == q]
    resolved = {s: from_start(expr, pairs) for s, expr in resolved.items()}
    geometry = Geometry(names, elimination, resolved, symbols, reference)
    chart = Chart(basis.values, geometry, tuple(generalized_coordinates(geometry, ())))
    chart, points, closure_numbers = _restricted(chart)
    account, warnings = balanced_account(
        geometry, points, closure_numbers, partial(_held_around, chart)
    )
    account, warnings = with_partial_identities(
        geometry, account, warnings, _violated(chart, closure_numbers)
    )
    return Reduced(
        scene,
        names,
        basis.values,
        chart.coordinates,
        resolved,
        basis.masses,
        account,
        reference,
        (*scene.warnings, *warnings),
        tuple(elimination.remarks),
        tuple(geometry.closure_equation(k) for k in closure_numbers),
        chart,
    )


def _with_levels(reduced: Reduced, levels: Sequence[VelocityConstraint]) -> Reduced:
    """Add constraints on velocities to a reduced scene."""
    coordinates, t = reduced.coordinates, reduced.names.t
    everything = [*reduced.closures, *(x.closure_equation() for x in levels)]
    manifold = manifold_of(reduced.chart, everything)
    points = _drawn(reduced.chart.geometry, reduced.sampler([]), ())
    independent = independent_constraints(
        levels, coordinates, reduced.closures, t, manifold, points
    )
    closures = tuple(levels[k].closure_equation() for k in independent.numbers)
    return replace(
        reduced,
        account=with_velocities(reduced.account, levels, independent),
        warnings=(*reduced.warnings, *velocity_warnings(levels, independent)),
        remarks=(*reduced.remarks, *velocity_remarks(levels, independent)),
        closures=(*reduced.closures, *closures),
    )


def _restricted(chart: Chart) -> tuple[Chart, list[SamplePoint], tuple[int, ...]]:
    """Return the chart, feasible points, and the numbers of the equations that stay as closures."""
    geometry = chart.geometry
    sampler = sampler_of(chart, [], manifold_of(chart, ()))
    require_no_border(geometry, sampler)
    points = _drawn(geometry, sampler, ())
    if any(map(has_branches, geometry.elimination.pending.values())):
        # On one side alone of a border, by chance, an equation would seem to hold everywhere.
        points += filter(None, map(sampler.opposite, points.copy()))
    numbers = restricting_equations(geometry, points, partial(_held_around, chart))
    if not numbers:
        return chart, points, ()
    equations = [geometry.closure_equation(k) for k in numbers]
    chart = replace(chart, coordinates=tuple(generalized_coordinates(geometry, equations)))
    manifold = manifold_of(chart, equations)
    sampler = sampler_of(chart, [], manifold)
    points = _drawn(geometry, sampler, numbers, 1 if sampler.many else RANK_POINTS)
    closure_numbers = independent_closures(geometry, numbers, manifold, sampler, points)
    if len(closure_numbers) < len(numbers) and sampler.many:  # one point proves independence only
        points += _drawn(geometry, sampler, numbers, _FEWEST_POINTS - 1)
        closure_numbers = independent_closures(geometry, numbers, manifold, sampler, points)
    return chart, points, closure_numbers


def _held_around(chart: Chart, equations: Mapping[int, EquationSides]) -> set[int]:
    """Numbers of the equations that hold identically around the given configuration."""
    sampler = sampler_of(chart, [], manifold_of(chart, ()))
    return identities_around(equations, sampler, chart.geometry.reference)


def _violated(chart: Chart, closure_numbers: Sequence[int]) -> dict[int, SamplePoint]:
    """Configurations that violate equations without a closure, by number."""
    geometry = chart.geometry
    equations = {
        k: sides for k, sides in geometry.elimination.pending.items() if k not in closure_numbers
    }
    equations |= geometry.solved_sides
    manifold = manifold_of(chart, [geometry.closure_equation(k) for k in closure_numbers])
    return violating_configurations(equations, sampler_of(chart, [], manifold), geometry.gaps)


def _drawn(
    geometry: Geometry, sampler: Sampler, restricting: Sequence[int], wanted: int | None = None
) -> list[SamplePoint]:
    """Draw feasible points, on closures each closer to the given configuration if one is there.

    A linkage may have branches of another rank: the closest point is on that of the start.
    """
    wanted = wanted or (_FEWEST_POINTS if sampler.many else RANK_POINTS)
    points: list[SamplePoint] = []
    while len(points) < wanted:
        closer = sampler.draw(width=_CLOSER ** len(points)) if restricting and points else None
        point = closer or sampler.draw()
        if point is None:
            raise diagnose_no_configuration(
                geometry.names, geometry.elimination, restricting, sampler, geometry.reference
            )
        points.append(point)
    return points


def _placed(
    elimination: Elimination, symbol: sp.Symbol, coordinates: Sequence[sp.Symbol]
) -> sp.Expr:
    """Write r(q, t) of a raw symbol, with sums under roots collected and cos α tan α as sin α."""
    expr = elimination.solved.get(symbol, symbol)
    if holds(expr, sp.tan):
        expr = tidy(expr)
    powers = (part for part in distinct_parts(expr) if part.is_Pow)
    if not any(p.exp.q != 1 and p.base.is_Add for p in powers if p.exp.is_Rational):
        return expr
    return drawn_from_roots(tidy(expr), [q for q in coordinates if q.is_positive])


def _stated(names: Names, written: _Written, joint: bool) -> StatedEquation:
    name, equation = written
    left, right = names.convert(equation.left), names.convert(equation.right)
    return StatedEquation(name, equation, left, right, joint=joint)


def _reference(names: Names, values: ParameterValues, scene: Scene) -> dict[sp.Symbol, mpf]:
    """Values of symbols at ``initial`` and ``near`` (``initial`` wins), and of parameters."""
    reference: dict[sp.Symbol, mpf] = {}
    for entry in (*scene.near, *scene.initial):
        value = values.number(entry.value) if entry.order == 0 else None
        symbol = names.lookup(entry.name)
        if value is not None and symbol is not None and symbol.is_Symbol:
            reference[symbol] = evaluated(value, mpmath.mp.dps)
            if symbol.is_positive and not reference[symbol] > 0:
                raise not_positive(entry.name, entry.value)
    for name, value in values.exact.items():
        reference[names.parameters[name]] = evaluated(value, mpmath.mp.dps)
    start = scene.simulate.start
    at = values.number(start) if start is not None else None
    reference[names.t] = evaluated(at, mpmath.mp.dps) if at is not None else mpf(0)
    return reference


def _eliminate(
    names: Names,
    scene: Scene,
    stated: list[StatedEquation],
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
    except AmbiguousFactorError as error:
        left = {tuple(remaining_coordinates(scene, factor)) for factor in error.factors}
        raise error.with_coordinates(left.pop() if len(left) == 1 else ()) from None
    except NoRealSolutionError as error:
        raise proven_inconsistency(names, stated, error.numbers, reference) or error from None


def _coordinate_symbols(names: Names, elimination: Elimination) -> list[sp.Symbol]:
    """Declared coordinates and the names that the constraints leave, in reading order."""
    opened = [s for s in names.cartesian.values() if s in elimination.unknowns]
    return [*names.coordinates.values(), *opened]
