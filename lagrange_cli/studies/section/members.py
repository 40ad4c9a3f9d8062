"""Models with the condition of a section, and sections of one motion or of an ensemble's."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import InputError
from lagrange_cli.simulate.ensemble.plan.enumeration import MOST_LISTED, Members, too_many
from lagrange_cli.simulate.ensemble.plan.plan import MemberModels, Plan, plan_members
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues
from lagrange_cli.simulate.ensemble.plan.variants import NumericMembers
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.parallel import in_any_order
from lagrange_cli.simulate.simulation import RunContext
from lagrange_cli.simulate.system.functions import KeptFunctions
from lagrange_cli.studies.section.find import section_points
from lagrange_cli.studies.section.result import REFUSED, Section, SectionPoints

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition


@dataclass(frozen=True)
class SectionModel:
    """A model whose outputs include the condition of a section.

    Attributes
    ----------
    condition
        The condition as it was written.
    model
        The model.
    free, turning
        As in :class:`.result.Section`.
    """

    condition: str
    model: Model
    free: tuple[str, ...]
    turning: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return values that JSON holds."""
        return {**vars(self), "model": self.model.to_json()}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> SectionModel:
        """Make what :meth:`to_json` gave."""
        known = (tuple(value[name]) for name in ("free", "turning"))
        return cls(value["condition"], Model.from_json(value["model"]), *known)


def section_model(equations: Equations, condition: WrittenCondition) -> SectionModel:
    """Make the model of a section of the motions of equations.

    Raises
    ------
    InputError
        As :func:`.simulate.model.requested_outputs.with_section`.
    """
    from lagrange_cli.simulate.model.build import model_of
    from lagrange_cli.simulate.model.requested_outputs import (
        free_coordinates,
        turning_coordinates,
        with_section,
    )

    return SectionModel(
        condition.text.strip(),
        model_of(with_section(equations, condition)),
        free_coordinates(equations, condition),
        turning_coordinates(equations),
    )


@dataclass(frozen=True)
class _Task:
    """A member whose points are to be computed.

    Attributes
    ----------
    number
        Its number.
    model
        Its model, or the refusal of it.
    texts
        Its values, as texts.
    options, deadline
        As :func:`.find.section_points` has them.
    """

    number: int
    model: Model | InputError
    texts: Mapping[str, str]
    options: SimulationOptions
    deadline: float | None


def single_section(known: SectionModel, options: SimulationOptions, context: RunContext) -> Section:
    """Compute the section of the motion of a model; refuse as :func:`.find.section_points`."""
    points = section_points(known.model, options, context, _deadline(options))
    return _section(known, (points,))


def section_of_members(
    known: SectionModel,
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    *,
    jobs: int | None = 1,
    progress: Callable[[float], None] | None = None,
) -> Section:
    """Compute the section of the motions of all members.

    Parameters
    ----------
    known
        Model of the scene's own values, with the section.
    models
        Source of their models, which have the outputs of the section.
    members, options
        As for :func:`.simulate.ensemble.run.run.simulate_members`. The budget is that of all
        members together.
    jobs
        Members at a time, see :func:`.simulate.parallel.in_any_order`.
    progress
        Called with the part of the members that are finished.

    Raises
    ------
    InputError
        Located: as ``simulate_members``.
    """
    if len(members) > MOST_LISTED:
        raise too_many(members.heads[0], MOST_LISTED)
    plan, _ = plan_members(models, members, options)
    deadline = _deadline(options)
    tasks = _tasks(plan, models, members, options, deadline)
    points: dict[int, SectionPoints | InputError] = {}
    for number, result in in_any_order(_member, tasks, jobs):
        points[number] = result
        if progress is not None:
            progress(len(points) / len(members))
    numbers = range(len(members))
    return _section(known, tuple(_refused(points[k], members.values(k)) for k in numbers))


def _tasks(
    plan: Plan,
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    deadline: float | None,
) -> Iterator[_Task]:
    """Make the model of each member, of numbers alone where that is possible."""
    scene = plan.recipe.scene()
    numeric = NumericMembers(plan.recipe, plan.member, plan.model) if plan.alone else None
    for number in range(len(members)):
        texts = members.values(number)
        values = MemberValues.for_scene(texts, scene)
        model: Model | InputError | None = None
        try:
            model = None if numeric is None else numeric.model_of(values)
            model = models.model_of(values) if model is None else model
        except InputError as refusal:
            model = refusal
        yield _Task(number, model, texts, options, deadline)


def _deadline(options: SimulationOptions) -> float | None:
    return None if options.budget is None else time.monotonic() + options.budget


def _section(known: SectionModel, points: tuple[SectionPoints, ...]) -> Section:
    model = known.model
    return Section(
        name=model.name,
        condition=known.condition,
        members=points,
        coordinates=model.coordinates,
        free=known.free,
        turning=known.turning,
        labels=model.labels,
    )


@cache
def _shared_functions() -> KeptFunctions:
    """Return the compiled functions that the members of this process share."""
    return KeptFunctions()


def _member(task: _Task) -> tuple[int, SectionPoints | InputError]:
    """Compute the points of a member, or return its refusal."""
    if isinstance(task.model, InputError):
        return task.number, task.model
    try:
        context = RunContext(kept_functions=_shared_functions())
        points = section_points(task.model, task.options, context, task.deadline)
    except InputError as refusal:
        return task.number, refusal
    return task.number, replace(points, given=task.texts)


def _refused(points: SectionPoints | InputError, texts: Mapping[str, str]) -> SectionPoints:
    """Return the points of a member; none of one that cannot be begun."""
    if isinstance(points, SectionPoints):
        return points
    return SectionPoints(
        t=np.empty(0),
        columns={},
        energy=np.empty(0),
        error=None,
        open=(),
        status=REFUSED,
        reason=points.problems[0].message,
        requested=None,
        estimated=None,
        scales={},
        holds_until=None,
        energy_drift=None,
        method="",
        runs=0,
        seconds=0.0,
        given=texts,
    )
