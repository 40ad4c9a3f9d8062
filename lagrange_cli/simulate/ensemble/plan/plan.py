"""The plan of an ensemble: the model and options that all members share, and blocks of members.

The division into blocks does not depend on where they are run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol
from uuid import uuid4

import numpy as np

from lagrange_cli.cache import digest, fingerprint
from lagrange_cli.errors import InputError, Mark, Problem, nearest
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.enumeration import Members
from lagrange_cli.simulate.ensemble.plan.recipe import (
    MemberValues,
    Recipe,
    require_known_names,
    varied_parameters,
)
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.requested_outputs import Reduction
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.system.inputs import digest_of_files

if TYPE_CHECKING:
    from lagrange_cli.scene.model import Scene

#: Members of the largest block that is run one by one: an interrupted run loses the blocks that it
#: is at work on, and a large one takes minutes. Not tuned.
_LARGEST_BLOCK = 32

#: Members of the largest block that is run batched: more of them, since lanes run empty at the end
#: of a block, but no more samples than a few megabytes. Not tuned.
_LARGEST_BATCHED = 256

#: The same where no samples are stored, whose blocks are small; benchmarks/ensemble_scale.py
#: measures blocks of this size.
_LARGEST_OF_NUMBERS = 8192

#: Blocks into which fewer members are divided, so that several cores have work. Not tuned.
_FEWEST_BLOCKS = 16

#: Members that are tried until one can be derived.
_MOST_TRIED = 3


@dataclass(frozen=True)
class MemberMotion:
    """The motion of a member, as functions of Python take it.

    Attributes
    ----------
    t
        Times of the samples, shape (samples,).
    columns
        Name → values, shape (samples,); NaN after the end of what is known.
    """

    t: Array
    columns: Mapping[str, Array]


#: Function of Python that makes a number of a motion.
MotionFunction = Callable[[MemberMotion], float]


@dataclass(frozen=True)
class Selection:
    """Columns and numbers to store of each member, beside its figures.

    Attributes
    ----------
    columns
        Names of the columns to store at every sample; None for all.
    final
        All columns are stored at the last sample.
    reductions
        Reductions of the motion to store, each with an estimate of its error.
    functions
        Further numbers of the motion by name, without an estimate.
    """

    columns: tuple[str, ...] | None = None
    final: bool = False
    reductions: tuple[Reduction, ...] = ()
    functions: Mapping[str, MotionFunction] = field(default_factory=dict)

    @property
    def key(self) -> object:
        """Identity key; unique if there are functions of Python."""
        texts = [reduction.text for reduction in self.reductions]
        return self.columns, self.final, texts, self._token

    @cached_property
    def _token(self) -> str | None:
        """A random token if there are functions, of which two cannot be compared; else None."""
        return uuid4().hex if self.functions else None


@dataclass(frozen=True)
class Plan:
    """Options and model that all members share; plans of one key are one plan.

    Attributes
    ----------
    key
        Hash of all that results depend on.
    recipe
        The scene with the options that all members share.
    names
        Parameters and initial values that differ.
    member, model
        Values of one of the members, and its model.
    alone
        Members differ in numbers alone.
    samples
        Number of samples of each.
    options
        Simulation options of each member.
    extra
        Further columns.
    selection
        Columns and numbers to store of each member.
    """

    key: str
    recipe: Recipe = field(compare=False)
    names: tuple[str, ...] = field(compare=False)
    member: MemberValues = field(compare=False)
    model: Model = field(compare=False)
    alone: bool = field(compare=False)
    samples: int = field(compare=False)
    options: SimulationOptions = field(compare=False)
    extra: tuple[str, ...] = field(compare=False, default=())
    selection: Selection = field(compare=False, default=Selection())


@dataclass(frozen=True)
class Task:
    """A block of members that is still to be run.

    Attributes
    ----------
    plan
        Options and model that all members share.
    number
        Number of the block.
    rows
        For each member a text for each of the plan's names.
    numbers
        For each of these names the numbers of all members; None where a text is no plain number.
    """

    plan: Plan
    number: int
    rows: tuple[tuple[str, ...], ...]
    numbers: list[Array] | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Blocks:
    """The members of a plan in blocks, which do not depend on where they are run.

    Attributes
    ----------
    plan
        Options and model that all members share.
    members
        All of them.
    size
        Members of each block but the last.
    """

    plan: Plan
    members: Members
    size: int

    def __len__(self) -> int:
        return -(-len(self.members) // self.size)

    @property
    def note(self) -> dict[str, str | int]:
        """The values on which two runs agree if one goes on with the blocks of the other."""
        return {"key": self.plan.key, "members": len(self.members), "size": self.size}

    def first(self, number: int) -> int:
        """Return the number of the first member of a block."""
        return number * self.size

    def length(self, number: int) -> int:
        """Count the members of a block."""
        return min(self.size, len(self.members) - self.first(number))

    def task(self, number: int) -> Task:
        """Return a block, with the values of its members."""
        first, last = self.first(number), self.first(number) + self.length(number)
        rows = tuple(self.members.rows(first, last))
        return Task(self.plan, number, rows, self.members.numbers(first, last))


def blocks_of(plan: Plan, members: Members) -> Blocks:
    """Divide members into blocks."""
    many = plan.alone and bool(plan.model.code.taylor)
    largest = _LARGEST_BLOCK
    if many:
        largest = _LARGEST_BATCHED if plan.selection.columns != () else _LARGEST_OF_NUMBERS
    return Blocks(plan, members, max(1, min(largest, len(members) // _FEWEST_BLOCKS)))


class MemberModels(Protocol):
    """Models of a scene with the values of members, new or remembered."""

    @property
    def recipe(self) -> Recipe:
        """The scene with the options that all members share."""

    def model_of(self, member: MemberValues) -> Model:
        """Return the model of a member; refuse as :meth:`.recipe.Recipe.model`."""

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Answer :func:`.variants.differ_in_numbers` for a model from :meth:`model_of`."""


def plan_members(
    models: MemberModels,
    members: Members,
    options: SimulationOptions,
    *,
    extra: tuple[str, ...] = (),
    selection: Selection = Selection(),
) -> tuple[Plan, Array]:
    """Plan the runs of all members; return the times of the samples as well, shape (samples,).

    Parameters
    ----------
    models
        Source of the models.
    members
        Values of all members.
    options
        Simulation options of each member. The budget is that of all members together, and no part
        of the plan.
    extra
        Further columns.
    selection
        Columns and numbers to store of each member.

    Raises
    ------
    InputError
        Located: the scene, the members or the options are wrong.
    """
    recipe = models.recipe
    scene = recipe.scene()
    require_known_names(members, scene)
    _require_common_times(scene, MemberValues.for_scene(members.values(0), scene), members)
    values, model = _first_model(models, members, scene)
    options = replace(options, budget=None)
    _require_columns(selection, model, extra)
    times = np.asarray(resolve(model, options).times)
    plan = Plan(
        key=_key(recipe, model, options, extra, members, selection),
        recipe=recipe,
        names=members.names,
        member=values,
        model=model,
        alone=models.differ_in_numbers(values, model),
        samples=len(times),
        options=options,
        extra=extra,
        selection=selection,
    )
    return plan, times


def _require_columns(selection: Selection, model: Model, extra: tuple[str, ...]) -> None:
    """Refuse names of columns that a motion of the model does not have."""
    places = [form.format(name) for name in model.cartesian for form in ("{}", "dot({})")]
    known = [*model.state_names, *places, *model.outputs]
    if "energy" in extra:
        known.append("energy")
    if "forces" in extra:
        known += [*model.symbols, *model.forces]
    for name in selection.columns or ():
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
        values = MemberValues.for_scene(members.values(member), scene)
        try:
            return values, models.model_of(values)
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
    selection: Selection,
) -> str:
    """Hash all that results depend on."""
    text = recipe.text
    values = [sorted(texts.items()) for texts in (text.parameters, text.initial, text.times)]
    question = [values, recipe.formulation, extra, sorted(vars(options).items())]
    named = [members.identity(), selection.key]
    inputs = digest_of_files(model.recordings)
    return digest("ensemble", fingerprint(), text.data, inputs, *map(repr, (question, named)))
