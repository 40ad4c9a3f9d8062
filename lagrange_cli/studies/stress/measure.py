"""Push a scene to its extremes, and count which results hold, are refused, or degrade.

Every point is simulated as ``lagrange simulate`` would with its values. Its trajectory is compared
with a :mod:`reference <.reference>` of much higher accuracy, by other methods and in wider
arithmetic, else with another formulation.
"""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lagrange_cli.drawn import Reported
from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.files import CarriedFile, FileColumn, carried_files, reading_carried
from lagrange_cli.scene.dimensions import dimensions
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe, numeric_values
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.parallel import in_any_order
from lagrange_cli.simulate.request import resolve
from lagrange_cli.studies.stress.points import STRESS_AXES, Ground, points_of
from lagrange_cli.studies.stress.runs import StressRun, StressTask, run_point

if TYPE_CHECKING:
    from lagrange_cli.simulate.cluster.tasks import Cluster


@dataclass(frozen=True)
class Stress(Reported):
    """Results of the points of a scene.

    Attributes
    ----------
    name
        Name of the scene.
    runs
        Results in the order of the axes.
    left_out
        Axes of which the scene has no points.
    budget
        Seconds that the run of a point was allowed.
    """

    name: str
    runs: tuple[StressRun, ...]
    left_out: tuple[str, ...]
    budget: float

    @property
    def counts(self) -> dict[str, int]:
        """Count each outcome, beside them runs that could be compared with nothing (``unchecked``)
        and those whose error is larger than its estimate (``underestimated``)."""
        outcomes = Counter(run.outcome for run in self.runs)
        return {
            "runs": len(self.runs),
            "holds": outcomes["holds"],
            "degraded": outcomes["degraded"],
            "refused": outcomes["refused"],
            "wrong": outcomes["wrong"],
            "unchecked": sum(not run.checked for run in self.runs),
            "underestimated": sum(run.underestimated for run in self.runs),
        }


def stress(
    recipe: Recipe,
    *,
    axes: Sequence[str] | None = None,
    accuracy: float | None = None,
    budget: float = 5.0,
    jobs: int | None = 1,
    cluster: Cluster | None = None,
    progress: Callable[[float], None] | None = None,
) -> Stress:
    """Push a scene to its extremes.

    Parameters
    ----------
    recipe
        The scene with the options that all points share.
    axes
        Names of :data:`~.points.STRESS_AXES`; by default all.
    accuracy
        Accuracy that each point is asked for; by default the scene's.
    budget
        Seconds that the run of a point may take; each run of its reference may take twice as
        long.
    jobs
        Number of points at a time, see :func:`.simulate.parallel.in_any_order`.
    cluster
        Workers that run the points in place of this machine.
    progress
        Called with a fraction from 0 to 1 that never falls.

    Raises
    ------
    InputError
        The scene itself cannot be simulated, or an axis is unknown; or the cluster cannot be used.
    """
    for axis in axes or ():
        _require_known(axis)
    ground = _ground(recipe)
    resolve(ground.model, SimulationOptions(accuracy=accuracy, budget=budget))
    points = points_of(ground, axes)
    tasks = [StressTask(k, recipe, point, accuracy, budget) for k, point in enumerate(points)]
    runs: list[StressRun] = []
    for run in _run(tasks, ground.model, jobs, cluster):
        runs.append(run)
        if progress is not None:
            progress(len(runs) / len(tasks))
    with_points = {point.axis for point in points}
    return Stress(
        ground.model.name,
        tuple(sorted(runs, key=lambda run: run.number)),
        tuple(axis for axis in axes or STRESS_AXES if axis not in with_points),
        budget,
    )


def _run(
    tasks: list[StressTask], model: Model, jobs: int | None, cluster: Cluster | None
) -> Iterator[StressRun]:
    """Run points here or on a cluster, which is sent the files that the scene names."""
    if cluster is None:
        return in_any_order(run_point, tasks, jobs)
    cluster.admit()
    return cluster.in_any_order(_PointWork(carried_files(model.recordings)), tasks)


@dataclass(frozen=True)
class _PointWork:
    """Runs points on a worker.

    Attributes
    ----------
    files
        Contents of recorded inputs.
    """

    files: Mapping[FileColumn, CarriedFile]

    def prepare(self) -> None:
        """Compile nothing ahead: points differ in their equations."""

    def __call__(self, task: StressTask) -> StressRun:
        with _one_by_one, reading_carried(self.files):
            return run_point(task)


#: Lock of the runs of points, most of which is Python: threads of a worker take turns.
_one_by_one = threading.Lock()


def _require_known(axis: str) -> None:
    if axis not in STRESS_AXES:
        said = f"unknown axis '{axis}'"
        known = f"one of {', '.join(STRESS_AXES)}"
        hint = "\n".join(filter(None, (nearest(axis, STRESS_AXES), known)))
        raise InputError(Problem(said, hint=hint, rule="stress"))


def _ground(recipe: Recipe) -> Ground:
    """Gather the numbers of a scene that the axes start from."""
    scene, model = recipe.scene(), recipe.model(MemberValues())
    parameters, start = numeric_values(scene)
    return Ground(
        scene,
        model,
        {name: x for name, x in parameters.items() if x is not None},
        {name: x for name, x in start.items() if x is not None},
        dimensions(scene),
    )
