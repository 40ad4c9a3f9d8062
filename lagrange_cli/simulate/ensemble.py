"""Many motions of one scene, that differ in parameters and initial values.

Members are run in blocks, on as many cores as are asked for; each is what
:func:`.charts.simulate_past_charts` gives for it alone, with an accuracy of its own. What
cannot be run is listed with the reason. Blocks that are finished are kept beside the
result (:mod:`.ensemble_store`), so that an interrupted run goes on with the others.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from lagrange_cli.errors import InputError
from lagrange_cli.files.rows import NUMBER
from lagrange_cli.simulate.charts import simulate_past_charts
from lagrange_cli.simulate.integrators.base import Array
from lagrange_cli.simulate.members import Numbers, Own, Recipe
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.parallel import in_any_order
from lagrange_cli.simulate.right_hand_side import RightHandSide, right_hand_sides
from lagrange_cli.simulate.trajectory import Trajectory

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble_store import Store

__all__ = ["REFUSED", "Block", "Plan", "Task", "run_block", "run_members", "tasks_of"]

#: The status of a member that cannot be begun.
REFUSED = "refused"

#: Members of a block, and into how many blocks fewer members are divided.
LARGEST_BLOCK, FEWEST_BLOCKS = 32, 16

#: What is known of each member: numbers, and texts.
FIGURES = (
    *("estimated", "holds_until", "energy_drift", "constraint_drift"),
    *("steps", "rhs_evaluations", "all_evaluations"),
)
WORDS = ("status", "reason", "method", "formulation")


@dataclass(frozen=True)
class Plan:
    """What all members share.

    ``names`` are those that differ; ``own`` what the member has whose model is ``model``;
    ``alone``: members differ in numbers alone. ``how`` are options of
    :func:`.simulation.simulate`, ``extra`` further columns. ``key`` is the hash of all that
    results depend on; plans of one key are one plan.
    """

    key: str
    recipe: Recipe = field(compare=False)
    names: tuple[str, ...] = field(compare=False)
    own: Own = field(compare=False)
    model: Model = field(compare=False)
    alone: bool = field(compare=False)
    samples: int = field(compare=False)
    how: Mapping[str, Any] = field(compare=False)
    extra: tuple[str, ...] = field(compare=False, default=())
    columns: bool = field(compare=False, default=True)


@dataclass(frozen=True)
class Task:
    """A block of members: the number of the block, and their texts for the plan's names."""

    plan: Plan
    number: int
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Block:
    """What became of the members of a task.

    ``columns``: name → values, shape (members, samples), NaN where nothing holds; empty where
    the plan asks for none. ``given``: the number that each name of the plan stands for;
    ``figures`` and ``words`` one value a member.
    """

    number: int
    columns: Mapping[str, Array]
    given: Mapping[str, Array]
    figures: Mapping[str, Array]
    words: Mapping[str, list[str]]


class _Runner:
    """What a process needs to run members of a plan, made once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.scene = plan.recipe.scene()
        self._numbers = Numbers(plan.recipe, plan.own, plan.model) if plan.alone else None
        self._functions: Callable[[Model], RightHandSide] | None = None

    def run(self, texts: Sequence[str]) -> tuple[Trajectory | str, dict[str, float]]:
        """The motion of a member or why there is none, and the numbers that were given."""
        own = Own.of(dict(zip(self.plan.names, texts, strict=True)), self.scene)
        given = {
            name: float(text) if NUMBER.fullmatch(text) else np.nan
            for name, text in zip(self.plan.names, texts, strict=True)
        }
        try:
            model = None if self._numbers is None else self._numbers.of(own)
            functions = None if model is None else self._bound(model)
            model = model or self.plan.recipe.model(own)
            found = self._simulated(own, model, functions)
        except InputError as refusal:
            return refusal.problems[0].message, given
        values = {p.name: p.value for p in model.parameters}
        values |= {name: column[0] for name, column in found.columns.items()}
        known = {name: values[name] for name in given if values.get(name) is not None}
        return found, {**given, **{name: float(x) for name, x in known.items() if x is not None}}

    def _bound(self, model: Model) -> RightHandSide:
        if self._functions is None:
            self._functions = right_hand_sides(self.plan.model)
        return self._functions(model)

    def _simulated(self, own: Own, model: Model, functions: RightHandSide | None) -> Trajectory:
        recipe = self.plan.recipe
        free = recipe.form(self.scene) == "auto"
        return simulate_past_charts(
            model,
            (lambda: recipe.model(own, "multiplier")) if free else None,
            functions=functions,
            **self.plan.how,
        )


@lru_cache(maxsize=1)
def _runner(plan: Plan) -> _Runner:
    return _Runner(plan)


def run_block(task: Task) -> Block | None:
    """Run the members of a task; None where an interrupt reached it."""
    runner = _runner(task.plan)
    found, given = [], []
    for texts in task.rows:
        outcome, numbers = runner.run(texts)
        if isinstance(outcome, Trajectory) and outcome.status == "stopped":
            return None
        found.append(outcome)
        given.append(numbers)
    return Block(
        task.number,
        _columns(task.plan, found) if task.plan.columns else {},
        {name: np.array([numbers[name] for numbers in given]) for name in task.plan.names},
        {name: np.array([_figure(of, name) for of in found]) for name in FIGURES},
        {name: [_word(of, name) for of in found] for name in WORDS},
    )


def _figure(found: Trajectory | str, name: str) -> float:
    value = None if isinstance(found, str) else getattr(found, name)
    return np.nan if value is None else float(value)


def _word(found: Trajectory | str, name: str) -> str:
    if isinstance(found, str):
        return {"status": REFUSED, "reason": found}.get(name, "")
    return str(getattr(found, name))


def _columns(plan: Plan, found: Sequence[Trajectory | str]) -> dict[str, Array]:
    """Every column of any member, filled with NaN."""
    tables = [of.table(plan.extra) if isinstance(of, Trajectory) else {} for of in found]
    names = dict.fromkeys(name for table in tables for name in table if name != "t")
    columns = {name: np.full((len(found), plan.samples), np.nan) for name in names}
    for k, table in enumerate(tables):
        for name in names:
            if name in table:
                columns[name][k, : len(table[name])] = table[name]
    return columns


# All of them.


def tasks_of(plan: Plan, rows: Sequence[tuple[str, ...]]) -> list[Task]:
    """The members in blocks, which do not depend on where they are run."""
    size = max(1, min(LARGEST_BLOCK, len(rows) // FEWEST_BLOCKS))
    return [
        Task(plan, number, tuple(rows[first : first + size]))
        for number, first in enumerate(range(0, len(rows), size))
    ]


def run_members(
    tasks: Sequence[Task],
    store: Store,
    *,
    jobs: int | None = 1,
    budget: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> bool:
    """Run the tasks whose blocks are not in the store; whether all of them are there now.

    Parameters
    ----------
    jobs
        How many blocks at a time, see :func:`.parallel.in_any_order`.
    budget
        Seconds after which no further block is waited for.
    progress
        Called with the part of the blocks that are finished.
    """
    started = time.perf_counter()
    waiting = [task for task in tasks if task.number not in store.finished]
    try:
        for _ in _kept(waiting, store, jobs):
            if progress is not None:
                progress(len(store.finished) / len(tasks))
            if budget is not None and time.perf_counter() - started > budget:
                break
    except KeyboardInterrupt:
        return False
    return len(store.finished) == len(tasks)


def _kept(tasks: Sequence[Task], store: Store, jobs: int | None) -> Iterator[int]:
    """The number of each block, as soon as it is kept."""
    blocks = in_any_order(run_block, tasks, jobs)
    with closing(_iterated(blocks)) as found:
        for block in found:
            if block is None:
                raise KeyboardInterrupt
            store.keep(block)
            yield block.number


def _iterated(blocks: Iterator[Block | None]) -> Generator[Block | None, None, None]:
    """The same, so that it can be closed."""
    yield from blocks
