"""Simulation past singular configurations of a scene's coordinates, where there are any."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lagrange_cli.errors import AccuracyError, Problem
from lagrange_cli.simulate.simulation import RunContext, integrate

if TYPE_CHECKING:
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.options import SimulationOptions
    from lagrange_cli.simulate.results.trajectory import Trajectory


def simulate_with_sensitivities(
    model: Model, options: SimulationOptions, context: RunContext
) -> Trajectory:
    """Simulate a model with derivatives of its motion, whose coordinates are kept.

    Raises
    ------
    AccuracyError
        The motion passed a singular configuration of the coordinates: derivatives do not.
    InputError
        As :func:`.simulate.simulation.simulate`.
    """
    trajectory = integrate(model, context.resolved(model, options), context)
    if not model.singular:
        return trajectory
    from lagrange_cli.simulate.charts.detection import passage_of_run

    factors = context.functions_of(model, options.budget).singular
    passage = passage_of_run(model, factors, trajectory)
    if passage is None or not passage.passed:
        return trajectory
    time = trajectory.t[passage.samples - 1]
    raise AccuracyError(
        Problem(
            f"the coordinates are singular where {passage.singularity.where}, which the motion"
            f" passes after t = {time:.6g}: its derivatives are not known from there on",
            hint=f"--until {time:.6g}, or other coordinates",
            rule="sensitivity",
        )
    )


def simulate_past_singularities(
    model: Model,
    options: SimulationOptions,
    with_multipliers: Callable[[], Model] | None = None,
    context: RunContext | None = None,
    *,
    formulation: str | None = None,
) -> Trajectory:
    """Simulate a model, in other coordinates where its own are singular on the way.

    Parameters
    ----------
    model
        What is to be simulated.
    options
        What the user asks for.
    with_multipliers
        Makes the model of the same scene with multipliers, or refuses; None if
        the scene's coordinates are to be kept.
    context
        Means and listeners of the run; by default as :class:`.simulate.simulation.RunContext` has
        them.
    formulation
        The one asked for, None for the scene's: the coordinates are kept unless it is the
        program's choice.

    Raises
    ------
    InputError
        As :func:`.simulate.simulation.simulate`.
    """
    context = context or RunContext()
    if (model.chart is None and not model.singular) or model.controllers:
        return integrate(model, context.resolved(model, options), context)
    # Most systems do without.
    from lagrange_cli.simulate.charts.passages import simulate_in_charts

    if (formulation or model.defaults.formulation or "auto") != "auto":
        with_multipliers = None
    return simulate_in_charts(model, options, with_multipliers, context)
