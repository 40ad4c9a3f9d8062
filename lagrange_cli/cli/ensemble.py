"""``lagrange simulate --ensemble`` and ``--vary``: many motions of one scene."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lagrange_cli.cli import options as shared
from lagrange_cli.cli.models import model_of_scene
from lagrange_cli.cli.remembered import Answer, SceneSource, remembered
from lagrange_cli.cli.reports.ensemble import FORMATS, SimulatedMembers
from lagrange_cli.cli.session import INTERRUPTED, Session
from lagrange_cli.cli.terminal.output import print_text
from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.simulate.ensemble.input_file import Members
    from lagrange_cli.simulate.ensemble.members import MemberValues, Recipe
    from lagrange_cli.simulate.ensemble.run import Plan
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.request import SimulationOptions

#: Members that are tried for one that can be derived.
_MOST_TRIED = 3

_Command = TypeVar("_Command", bound=Callable[..., Any])

_OPTIONS = (
    click.option(
        "--ensemble",
        "member_file",
        type=click.Path(),
        metavar="FILE",
        help="Simulate a member for each row of a .csv file, whose header names parameters and "
        "initial values, or of a .yaml list of such mappings.  [default: none]",
    ),
    click.option(
        "--vary",
        multiple=True,
        metavar="NAME=RANGE",
        help="Simulate a member for each value of linspace(a,b,n), logspace(a,b,n), "
        "geomspace(a,b,n) or [x,y,...]; repeated, for each combination.  [default: none]",
    ),
    shared.jobs("Members that are simulated"),
    click.option(
        "--resume",
        is_flag=False,
        flag_value="",
        metavar="[FILE]",
        help="Go on with what was interrupted: a run from the FILE of its --checkpoint; an "
        "ensemble, which takes no FILE, from what stands beside -o.  [default: off]",
    ),
)


def ensemble_options(function: _Command) -> _Command:
    """What a command that runs ensembles takes."""
    return functools.reduce(lambda done, option: option(done), reversed(_OPTIONS), function)


@dataclass(frozen=True)
class _MemberChoice:
    """The options that say which members there are, and how they are run."""

    ensemble: str | None
    vary: tuple[str, ...]
    jobs: int | None
    resume: bool


def member_choice(
    member_file: str | None,
    vary: tuple[str, ...],
    jobs: int | None,
    resume: str | None,
    checkpoint: str | None,
    plot: str | None,
) -> _MemberChoice | None:
    """Gather the options of an ensemble; None where there is one motion.

    Raises
    ------
    InputError
        They contradict each other or what else is asked for.
    """
    if member_file is None and not vary:
        if jobs is not None:
            raise _usage("--jobs is for ensembles", "--ensemble FILE or --vary NAME=RANGE")
        return None
    if resume:
        raise _usage(
            f"an ensemble goes on from what stands beside -o, not from '{resume}'",
            "--resume at the end of the options, or --resume=",
        )
    if checkpoint is not None:
        raise _usage(
            "an ensemble keeps each member as it ends, without --checkpoint",
            "--resume -o ensemble.npz goes on with the others",
        )
    if member_file is not None and vary:
        raise _usage("--ensemble and --vary both say what the members are", "give one of them")
    if plot is not None:
        raise _usage("an ensemble is not drawn", "-o ensemble.npz has the samples of all members")
    return _MemberChoice(member_file, vary, jobs, resume is not None)


@dataclass(frozen=True)
class EnsembleRequest:
    """What the options ask for; ``parameters``, ``initial`` and ``times`` as the scene's reader
    takes them, ``options`` of all members, with the budget of all together."""

    choice: _MemberChoice
    source: SceneSource
    parameters: Mapping[str, str]
    initial: Mapping[str, str]
    times: Mapping[str, str]
    formulation: Formulation | None
    columns: tuple[str, ...]
    output: str | None
    as_json: bool
    options: SimulationOptions

    @property
    def member_options(self) -> SimulationOptions:
        """Options of each member, none of which has a budget of its own."""
        return replace(self.options, budget=None)

    @property
    def recipe(self) -> Recipe:
        from lagrange_cli.simulate.ensemble.members import Recipe

        return Recipe(
            self.source.file,
            self.source.data,
            self.parameters,
            self.initial,
            self.times,
            "forces" in self.columns,
            self.formulation,
        )


def _usage(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="ensemble"))


def _members(asked: EnsembleRequest) -> Members:
    from lagrange_cli.simulate.ensemble.input_file import grid, read_members

    if asked.output is not None and not asked.output.lower().endswith(".npz"):
        raise _usage("an ensemble is written as .npz", "-o ensemble.npz")
    wanted = asked.choice
    if wanted.resume and asked.output is None:
        raise _usage("--resume needs the file that the result was to be", "-o ensemble.npz")
    return grid(wanted.vary) if wanted.ensemble is None else read_members(wanted.ensemble)


def simulate_ensemble(session: Session, asked: EnsembleRequest) -> int:
    """Run all members and report them; returns the exit code.

    Raises
    ------
    InputError
        The scene, the members or the options are wrong.
    """
    from lagrange_cli.simulate.ensemble.members import require_known_names
    from lagrange_cli.simulate.ensemble.run import run_members, tasks_of
    from lagrange_cli.simulate.ensemble.store import open_store

    started = perf_counter()
    members = _members(asked)
    scene = asked.recipe.scene()
    require_known_names(members, scene)
    plan, times = _plan(session, asked, members, scene)
    tasks = tasks_of(plan, members.rows)
    sizes = [len(task.rows) for task in tasks]
    store = open_store(asked.output, plan.key, sizes, resume=asked.choice.resume)
    begun = perf_counter()
    with session.progress("integrating") as move:
        jobs = asked.choice.jobs or shared.cores()
        budget = asked.options.budget
        complete = run_members(tasks, store, jobs=jobs, budget=budget, progress=move)
    if complete and asked.output is not None:
        store.write(asked.output, times)
    seconds = {"derive": begun - started, "integrate": perf_counter() - begun}
    report = SimulatedMembers(plan, members, store, sizes, asked.output, seconds)
    format_ = "json" if asked.as_json else "text"
    print_text(FORMATS[format_](report), format_)
    if not complete and asked.output is not None:
        session.remark(f"stopped; --resume -o {asked.output} goes on with the other members")
    if not complete:
        return INTERRUPTED if budget is None else 1
    return 0 if set(report.counts()) == {"ok"} else 1


# What all members share.


def _require_common_times(scene: Scene, own: MemberValues, members: Members) -> None:
    """Refuse sample times that differ between members."""
    from lagrange_cli.scene.language.expression import names_in
    from lagrange_cli.simulate.ensemble.members import varied_parameters

    different = varied_parameters(scene, own)
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


def _plan(
    session: Session, asked: EnsembleRequest, members: Members, scene: Scene
) -> tuple[Plan, Any]:
    """The plan, and the times of the samples."""
    from lagrange_cli.simulate.ensemble.members import MemberValues
    from lagrange_cli.simulate.ensemble.run import Plan
    from lagrange_cli.simulate.request import resolve

    _require_common_times(scene, MemberValues.of(members.values(0), scene), members)
    own, model = _first_model(session, asked, members, scene)
    times = resolve(model, asked.member_options).times
    plan = Plan(
        key=_key(asked, members),
        recipe=asked.recipe,
        names=members.names,
        member=own,
        model=model,
        alone=_alone(session, asked, own, model),
        samples=len(times),
        options=asked.member_options,
        extra=asked.columns,
        columns=asked.output is not None,
    )
    if not plan.alone:
        session.remark("each member is derived by itself: its values may change the equations")
    return plan, times


def _first_model(
    session: Session, asked: EnsembleRequest, members: Members, scene: Scene
) -> tuple[MemberValues, Model]:
    """The first of a few members that can be derived, and its model.

    Raises
    ------
    InputError
        None of them can; that of the first, located where its values are.
    """
    from lagrange_cli.simulate.ensemble.members import MemberValues

    refusals = []
    for member in list(dict.fromkeys((0, len(members) - 1, len(members) // 2)))[:_MOST_TRIED]:
        own = MemberValues.of(members.values(member), scene)
        try:
            return own, model_of_scene(
                session,
                asked.source,
                parameters={**asked.parameters, **own.parameters},
                initial={**asked.initial, **own.initial},
                times=asked.times,
                forces="forces" in asked.columns,
                formulation=asked.formulation,
            )
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


def _alone(session: Session, asked: EnsembleRequest, own: MemberValues, model: Model) -> bool:
    """Say whether members differ in numbers alone; what was found before is remembered."""

    def work() -> Answer:
        from lagrange_cli.simulate.ensemble.members import differ_in_numbers

        return Answer(differ_in_numbers(asked.recipe, own, model))

    shared = [sorted(given.items()) for given in (asked.parameters, asked.initial, asked.times)]
    members = [sorted(given.items()) for given in (own.parameters, own.initial)]
    question = [*shared, *members, "forces" in asked.columns, asked.formulation]
    return bool(remembered(session, "ensemble", asked.source, question, work))


def _key(asked: EnsembleRequest, members: Members) -> str:
    """The hash of all that results depend on."""
    from lagrange_cli.cache import digest, fingerprint

    shared = [sorted(given.items()) for given in (asked.parameters, asked.initial, asked.times)]
    question = [
        shared,
        asked.formulation,
        asked.columns,
        sorted(vars(asked.member_options).items()),
    ]
    table = [members.names, members.rows]
    return digest("ensemble", fingerprint(), asked.source.data, *map(json.dumps, (question, table)))
