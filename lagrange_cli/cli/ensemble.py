"""``lagrange simulate --ensemble`` and ``--vary``: many motions of one scene."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import perf_counter
from typing import TYPE_CHECKING

import click

from lagrange_cli.cli import options as shared
from lagrange_cli.cli.models import SceneRequest, SimulationRequest, model_of_scene
from lagrange_cli.cli.remembered import Answer, remembered
from lagrange_cli.cli.session import INTERRUPTED, Session
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from lagrange_cli.simulate.ensemble.input_file import Members
    from lagrange_cli.simulate.ensemble.members import MemberValues, Recipe
    from lagrange_cli.simulate.model.model import Model

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
    from lagrange_cli.simulate.ensemble.planning import plan_members
    from lagrange_cli.simulate.ensemble.run import run_members, tasks_of
    from lagrange_cli.simulate.ensemble.store import open_store

    started = perf_counter()
    members = _members(choice, asked.output)
    models, columns = _RememberedModels(session, asked.scene), asked.output is not None
    plan, times = plan_members(models, members, asked.options, extra=asked.columns, columns=columns)
    if not plan.alone:
        session.remark("each member is derived by itself: its values may change the equations")
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


@dataclass(frozen=True)
class _RememberedModels:
    """Models of members, kept in the cache."""

    session: Session
    asked: SceneRequest

    @property
    def recipe(self) -> Recipe:
        return self.asked.recipe()

    def of(self, member: MemberValues) -> Model:
        parameters = {**self.asked.parameters, **member.parameters}
        initial = {**self.asked.initial, **member.initial}
        request = replace(self.asked, parameters=parameters, initial=initial)
        return model_of_scene(self.session, request)

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        asked = self.asked

        def work() -> Answer:
            from lagrange_cli.simulate.ensemble.members import differ_in_numbers

            return Answer(differ_in_numbers(asked.recipe(), member, model))

        values = [sorted(texts.items()) for texts in (member.parameters, member.initial)]
        question = [*asked.values, *values, asked.forces, asked.formulation]
        return bool(remembered(self.session, "ensemble", asked.source, question, work))
