"""Run the members of an ensemble in blocks, on several cores.

Each member is the motion that :func:`.charts.simulation.simulate_past_singularities` gives for it
alone, with an accuracy of its own. Members that cannot be run are listed with the reason. The store
keeps finished blocks beside the result, so that an interrupted run goes on from them.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import closing
from dataclasses import replace
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.files import sole_writer
from lagrange_cli.files.rows import DECIMAL_NUMBER
from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.ensemble.plan.enumeration import MOST_LISTED, Members
from lagrange_cli.simulate.ensemble.plan.plan import (
    Blocks,
    MemberModels,
    Plan,
    Selection,
    Task,
    blocks_of,
    plan_members,
)
from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues
from lagrange_cli.simulate.ensemble.plan.variants import NumericMembers
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Motions
from lagrange_cli.simulate.ensemble.reduce.selection import Selector
from lagrange_cli.simulate.ensemble.run.batched_results import (
    BatchedResults,
    Missed,
    batched_results,
)
from lagrange_cli.simulate.ensemble.store.blocks import (
    MEMBER_FIGURES,
    MEMBER_WORDS,
    BlockBuilder,
    BlockPart,
    FinishedBlock,
    MemberBlock,
)
from lagrange_cli.simulate.ensemble.store.opening import open_store
from lagrange_cli.simulate.ensemble.store.result import Ensemble
from lagrange_cli.simulate.ensemble.store.store import MemoryStore, Store
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.parallel import Aside, in_any_order, in_threads
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.simulation import RunContext, trajectory_of
from lagrange_cli.simulate.system.functions import KeptFunctions, RightHandSide

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.store.store import Store

_Result = TypeVar("_Result")

#: The status of a member that cannot be begun.
REFUSED = "refused"


class _Runner:
    """Models and functions of a process that run the members of a plan, made once."""

    def __init__(self, plan: Plan) -> None:
        self.plan = plan
        self.scene = plan.recipe.scene()
        self._numbers = NumericMembers(plan.recipe, plan.member, plan.model) if plan.alone else None
        self.functions = KeptFunctions()
        request = resolve(plan.model, plan.options)
        self._selector = Selector.for_model(request, plan.model, plan.selection)
        sizes = {size.name for size in self.scene.sizes}
        self._parameters = sizes | {p.name for p in self.scene.parameters}

    @cached_property
    def batched(self) -> BatchedResults | None:
        """The results of members stepped in lanes; None if each is run by itself."""
        if not self.plan.alone:
            return None
        return batched_results(
            self.plan.model, self.plan.options, self.plan.extra, self.plan.selection
        )

    def gathering(self, task: Task) -> BlockBuilder:
        """Return an empty block for the members of a task."""
        plan = self.plan
        expected = () if self.batched is None else self._selector.written(self.batched.names)
        return BlockBuilder(plan.names, len(task.rows), plan.samples, expected)

    def decide(self, task: Task, builder: BlockBuilder, between: Callable[[], None]) -> None:
        """Add the members whose results batched runs decide."""
        if self.batched is not None:
            for part in self._batched_parts(self.batched, task, between):
                builder.take(part)

    def _batched_parts(
        self, batched: BatchedResults, task: Task, between: Callable[[], None]
    ) -> Iterator[BlockPart]:
        numbers, parameters, starts = self._evaluated(task)
        if len(numbers) == 0:
            return
        for part in batched.run(starts, parameters, between):
            if isinstance(part, Missed):
                number = int(numbers[part.number])
                yield self._missed(batched, number, task.rows[number], part.measured)
                continue
            known = {p.name: parameters[:, i] for i, p in enumerate(self.plan.model.parameters)}
            known |= dict(zip(self.plan.model.state_names, starts.T, strict=True))
            varied = {name: known[name][part.members] for name in self.plan.names}
            yield replace(part, members=numbers[part.members].tolist(), varied=varied)

    def _evaluated(self, task: Task) -> tuple[NDArray[np.int64], Array, Array]:
        """Return the numbers of members that differ in numbers alone, parameters and starts."""
        assert self._numbers is not None
        if task.numbers is not None:
            numbers = dict(zip(self.plan.names, task.numbers, strict=True))
            evaluated = self._numbers.plain_numbers(numbers)
            if evaluated is not None:
                return evaluated
        members = {k: x for k, row in enumerate(task.rows) if (x := self._values(row)) is not None}
        parameters = [[x or 0.0 for x in values] for values, _ in members.values()]
        starts = [start for _, start in members.values()]
        return np.array(list(members), np.int64), np.array(parameters), np.array(starts, float)

    def _values(
        self, texts: Sequence[str]
    ) -> tuple[tuple[float | None, ...], tuple[float, ...]] | None:
        """Evaluate parameters and start of a member; None if it differs in more than numbers."""
        assert self._numbers is not None
        try:
            return self._numbers.values(self._values_of(texts))
        except InputError:
            return None

    def _values_of(self, texts: Sequence[str]) -> MemberValues:
        return MemberValues.divided(
            dict(zip(self.plan.names, texts, strict=True)), self._parameters
        )

    def _missed(
        self, batched: BatchedResults, number: int, texts: Sequence[str], measured: Measured
    ) -> BlockPart:
        """Return the part of a member whose accuracy was measured to be missed."""
        assert self._numbers is not None
        model = self._numbers.model_of(self._values_of(texts))
        assert model is not None
        request = replace(batched.request, initial=np.array(model.initial, dtype=float))
        result = trajectory_of(model, request, self.functions(model), measured)
        return self._part(number, texts, model, result, self._selector.motion(model, result))

    def single(self, number: int, texts: Sequence[str]) -> BlockPart:
        """Run a member by itself."""
        member = self._values_of(texts)
        try:
            model = None if self._numbers is None else self._numbers.model_of(member)
            functions = None if model is None else self.functions(model)
            model = model or self.plan.recipe.model(member)
            run = partial(self._simulated, member, model, functions)
            result = run()
            motion = self._selector.refined_motion(model, result, run)
        except InputError as refusal:
            words = {"status": REFUSED, "reason": refusal.problems[0].message}
            return BlockPart([number], {}, {}, self._varied(texts, {}), {}, {}, words)
        return self._part(number, texts, model, result, motion)

    def _part(
        self,
        number: int,
        texts: Sequence[str],
        model: Model,
        result: Trajectory,
        motion: Motions | None,
    ) -> BlockPart:
        values = {p.name: p.value for p in model.parameters}
        values |= {name: float(column[0]) for name, column in result.columns.items()}
        columns = result.table(self.plan.extra)
        columns.pop("t")
        scales = {name: _one(value) for name, value in result.scales.items() if result.requested}
        figures = {name: getattr(result, name) for name in MEMBER_FIGURES}
        selector = replace(self._selector, model=model)
        ended = len(result.t) == self.plan.samples
        return BlockPart(
            [number],
            {name: columns[name][None] for name in self._selector.written(columns)},
            self._of_motion(columns) | selector.reduced(motion, ended=ended),
            self._varied(texts, values),
            scales,
            {name: _one(value) for name, value in figures.items()},
            {name: str(getattr(result, name)) for name in MEMBER_WORDS},
        )

    def _of_motion(self, columns: Mapping[str, Array]) -> dict[str, Array]:
        """Return the numbers to store of a motion, whose columns may end before the last sample."""
        whole = {name: np.full((1, self.plan.samples), np.nan) for name in columns}
        for name, column in columns.items():
            whole[name][0, : len(column)] = column
        numbers = self._selector.numbers(whole)
        if self.plan.selection.final:
            names = self._selector.without_reductions(columns)
            numbers |= {f"final/{name}": whole[name][:, -1] for name in names}
        return numbers

    def _varied(self, texts: Sequence[str], values: Mapping[str, float | None]) -> dict[str, Array]:
        """Return the numbers that the texts of a member stand for, NaN if that is not known."""
        varied = {}
        for name, text in zip(self.plan.names, texts, strict=True):
            value = values.get(name)
            if value is None and DECIMAL_NUMBER.fullmatch(text):
                value = float(text)
            varied[name] = _one(value)
        return varied

    def _simulated(
        self,
        member: MemberValues,
        model: Model,
        functions: RightHandSide | None,
        times: tuple[float, ...] | None = None,
    ) -> Trajectory:
        recipe, options = self.plan.recipe, self.plan.options
        if times is not None:
            options = replace(options, times=times, until=None, samples=None, step=None)
        return simulate_past_singularities(
            model,
            options,
            lambda: recipe.model(member, "multiplier"),
            RunContext(functions),
            formulation=recipe.formulation,
        )


def _one(value: float | None) -> Array:
    return np.array([np.nan if value is None else value], dtype=float)


@lru_cache(maxsize=1)
def _runner(plan: Plan) -> _Runner:
    return _Runner(plan)


#: Lock of the runs of single members, most of which is Python: threads take turns.
_one_by_one = threading.Lock()


def compile_ahead(plan: Plan) -> None:
    """Compile the code that runs the members of a plan, as far as it is known before."""
    runner = _runner(plan)
    if runner.batched is None and plan.alone:
        runner.functions(plan.model)


def run_block(task: Task, between: Callable[[], None] = lambda: None) -> MemberBlock | None:
    """Run the members of a task; None if an interrupt reached it.

    ``between``: called now and then; an exception that it raises ends the run.
    """
    runner = _runner(task.plan)
    builder = runner.gathering(task)
    try:
        runner.decide(task, builder, between)
    except KeyboardInterrupt:
        return None
    with _one_by_one:
        for single in _singles(task, builder):
            between()
            part = _run_single(single)
            if part.words["status"] == "stopped":
                return None
            builder.take(part)
    return builder.block(task.number)


def _run_in_thread(
    keep: Callable[[MemberBlock], _Result], both: tuple[Task, BlockBuilder], aside: Aside
) -> _Result | None:
    """Run and store the members of a task, single ones in other processes."""
    task, builder = both

    def between() -> None:
        if aside.stopped():
            raise KeyboardInterrupt

    try:
        _runner(task.plan).decide(task, builder, between)
        for part in aside.run(_run_single, _singles(task, builder)):
            builder.take(part)
    except (KeyboardInterrupt, CancelledError):
        return None
    return keep(builder.block(task.number))


def _singles(task: Task, builder: BlockBuilder) -> list[Task]:
    """Return the members of a task that are in no part yet, each as a task."""
    return [Task(task.plan, number, (task.rows[number],)) for number in builder.left]


def _run_single(task: Task) -> BlockPart:
    """Run the only member of a task, whose number is that of the task."""
    (texts,) = task.rows
    return _runner(task.plan).single(task.number, texts)


# All members.


class Engine(Protocol):
    """Runs blocks somewhere."""

    def __call__(
        self, blocks: Blocks, numbers: Iterable[int], store: Store, /
    ) -> Generator[FinishedBlock | None, None, None]:
        """Yield blocks as they are stored, by their numbers; None for one that was interrupted."""


def run_members(
    blocks: Blocks,
    store: Store,
    *,
    jobs: int | None = 1,
    engine: Engine | None = None,
    budget: float | None = None,
    progress: Callable[[float], None] | None = None,
) -> bool:
    """Run the blocks that are not in the store; return whether all of them are there now.

    Parameters
    ----------
    jobs
        Number of blocks at a time, see :func:`.simulate.parallel.in_any_order`.
    engine
        Runs blocks elsewhere than on this machine, in place of ``jobs``.
    budget
        Seconds after which no further block is waited for.
    progress
        Called with the part of the blocks that are finished.
    """
    started = time.perf_counter()
    waiting = (k for k in range(len(blocks)) if k not in store.finished)
    if engine is not None:
        run = engine(blocks, waiting, store)
    else:
        run = run_blocks(blocks.plan, map(blocks.task, waiting), jobs, store.writer)
    try:
        with closing(run):
            for block in run:
                if block is None:
                    return False
                store.finish(block)
                if progress is not None:
                    progress(len(store.finished) / len(blocks))
                if budget is not None and time.perf_counter() - started > budget:
                    break
    except KeyboardInterrupt:
        return False
    return len(store.finished) == len(blocks)


def run_blocks(
    plan: Plan, tasks: Iterable[Task], jobs: int | None, keep: Callable[[MemberBlock], _Result]
) -> Generator[_Result | None, None, None]:
    """Yield the results of ``keep`` for the blocks of a plan's tasks, as they are finished; None
    for a block that an interrupt reached.

    ``keep`` is called where a block is run, and a task is asked for when it can be begun. Members
    that are stepped side by side are run by threads of this process, others by
    :func:`.simulate.parallel.in_any_order`.
    """
    if jobs not in (None, 1) and _runner(plan).batched is not None:
        # Memory is taken here: what one thread takes and another frees is not used again.
        both = ((task, _runner(task.plan).gathering(task)) for task in tasks)
        yield from in_threads(partial(_run_in_thread, keep), both, jobs)
    else:
        yield from in_any_order(partial(_run_and_keep, keep), tasks, jobs)


def _run_and_keep(keep: Callable[[MemberBlock], _Result], task: Task) -> _Result | None:
    block = run_block(task)
    return None if block is None else keep(block)


def simulate_members(
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    *,
    extra: tuple[str, ...] = (),
    selection: Selection = Selection(),  # noqa: B008
    output: str | None = None,
    resume: bool = False,
    jobs: int | None = 1,
    engine: Engine | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Simulate all members.

    Parameters
    ----------
    models, members, options, extra, selection
        As for :func:`.plan.plan.plan_members`.
    output, resume
        As for :func:`.opening.open_store`; None for a result in memory.
    jobs, engine, progress
        As for :func:`run_members`.

    Raises
    ------
    InputError
        As :func:`.plan.plan.plan_members` and :func:`.opening.open_store`; or samples of more
        members are asked for than memory may hold; or a run with functions of motions is resumed.
    """
    if resume and selection.functions:
        message = "an ensemble with functions of motions does not go on from an interrupted run"
        hint = "whether they are the same functions cannot be told: run it without resume=True"
        raise InputError(Problem(message, Mark("functions", 1, 1), hint, "ensemble"))
    if output is None and len(members) > MOST_LISTED and selection.columns != ():
        message = f"more than {MOST_LISTED:,} members, whose samples are to be in memory"
        hint = "columns=[] with final=True keeps a few numbers of each; store='out.zarr' all"
        raise InputError(Problem(message, Mark("members", 1, 1), hint, "ensemble"))
    plan, times = plan_members(models, members, options, extra=extra, selection=selection)
    blocks = blocks_of(plan, members)
    with sole_writer(output):
        if output is None:
            store: Store = MemoryStore(blocks.size)
        else:
            store = open_store(output, blocks, resume=resume)
        if not run_members(blocks, store, jobs=jobs, engine=engine, progress=progress):
            raise KeyboardInterrupt
        store.complete(times)
    return store.ensemble(plan.model.name, times)
