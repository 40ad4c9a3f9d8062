"""``lagrange simulate --ensemble`` and ``--vary``: many motions of one scene."""

from __future__ import annotations

import json
from dataclasses import dataclass, fields, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.cli import options as shared
from lagrange_cli.cli.models import SceneRequest, SimulationRequest, model_of_scene
from lagrange_cli.cli.remembered import Answer, remembered
from lagrange_cli.cli.session import INTERRUPTED, Session
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from lagrange_cli.scene.model import Scene
    from lagrange_cli.simulate.ensemble.input_file import Members
    from lagrange_cli.simulate.ensemble.members import MemberValues
    from lagrange_cli.simulate.ensemble.run import Plan
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.options import SimulationOptions

#: Members that are tried until one can be derived.
_MOST_TRIED = 3

#: The options of a command that runs ensembles.
ensemble_options = shared.in_order(
    (
        shared.file(
            "--ensemble member_file",
            "Simulate a member for each row of a .csv file, whose header names parameters and "
            "initial values, or of a .yaml list of such mappings.  [default: none]",
            callback=None,
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
)


@dataclass(frozen=True)
class MemberChoice:
    """The options on the members of an ensemble.

    Attributes
    ----------
    member_file
        File with a row for each member; None if ``vary`` gives them.
    vary
        Ranges of values, ``NAME=RANGE``.
    jobs
        Number of members at a time; None for the number of cores.
    resume
        True to go on with the members that are still to be simulated.
    """

    member_file: str | None
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
) -> MemberChoice | None:
    """Gather the options of an ensemble; None for one motion.

    Raises
    ------
    InputError
        They contradict each other or other options.
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
    return MemberChoice(member_file, vary, jobs, resume is not None)


def _usage(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="ensemble"))


def _members(choice: MemberChoice, output: str | None) -> Members:
    from lagrange_cli.simulate.ensemble.input_file import grid, read_members

    if output is not None and not output.lower().endswith(".npz"):
        raise _usage("an ensemble is written as .npz", "-o ensemble.npz")
    if choice.resume and output is None:
        raise _usage("--resume needs the file that the result was to be", "-o ensemble.npz")
    return grid(choice.vary) if choice.member_file is None else read_members(choice.member_file)


def simulate_ensemble(session: Session, choice: MemberChoice, asked: SimulationRequest) -> int:
    """Run all members and report them; return the exit code.

    Raises
    ------
    InputError
        The scene, the members or the options are wrong.
    """
    from lagrange_cli.cli.reports.ensemble import FORMATS, SimulatedMembers
    from lagrange_cli.simulate.ensemble.members import require_known_names
    from lagrange_cli.simulate.ensemble.run import run_members, tasks_of
    from lagrange_cli.simulate.ensemble.store import open_store

    started = perf_counter()
    members = _members(choice, asked.output)
    scene = asked.scene.recipe().scene()
    require_known_names(members, scene)
    plan, times = _plan(session, asked, members, scene)
    tasks = tasks_of(plan, members.rows)
    sizes = [len(task.rows) for task in tasks]
    store = open_store(asked.output, plan.key, sizes, resume=choice.resume)
    begun = perf_counter()
    with session.progress("integrating") as move:
        jobs = choice.jobs or shared.cores()
        budget = asked.options.budget
        complete = run_members(tasks, store, jobs=jobs, budget=budget, progress=move)
    if complete and asked.output is not None:
        store.write(asked.output, times)
    seconds = {"derive": begun - started, "integrate": perf_counter() - begun}
    report = SimulatedMembers(plan, members, store, sizes, asked.output, seconds)
    print_report(report, FORMATS, as_json=asked.as_json)
    if complete:
        return 0 if set(report.counts()) == {"ok"} else 1
    if asked.output is not None:
        session.remark(f"stopped; --resume -o {asked.output} goes on with the other members")
    return INTERRUPTED if budget is None else 1


# What all members share.


def _require_common_times(scene: Scene, values: MemberValues, members: Members) -> None:
    """Refuse sample times that differ between members."""
    from lagrange_cli.scene.language.expression import names_in
    from lagrange_cli.simulate.ensemble.members import varied_parameters

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


def _plan(
    session: Session, asked: SimulationRequest, members: Members, scene: Scene
) -> tuple[Plan, Any]:
    """Plan the runs of all members; return the times of the samples as well."""
    from lagrange_cli.simulate.ensemble.members import MemberValues
    from lagrange_cli.simulate.ensemble.run import Plan
    from lagrange_cli.simulate.request import resolve

    _require_common_times(scene, MemberValues.of(members.values(0), scene), members)
    values, model = _first_model(session, asked.scene, members, scene)
    # The budget is that of all members together.
    options = replace(asked.options, budget=None)
    times = resolve(model, options).times
    plan = Plan(
        key=_key(asked, options, members),
        recipe=asked.scene.recipe(),
        names=members.names,
        member=values,
        model=model,
        alone=_differ_in_numbers(session, asked.scene, values, model),
        samples=len(times),
        options=options,
        extra=asked.columns,
        columns=asked.output is not None,
    )
    if not plan.alone:
        session.remark("each member is derived by itself: its values may change the equations")
    return plan, times


def _first_model(
    session: Session, asked: SceneRequest, members: Members, scene: Scene
) -> tuple[MemberValues, Model]:
    """Return the values and the model of a member that can be derived, of the few that are tried.

    Raises
    ------
    InputError
        None of them can; that of the first, located at its values.
    """
    from lagrange_cli.simulate.ensemble.members import MemberValues

    refusals = []
    for member in list(dict.fromkeys((0, len(members) - 1, len(members) // 2)))[:_MOST_TRIED]:
        values = MemberValues.of(members.values(member), scene)
        parameters = {**asked.parameters, **values.parameters}
        initial = {**asked.initial, **values.initial}
        try:
            request = replace(asked, parameters=parameters, initial=initial)
            return values, model_of_scene(session, request)
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


def _differ_in_numbers(
    session: Session, asked: SceneRequest, values: MemberValues, model: Model
) -> bool:
    """Say whether members differ in numbers alone; the answer is kept in the cache."""

    def work() -> Answer:
        from lagrange_cli.simulate.ensemble.members import differ_in_numbers

        return Answer(differ_in_numbers(asked.recipe(), values, model))

    member = [sorted(texts.items()) for texts in (values.parameters, values.initial)]
    question = [*asked.values, *member, asked.forces, asked.formulation]
    return bool(remembered(session, "ensemble", asked.source, question, work))


def _key(asked: SimulationRequest, options: SimulationOptions, members: Members) -> str:
    """Hash all that results depend on."""
    from lagrange_cli.cache import digest, fingerprint

    scene, choices = asked.scene, sorted(vars(options).items())
    question = [scene.values, scene.formulation, asked.columns, choices]
    table = [members.names, members.rows]
    return digest("ensemble", fingerprint(), scene.source.data, *map(json.dumps, (question, table)))
