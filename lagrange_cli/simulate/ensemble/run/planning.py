"""Plan an ensemble: the model and the options that all of its members share; run it in memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from lagrange_cli.cache import digest, fingerprint
from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.files import sole_writer
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.enumeration import MOST_LISTED, Members
from lagrange_cli.simulate.ensemble.plan.plan import Plan, blocks_of
from lagrange_cli.simulate.ensemble.plan.recipe import (
    MemberValues,
    Recipe,
    require_known_names,
    varied_parameters,
)
from lagrange_cli.simulate.ensemble.reduce.selection import Kept
from lagrange_cli.simulate.ensemble.run.run import Engine, run_members
from lagrange_cli.simulate.ensemble.store.opening import open_store
from lagrange_cli.simulate.ensemble.store.result import Ensemble
from lagrange_cli.simulate.ensemble.store.store import MemoryStore, Store
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.system.inputs import digest_of_files

if TYPE_CHECKING:
    from lagrange_cli.scene.model import Scene

#: Members that are tried until one can be derived.
_MOST_TRIED = 3


class MemberModels(Protocol):
    """Models of a scene with the values of members, made or kept from before."""

    @property
    def recipe(self) -> Recipe:
        """The scene, and what options say of all members."""

    def of(self, member: MemberValues) -> Model:
        """Return the model of a member; refuses as :meth:`.members.Recipe.model`."""

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Answer :func:`.members.differ_in_numbers` for the model that :meth:`of` returned."""


def plan_members(
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    *,
    extra: tuple[str, ...] = (),
    kept: Kept = Kept(),  # noqa: B008
) -> tuple[Plan, Array]:
    """Plan the runs of all members; return the times of the samples as well, shape (samples,).

    Parameters
    ----------
    models
        Where models come from.
    members
        Values of all members.
    options
        What is asked for of each. The budget is that of all together, and no part of the plan.
    extra
        Further columns.
    kept
        What is kept of each beside figures.

    Raises
    ------
    InputError
        Located: the scene, the members or the options are wrong.
    """
    recipe = models.recipe
    scene = recipe.scene()
    require_known_names(members, scene)
    _require_common_times(scene, MemberValues.of(members.values(0), scene), members)
    values, model = _first_model(models, members, scene)
    options = replace(options, budget=None)
    _require_columns(kept, model, extra)
    times = np.asarray(resolve(model, options).times)
    plan = Plan(
        key=_key(recipe, model, options, extra, members, kept),
        recipe=recipe,
        names=members.names,
        member=values,
        model=model,
        alone=models.differ_in_numbers(values, model),
        samples=len(times),
        options=options,
        extra=extra,
        kept=kept,
    )
    return plan, times


def simulate_members(
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    *,
    extra: tuple[str, ...] = (),
    kept: Kept = Kept(),  # noqa: B008
    output: str | None = None,
    resume: bool = False,
    jobs: int | None = 1,
    engine: Engine | None = None,
    progress: Callable[[float], None] | None = None,
) -> Ensemble:
    """Simulate all members.

    Parameters
    ----------
    models, members, options, extra, kept
        As for :func:`plan_members`.
    output, resume
        As for :func:`.opening.open_store`; None for a result in memory.
    jobs, engine, progress
        As for :func:`.run.run_members`.

    Raises
    ------
    InputError
        As :func:`plan_members`, :func:`.opening.open_store`; or samples of more members are wanted
        than memory may hold; or functions of motions are to be resumed.
    """
    if resume and kept.functions:
        message = "an ensemble with functions of motions does not go on from an interrupted run"
        hint = "whether they are the same functions cannot be told: run it without resume=True"
        raise InputError(Problem(message, Mark("functions", 1, 1), hint, "ensemble"))
    if output is None and len(members) > MOST_LISTED and kept.columns != ():
        message = f"more than {MOST_LISTED:,} members, whose samples are to be in memory"
        hint = "columns=[] with final=True keeps a few numbers of each; store='out.zarr' all"
        raise InputError(Problem(message, Mark("members", 1, 1), hint, "ensemble"))
    plan, times = plan_members(models, members, options, extra=extra, kept=kept)
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


def _require_columns(kept: Kept, model: Model, extra: tuple[str, ...]) -> None:
    """Refuse names of columns that a motion of the model does not have."""
    places = [form.format(name) for name in model.cartesian for form in ("{}", "dot({})")]
    known = [*model.state_names, *places, *model.outputs]
    if "energy" in extra:
        known.append("energy")
    if "forces" in extra:
        known += [*model.symbols, *model.forces]
    for name in kept.columns or ():
        if name not in known:
            hint = nearest(name, known)
            raise InputError(Problem(f"there is no column '{name}'", hint=hint, rule="ensemble"))


def _require_common_times(scene: Scene, values: MemberValues, members: Members) -> None:
    """Refuse sample times that differ between members."""
    from lagrange_cli.scene.language.expression import names_in

    different = varied_parameters(scene, values)
    for entry in fields(scene.simulate):
        expression = getattr(scene.simulate, entry.name)
        node = getattr(expression, "node", None)
        if node is not None and {name.name for name in names_in(node)} & different:
            raise InputError(
                Problem(
                    f"'{entry.name}' differs between members: it rests on what they vary,"
                    f" {', '.join(members.names)}",
                    expression.mark(),
                    hint="give a number, as --until 10",
                    rule="ensemble",
                )
            )


def _first_model(
    models: MemberModels, members: Members, scene: Scene
) -> tuple[MemberValues, Model]:
    """Return the values and the model of a member that can be derived, of the few that are tried.

    Raises
    ------
    InputError
        None of them can; that of the first, located at its values.
    """
    refusals = []
    for member in list(dict.fromkeys((0, len(members) - 1, len(members) // 2)))[:_MOST_TRIED]:
        values = MemberValues.of(members.values(member), scene)
        try:
            return values, models.of(values)
        except InputError as refusal:
            refusals.append(_located(refusal, members, member, scene))
    raise refusals[0]


def _located(refusal: InputError, members: Members, member: int, scene: Scene) -> InputError:
    """Put the problems with a member's values at their places in the file or range."""
    from lagrange_cli.scene import declares

    problems = []
    for problem in refusal.problems:
        mark = problem.mark or Mark("", 0, 0)
        option, _, name = mark.file.partition(" ")
        if option in ("-p", "-i") and name in members.names:
            head = members.heads[members.names.index(name)]
            wrong_name = mark.column == 1 and not declares(scene, name)
            problem = replace(problem, mark=head if wrong_name else members.mark(member, name))
        problems.append(problem)
    return InputError(*problems)


def _key(
    recipe: Recipe,
    model: Model,
    options: SimulationOptions,
    extra: tuple[str, ...],
    members: Members,
    kept: Kept,
) -> str:
    """Hash all that results depend on."""
    text = recipe.text
    values = [sorted(texts.items()) for texts in (text.parameters, text.initial, text.times)]
    question = [values, recipe.formulation, extra, sorted(vars(options).items())]
    named = [members.identity(), kept.key]
    inputs = digest_of_files(model.recordings)
    return digest("ensemble", fingerprint(), text.data, inputs, *map(repr, (question, named)))
