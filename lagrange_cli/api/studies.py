"""Studies of the motions of a derivation: trades, fits, exponents, sections, paths."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.api.derived import Derived
from lagrange_cli.api.motion import GivenMembers, members_given, simulate
from lagrange_cli.api.values import GivenValues
from lagrange_cli.errors import InputError, Problem, nearest

if TYPE_CHECKING:
    from lagrange_cli.drawn import Film
    from lagrange_cli.simulate import Trajectory
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.studies.fit.result import Fit
    from lagrange_cli.studies.lyapunov import Lyapunov
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.section.result import Section
    from lagrange_cli.studies.tradeoff.result import Trade


def stress_axes() -> tuple[str, ...]:
    """Return the names of the axes along which a scene is pushed to extremes."""
    from lagrange_cli.studies.stress.points import STRESS_AXES

    return tuple(STRESS_AXES)


def tradeoff(
    derived: Derived,
    *,
    methods: Sequence[str] | None = None,
    repeat: int = 20,
    until: float | None = None,
    budget: float = 1.0,
    progress: Callable[[float], None] | None = None,
) -> Trade:
    """Measure speed against accuracy, of the methods of this program on this machine.

    Parameters
    ----------
    methods, repeat, until, budget, progress
        As :func:`lagrange_cli.studies.tradeoff.measure.trade` has them.

    Raises
    ------
    InputError
        A method is unknown or cannot run here; the scene cannot be simulated.
    AccuracyError
        There is no reference that is accurate enough.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> derivation.tradeoff(methods=["DOP853"], repeat=1).points[0].setting.method
    'DOP853'
    """
    from lagrange_cli.studies.tradeoff.measure import trade

    model = derived.variants(frozenset(), (), ()).model
    return trade(
        model,
        methods=methods,
        repeat=repeat,
        until=until,
        budget=budget,
        progress=progress,
        functions=derived.right_hand_sides(model),
    )


def fit(
    derived: Derived,
    measurements: str | os.PathLike[str],
    free: Sequence[str],
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    starts: int | None = None,
    accuracy: float = 1e-8,
    progress: Callable[[float], None] | None = None,
) -> Fit:
    """Fit parameters and starts to measurements by least squares, with standard errors.

    Parameters
    ----------
    measurements
        A CSV file: ``t`` and columns of a trajectory; beside one perhaps ``sigma(NAME)``.
    free
        Names of parameters, and of coordinates or their ``dot`` for their starts; the
        scene's values are the first ones.
    bounds
        Lowest and highest values of some of them.
    starts
        Number of starts of the search; None if it may end when one explains the measurements or
        enough agree.
    accuracy
        Of the motions.
    progress
        Called with the part of the work that is done, at most.

    Raises
    ------
    InputError
        As :func:`lagrange_cli.studies.fit.fit.fit_motion`; bounds are of a value that is not free.
    """
    from lagrange_cli.studies.fit.fit import POSITIVE, FreeValue, fit_motion, require_free
    from lagrange_cli.studies.fit.measurements import read_measurements
    from lagrange_cli.studies.path.models import periodic_coordinates

    table = read_measurements(os.fspath(measurements))
    system, model = derived.equations.system, derived.model()
    starts_of = (
        dict.fromkeys(model.state_names)
        if model.initial is None
        else dict(zip(model.state_names, map(float, model.initial), strict=True))
    )
    parameters = {p.name: p.value for p in system.parameters}
    first = require_free(free, {**parameters, **starts_of})
    lowest = {p.name: POSITIVE for p in system.parameters if p.positive}
    bounds = _bounds_of(free, bounds or {})
    periodic = zip(system.coordinates, periodic_coordinates(derived.equations), strict=True)
    angles = {c.name for c, is_periodic in periodic if is_periodic}

    def run(
        values: Mapping[str, float], by: Sequence[str], times: Array, budget: float | None
    ) -> Trajectory:
        return simulate(
            derived,
            parameters={k: x for k, x in values.items() if k in parameters},
            initial={k: x for k, x in values.items() if k not in parameters},
            sensitivity=by,
            times=times.tolist(),
            accuracy=accuracy,
            budget=budget,
        )

    return fit_motion(
        run,
        table,
        [
            FreeValue(
                name=name,
                first=value,
                lowest=max(lowest.get(name, -math.inf), bounds[name][0]),
                highest=bounds[name][1],
                is_start=name not in parameters,
                is_angle=name in angles,
            )
            for name, value in first.items()
        ],
        origin=model.defaults.start,
        starts=starts,
        accuracy=accuracy,
        progress=progress,
    )


def _bounds_of(
    free: Sequence[str], bounds: Mapping[str, tuple[float, float]]
) -> dict[str, tuple[float, float]]:
    """Return bounds of all free values; refuse those of others."""
    for name in bounds:
        if name not in free:
            hint = nearest(name, list(free)) or f"free are {', '.join(free)}"
            raise InputError(
                Problem(f"'{name}' has bounds, but is not free", hint=hint, rule="fit")
            )
    return {name: bounds.get(name, (-math.inf, math.inf)) for name in free}


def lyapunov(
    derived: Derived,
    *,
    until: float,
    accuracy: float = 1e-8,
    progress: Callable[[float], None] | None = None,
) -> Lyapunov:
    """Find the Lyapunov exponents of the motion, from the largest, with their spreads.

    Parameters
    ----------
    until
        The end of the time over which they are averaged.
    accuracy
        Of the motion and of displacements, in each of a thousand intervals.
    progress
        Called with the part of the time that is done.

    Raises
    ------
    InputError
        As :func:`lagrange_cli.studies.lyapunov.lyapunov_exponents`; or there are no
        derivatives of the motion, as with contacts.
    """
    from lagrange_cli.studies.lyapunov import lyapunov_exponents

    starts = derived.equations.system.state_names
    model = derived.model(starts)
    return lyapunov_exponents(model, until, accuracy=accuracy, progress=progress)


def section(
    derived: Derived,
    condition: str,
    members: GivenMembers | None = None,
    *,
    until: float | None = None,
    accuracy: float | None = None,
    method: str | None = None,
    rtol: float | None = None,
    atol: float | None = None,
    budget: float | None = None,
    jobs: int | None = 1,
    progress: Callable[[float], None] | None = None,
) -> Section:
    """Find the points at which the motion, or each of many, meets a Poincaré section.

    Parameters
    ----------
    condition
        An equation and inequalities between expressions of the scene language over the state,
        the time and the scene's names: ``"theta2 = 0, dot(theta2) > 0"``. Angles of which whole
        turns change nothing are equal modulo these.
    members
        Parameters and initial values of many motions, as :meth:`ensemble` takes them; None for
        the scene's motion.
    until, accuracy, method, rtol, atol, budget
        As for :meth:`simulate`; the budget is that of all motions. With a method nothing is
        promised.
    jobs, progress
        As for :meth:`ensemble`.

    Raises
    ------
    InputError
        Located: the condition is none, or as :meth:`simulate` or :meth:`ensemble`.

    Examples
    --------
    >>> derivation = load("systems/oscillators/henon_heiles.yaml").derive()
    >>> section = derivation.section("x = 0, dot(x) > 0", until=100)
    >>> section
    <Section of henon_heiles where x = 0, dot(x) > 0: 17 points>
    >>> round(float(section.columns["y"][1]), 6)
    0.342928
    """
    from lagrange_cli.simulate.ensemble.plan.recipe import Recipe
    from lagrange_cli.simulate.ensemble.plan.variants import variants_of
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition
    from lagrange_cli.simulate.options import SimulationOptions
    from lagrange_cli.simulate.simulation import RunContext
    from lagrange_cli.studies.section.members import (
        section_model,
        section_of_members,
        single_section,
    )

    written = WrittenCondition(condition, "section")
    options = SimulationOptions(
        until=until, accuracy=accuracy, method=method, rtol=rtol, atol=atol, budget=budget
    )
    known = section_model(derived.equations, written)
    if members is None:
        return single_section(known, options, RunContext(progress=progress))
    recipe = Recipe(derived.source, derived.forces, derived.formulation, section=written)
    models = variants_of(derived.equations, recipe, derived.model)
    values = members_given(members)
    return section_of_members(known, models, values, options, jobs=jobs, progress=progress)


def path(
    derived: Derived,
    start: GivenValues,
    end: GivenValues,
    *,
    accuracy: float = 1e-9,
    starts: int = 32,
    turns: int = 0,
    samples: int = 101,
    progress: Callable[[float], None] | None = None,
) -> Paths:
    """Find the paths of stationary action between two configurations at two times.

    Parameters
    ----------
    start, end
        Values of all coordinates and of the time ``t``, as numbers or as expressions over
        the parameters.
    accuracy, starts, turns, samples, progress
        See :func:`.studies.path.find.find_paths`.

    Raises
    ------
    InputError
        The motion is not that of stationary action, or as ``find_paths``.
    AccuracyError
        No path was found.

    Examples
    --------
    >>> derivation = load("systems/lecture/thrown_ball.yaml").derive()
    >>> paths = derivation.path({"x": 0, "z": 0, "t": 0}, {"x": 4, "z": 0, "t": 1})
    >>> paths.solutions[0].conjugacy.kind
    'minimum'
    """
    from lagrange_cli.studies.path.ends import end_of, read_ends
    from lagrange_cli.studies.path.find import find_paths

    written = end_of(start, "start"), end_of(end, "end")
    models = path_models(derived)
    first, last = read_ends(*written, models.motion.coordinates, derived.source.read)
    return find_paths(
        models,
        first,
        last,
        accuracy=accuracy,
        starts=starts,
        turns=turns,
        samples=samples,
        progress=progress,
    )


def path_models(derived: Derived) -> PathModels:
    """Return the models that :meth:`path` finds its solutions with.

    Raises
    ------
    InputError
        The motion is not that of stationary action, with the reason.
    """
    from lagrange_cli.studies.path.models import PathModels, periodic_coordinates, with_action

    acting = replace(derived, equations=with_action(derived.equations))
    rates = [f"dot({c.name})" for c in derived.equations.system.coordinates]
    return PathModels(acting.model(), acting.model(rates), periodic_coordinates(derived.equations))


def animate(
    derived: Derived,
    path: str | os.PathLike[str] | None = None,
    trajectory: Trajectory | Paths | None = None,
    *,
    speed: float | None = None,
) -> Film | None:
    """Write a film as ``.svg``, ``.gif`` or ``.mp4``, or the page of :meth:`page`.

    Parameters
    ----------
    path
        The file; without one the film is returned, and notebooks play it.
    trajectory
        A motion of these equations, or paths between two ends; by default that of
        :meth:`simulate`.
    speed
        Units of time in a second of the film: by default 1, or what makes a film of ten seconds
        where it would be shorter than a second or longer than a minute.

    Raises
    ------
    InputError
        The system has no picture, the ending or the speed is impossible, matplotlib is not
        installed, or ffmpeg is not there for an MP4.

    Examples
    --------
    >>> load("systems/pendulums/pendulum.yaml").derive().animate("swing.svg")
    """
    from lagrange_cli.drawn import Film
    from lagrange_cli.files import ending_of, write_file
    from lagrange_cli.studies.path.result import Paths

    if isinstance(trajectory, Paths):
        motions = [
            (f"{number}: {one.conjugacy.kind}", one.trajectory)
            for number, one in enumerate(trajectory.solutions, 1)
        ]
    elif path is not None and ending_of(path) == ".html":
        write_file(path, page(derived, trajectory).encode("utf-8"))
        return None
    else:
        motions = [("", trajectory or simulate(derived))]
    film = Film(derived.equations, motions, speed)
    if path is None:
        return film
    film.write(path)
    return None


def page(derived: Derived, trajectory: Trajectory | None = None, *, language: str = "en") -> str:
    """Return an HTML page on which the system moves, as ``lagrange show`` writes it.

    The page integrates the emitted JavaScript itself, and compares its motion with a simulated one.

    Parameters
    ----------
    trajectory
        The simulated motion, with the scene's parameters and start; by default that of
        :meth:`simulate`.
    language
        The language of its words: ``en``, ``de`` or ``fr``.

    Raises
    ------
    InputError
        The scene has no start, nothing that could be drawn, or more than emitted JavaScript holds.

    Examples
    --------
    >>> derivation = load("systems/pendulums/pendulum.yaml").derive()
    >>> derivation.page()[:15]
    '<!DOCTYPE html>'
    """
    from lagrange_cli.pages.page import page_of, require_shown

    require_shown(derived.equations)
    return page_of(derived.equations, trajectory or simulate(derived), language)
