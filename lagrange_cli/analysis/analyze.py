"""The pipeline of an analysis: symmetries, equilibria, the linear system and its modes.

Each part is computed only when it is asked for. Without a choice all parts are; those that have no
result, or exceed the budget, are listed with the reason.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.branches.find import find_branches
from lagrange_cli.analysis.contacts.loss import contact_losses
from lagrange_cli.analysis.equilibria.closed_forms import ClosedForms, closed_forms
from lagrange_cli.analysis.equilibria.configuration import (
    Configuration,
    configuration_at,
    nearest,
    require_switch_values,
    without_switching,
)
from lagrange_cli.analysis.equilibria.release import Release
from lagrange_cli.analysis.equilibria.repeats import distance, without_repeats
from lagrange_cli.analysis.equilibria.rest_system import RestSystem, kinks_at, rest_system
from lagrange_cli.analysis.equilibria.search import (
    SearchResult,
    search,
    usual_length,
    with_exact,
)
from lagrange_cli.analysis.equilibria.state_coordinates import with_state_coordinates
from lagrange_cli.analysis.equilibria.steady import (
    SteadySystem,
    steady_system,
    turning_names,
    turns_by_rates,
)
from lagrange_cli.analysis.equilibria.steady_rates import SteadyRates, steady_rates
from lagrange_cli.analysis.linear.first_order import FirstOrder
from lagrange_cli.analysis.linear.linearize import (
    exact_matrices,
    in_doubles,
    linear_system,
    require_doubles,
    state_space,
)
from lagrange_cli.analysis.linear.modes import modes
from lagrange_cli.analysis.linear.sampled_loop import (
    resting_loop,
    sampled_loop,
    stability_of_loop,
    without_controllers,
)
from lagrange_cli.analysis.linear.stability import (
    stability,
    stability_of_parameters,
    stability_of_rates,
)
from lagrange_cli.analysis.result import Analysis, LeftOut
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.analysis.values import Equilibria, Equilibrium, Linearization, Mode, Stability
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.phrases import Phrase
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.parameter import Varied
    from lagrange_cli.mechanics.equations import Equations

#: Why a sampled loop has no modes.
_SAMPLED = Phrase("a controller samples the motion: poles are those of the sampled loop")

#: The parts of an analysis, in the order in which they are computed.
PARTS = ("symmetries", "equilibria", "linearization", "modes", "contacts")


def analyze(
    equations: Equations,
    parts: Collection[str] = (),
    at: Mapping[str, str] | None = None,
    *,
    steady: bool = False,
    branches: Varied | None = None,
) -> Analysis:
    """Analyze equations of motion.

    Parameters
    ----------
    equations
        The equations.
    parts
        Names of :data:`PARTS` that are wanted; if there are none, all parts that have a result.
    at
        Coordinates of a configuration, and values of inputs that are held; expressions of the
        scene language. Of steady motions also momenta or rates of ignored coordinates.
    steady
        Find steady motions, in which ignored coordinates turn uniformly, in place of equilibria.
    branches
        The parameter over which branches of equilibria are followed; alone unless parts are named.

    Raises
    ------
    InputError
        A wanted part cannot be found, or ``at`` is no equilibrium.
    """
    if branches is not None and steady:
        message = Phrase("branches are those of equilibria, not of steady motions")
        raise InputError(Problem(message, rule="analysis-branches"))
    apart = equations.system.states or equations.system.controllers
    if apart and (branches is not None or steady):
        message = Phrase("equilibria alone are sought where there are states of first order")
        raise InputError(Problem(message, rule="analysis-states"))
    equations = resting_loop(equations)
    everything = not parts and branches is None
    wanted = [part for part in PARTS if part in parts or everything]
    turning = turning_names(equations) if steady else ()
    configuration = configuration_at(with_state_coordinates(equations), at or {}, turning)
    require_switch_values(equations, configuration)
    result = Analysis(equations)
    if branches is not None:
        if configuration.coordinates and not wanted:
            name = next(iter(configuration.coordinates))
            message = Phrase(
                "branches are of all equilibria, and not of the one at {name}", name=(name,)
            )
            raise InputError(Problem(message, configuration.marks[name], rule="analysis-branches"))
        system = rest_system(equations, configuration.held_inputs)
        result = replace(result, branches=find_branches(system, branches))
    if "symmetries" in wanted:
        announce("looking for symmetries")
        result = replace(result, symmetries=linear_symmetries(equations))
    if "contacts" in wanted and (parts or equations.system.contacts):
        result = _with_contacts(result, strict=bool(parts))
    of_rest = [part for part in wanted if part not in ("symmetries", "contacts")]
    if not of_rest:
        return result
    strict = bool(parts or configuration.coordinates or configuration.held_inputs)
    return _of_rest(result, of_rest, configuration, steady=steady, strict=strict)


def _with_contacts(result: Analysis, *, strict: bool) -> Analysis:
    announce("looking for loss of contact")
    try:
        losses = contact_losses(result.equations)
        return replace(result, contacts=losses) if strict or losses.contacts else result
    except InputError as error:
        if strict:
            raise
        return replace(result, left_out=_left_out(("contacts",), error))


@dataclass(frozen=True)
class _RestProblem:
    """The system whose equilibria are sought, and the one that is linearized at each of them."""

    sought: RestSystem
    steady: SteadySystem | SteadyRates | None = None

    def system_at(self, point: Equilibrium) -> RestSystem:
        return self.sought if self.steady is None else self.steady.system_at(point)

    def completed(self, points: list[Equilibrium]) -> list[Equilibrium]:
        return points if self.steady is None else self.steady.completed(points)


def _rest_problem(
    equations: Equations, configuration: Configuration, *, steady: bool
) -> _RestProblem:
    if not steady:
        return _RestProblem(rest_system(equations, configuration.held_inputs))
    announce("ignoring cyclic coordinates")
    system: SteadySystem | SteadyRates
    if turns_by_rates(equations):
        system = steady_rates(equations, configuration)
    else:
        system = steady_system(equations, configuration)
    return _RestProblem(system.sought, system)


def _of_rest(
    result: Analysis,
    wanted: Collection[str],
    configuration: Configuration,
    *,
    steady: bool,
    strict: bool,
) -> Analysis:
    """Add equilibria, linearization and modes; missing parts are left out unless ``strict``."""
    try:
        problem = _rest_problem(result.equations, configuration, steady=steady)
        announce(f"looking for {'steady motions' if steady else 'equilibria'}")
        equilibria = find_equilibria(problem)
        equilibria, changing = without_switching(result.equations, problem.sought, equilibria)
        if changing and not equilibria.points:
            raise InputError(Problem(changing[0], rule="analysis-none"))
    except InputError as error:
        if strict or steady:
            raise
        return replace(result, left_out=(*result.left_out, *_left_out(wanted, error)))
    no_rest = tuple(LeftOut("equilibria", reason) for reason in changing)
    result = replace(result, left_out=(*result.left_out, *no_rest))
    if problem.steady is not None:
        result = replace(result, steady=problem.steady.form)
    if "equilibria" in wanted:
        result = replace(result, equilibria=equilibria)
    further = [part for part in wanted if part != "equilibria"]
    try:
        if further:
            announce("linearizing")
            (chosen,) = problem.completed([nearest(problem.sought, equilibria, configuration)])
            system = problem.system_at(chosen)
            linear = linearization(system, chosen)
            if system.equations.system.controllers:
                loop = sampled_loop(system, linear.state_space)
                linear = without_controllers(system, linear)
                result = replace(result, linearization=linear, sampled=loop)
                if "modes" in further:
                    raise InputError(Problem(_SAMPLED, rule="analysis-sampled"))
                return _asked(result, wanted)
            result = replace(result, linearization=linear)
            if "modes" in further:
                chose = bool(configuration.coordinates or configuration.held_inputs)
                result = replace(result, modes=_modes(system, linear, chose))
    except InputError as error:
        if strict:
            raise
        missing = [p for p in further if p != "linearization" or result.linearization is None]
        result = replace(result, left_out=(*result.left_out, *_left_out(missing, error)))
    return _asked(result, wanted)


def _asked(result: Analysis, wanted: Collection[str]) -> Analysis:
    """Return the result without a linear system that was not asked for."""
    return result if "linearization" in wanted else replace(result, linearization=None)


def _left_out(parts: Collection[str], error: InputError) -> tuple[LeftOut, ...]:
    return tuple(LeftOut(part, error.problems[0].message) for part in parts)


def find_equilibria(problem: _RestProblem) -> Equilibria:
    """Find the equilibria, in closed form if that is possible, else by a search.

    Raises
    ------
    InputError
        There is no closed form, and a parameter lacks its value.
    """
    system = problem.sought
    forms = closed_forms(system) or ClosedForms((), (), False)
    release = Release(system, usual_length(system))
    exact = [
        p
        for p in forms.points
        if p.conditions or p.position is None or not release.moves(p.position)
    ]
    points, outcome = exact, SearchResult([], (), 0)
    if not forms.complete and not (system.missing and points):
        outcome = search(system)
        points = with_exact(system, exact, outcome)
    different = problem.completed(without_repeats(system, _ordered(system, points, outcome)))
    judged = tuple(replace(p, stability=_stability(problem, p)) for p in different)
    complete = forms.complete and not system.jumps
    return Equilibria(
        judged,
        forms.absent,
        complete,
        outcome.starts,
        system.held_inputs,
        forms.nonzero,
        outcome.unproven,
        len(forms.points) - len(exact),
    )


def _ordered(
    system: RestSystem, points: list[Equilibrium], outcome: SearchResult
) -> list[Equilibrium]:
    """Sort closed forms first, by freedom and length, others by distance from the start."""

    def key(point: Equilibrium) -> tuple[int, float, list[float]]:
        if point.exact is not None and point not in outcome.points:
            length = sum(map(sp.count_ops, point.exact)) / 1000
            return -1 - len(point.free), len(point.conditions) + length, []
        position = point.position or ()
        rounded = [round(float(x), 9) for x in position]
        return 0, round(float(distance(system, position, system.start)), 9), rounded

    return sorted(points, key=key)


def _stability(problem: _RestProblem, point: Equilibrium) -> Stability:
    if point.position is None or problem.sought.missing:
        if problem.steady is None:
            return stability_of_parameters(problem.sought, point)
        return Stability("undecided", Phrase("parameters have no values"))
    try:
        system = problem.system_at(point)
        linear = linear_system(system, point)
        if system.equations.system.controllers and not kinks_at(system, point):
            return stability_of_loop(sampled_loop(system, state_space(system, linear, point)))
        if isinstance(problem.steady, SteadyRates):
            return stability_of_rates(system, point, linear, problem.steady)
        return stability(system, point, linear)
    except InputError as error:
        return Stability("undecided", error.problems[0].message)


def linearization(system: RestSystem, point: Equilibrium) -> Linearization:
    """Linearize at an equilibrium.

    Raises
    ------
    InputError
        A parameter lacks its value, the coordinates are singular there, or numbers are beyond
        double precision.
    """
    linear = linear_system(system, point)
    names = [c.name for c in system.equations.system.coordinates]
    order = FirstOrder.of_system(system, linear)
    moving, placed = order.moving, order.placed
    mass = in_doubles(linear.mass)[:moving, :moving]
    damping = in_doubles(linear.damping)[:moving, :moving]
    stiffness = in_doubles(linear.stiffness)[:moving, :placed]
    space = state_space(system, linear, point)
    require_doubles(mass, damping, stiffness, space.a, space.b, space.c, space.d)
    exact = exact_matrices(system, point)
    coordinates = tuple(names[j] for j in linear.independent[:moving])
    directions = in_doubles(linear.positions)[: system.moving, :placed]
    matrices = mass, damping, stiffness
    return Linearization(point, coordinates, *matrices, space, exact, directions, system.states)


def _modes(system: RestSystem, linear: Linearization, chosen: bool) -> tuple[Mode, ...]:
    """Find the modes at a chosen equilibrium, or at one that is not known to be unstable."""
    stability = linear.at.stability
    if not chosen and stability is not None and stability.verdict == "unstable":
        message = Phrase("no equilibrium that was found is stable")
        hint = "--at NAME=VALUE chooses one"
        raise InputError(Problem(message, hint=hint, rule="analysis-unstable"))
    with mpmath.workdps(50):
        values = {symbol: mpf(x) for symbol, x in system.known.items()}
    return modes(linear, values)
