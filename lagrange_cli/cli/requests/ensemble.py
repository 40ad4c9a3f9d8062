"""``lagrange simulate --ensemble`` and ``--vary``: many motions of one scene."""

from __future__ import annotations

import re
from time import perf_counter

import click

from lagrange_cli.api.ensembles import MOST_WITH_SAMPLES, MemberChoice, written_reductions
from lagrange_cli.api.simulations import SimulationRequest
from lagrange_cli.cli import engines
from lagrange_cli.cli import options as shared
from lagrange_cli.cli.session import INTERRUPTED, Session
from lagrange_cli.cli.terminal.command import heading
from lagrange_cli.cli.terminal.interrupts import Terminated
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.report.formats import ReportForm

#: Arguments of the command that are passed on to :func:`member_choice` as they are.
MEMBER_OPTIONS = (
    *("vary", "sample", "number", "seed"),
    *("final", "kept_columns", "reductions", "map_names", "jobs", "scheduler"),
)

_COUNT = re.compile(r"[0-9]{1,12}(\.[0-9]{1,12})?([eE]\+?[0-9]{1,2})?", re.ASCII)


def _count(ctx: click.Context, option: click.Parameter, value: str | None) -> int | None:
    """Read a number of members, as 1000 or 1e6."""
    if value is None:
        return None
    if not _COUNT.fullmatch(value) or float(value) != int(float(value)) or float(value) < 1:
        raise click.BadParameter(f"'{value}' is no whole number, as 1000 or 1e6", ctx, option)
    return int(float(value))


def _columns(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """Split names with commas between them."""
    if value is None:
        return None
    names = tuple(dict.fromkeys(part.strip() for part in value.split(",")))
    if not all(names):
        raise click.BadParameter("a name is missing: theta,energy is two of them", ctx, option)
    return names


#: The options of a command that runs ensembles.
ensemble_options = shared.in_order(
    (
        heading("Many runs"),
        shared.file(
            "--ensemble member_file",
            "Simulate a member for each row of a .csv file or entry of a .yaml list.",
            callback=None,
        ),
        click.option(
            "--vary",
            multiple=True,
            metavar="NAME=RANGE",
            help="Simulate a member for each value of [x,y,...] or linspace, logspace, "
            "geomspace(a,b,n); repeatable.",
        ),
        click.option(
            "--sample",
            multiple=True,
            metavar="'NAME ~ DIST'",
            help="Draw values from uniform(a,b), loguniform(a,b) or normal(mean,deviation); "
            "repeatable.",
        ),
        click.option(
            "--members",
            "number",
            metavar="N",
            callback=_count,
            help="Number of draws of --sample, as 1000 or 1e6.",
        ),
        click.option(
            "--seed",
            type=click.IntRange(0, 2**64 - 1),
            metavar="N",
            help="Seed of the draws.  [default: 0]",
        ),
        click.option(
            "--final",
            is_flag=True,
            help=f"Keep the ends alone.  [default: beyond {MOST_WITH_SAMPLES:,} members]",
        ),
        click.option(
            "--columns",
            "kept_columns",
            callback=_columns,
            metavar="NAMES",
            help="Keep only these columns of each.  [default: all]",
        ),
        click.option(
            "--reduce",
            "reductions",
            multiple=True,
            metavar="CALL",
            help="Keep a number of each motion, as 'max(abs(theta2))' or the time "
            "'first(abs(theta2) > pi)'; repeatable.",
        ),
        click.option(
            "--map",
            "map_names",
            callback=_columns,
            metavar="NAME,NAME",
            help="With --plot: draw a number of --reduce over two names that vary.",
        ),
        shared.jobs("Members simulated"),
        engines.on("Simulate members"),
    )
)


def member_choice(
    *,
    member_file: str | None,
    vary: tuple[str, ...],
    sample: tuple[str, ...],
    number: int | None,
    seed: int | None,
    final: bool,
    kept_columns: tuple[str, ...] | None,
    reductions: tuple[str, ...],
    map_names: tuple[str, ...] | None,
    jobs: int | None,
    scheduler: str | None,
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
    sources = {"--ensemble": member_file, "--vary": vary, "--sample": sample}
    named_sources = [option for option, value in sources.items() if value]
    if not named_sources:
        of_ensembles = {
            "--jobs": jobs,
            "--members": number,
            "--seed": seed,
            "--final": final or None,
            "--columns": kept_columns,
            "--reduce": reductions or None,
            "--map": map_names,
            "--on": scheduler,
        }
        for option, value in of_ensembles.items():
            if value is not None:
                raise _usage(f"{option} is for ensembles", _SOURCES)
        return None
    if len(named_sources) > 1:
        message = f"{' and '.join(named_sources)} each say what the members are"
        raise _usage(message, "give one of them")
    if sample and number is None:
        raise _usage("how many members are drawn?", "--members 1000")
    if not sample and (number is not None or seed is not None):
        raise _usage("--members and --seed are of members that are drawn", _SOURCES)
    if final and kept_columns is not None:
        raise _usage("--final keeps no samples, --columns does", "give one of them")
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
    if map_names is not None and plot is None:
        hint = "--map theta1,theta2 --plot map.png"
        raise _usage("a map is drawn into the file of --plot", hint)
    drawn = sample, number, seed
    run = jobs, scheduler, resume is not None
    read = written_reductions(reductions)
    return MemberChoice(member_file, vary, *drawn, final, kept_columns, read, map_names, *run)


_SOURCES = "--ensemble FILE, --vary NAME=RANGE or --sample 'NAME ~ uniform(0,1)' --members N"


def _usage(message: str, hint: str = "") -> InputError:
    return InputError(Problem(message, hint=hint, rule="ensemble"))


def simulate_ensemble(
    session: Session, choice: MemberChoice, asked: SimulationRequest, form: ReportForm
) -> int:
    """Run all members and report them; return the exit code.

    Raises
    ------
    InputError
        The scene, the members or the options are wrong, or the cluster.
    """
    from lagrange_cli.api.ensembles import planned
    from lagrange_cli.report.values.simulation import SimulatedMembers

    with engines.cluster(session, choice.scheduler, choice.jobs) as cluster:
        started = perf_counter()
        ensemble = planned(asked, choice)
        store = ensemble.open_store()
        begun = perf_counter()
        jobs = choice.jobs or session.defaults.jobs or shared.cores()
        try:
            with session.progress("integrating") as move:
                complete = ensemble.run(store, jobs=jobs, cluster=cluster, progress=move)
        except Terminated:
            _say_how_to_go_on(session, asked.output)
            raise
        if complete:
            store.complete(ensemble.times)
        seconds = {"derive": begun - started, "integrate": perf_counter() - begun}
        report = SimulatedMembers(ensemble.plan, ensemble.members, store, asked.output, seconds)
        print_report(report, form)
        if complete:
            ensemble.draw(store)
            return 0 if set(report.counts()) == {"ok"} else 1
        _say_how_to_go_on(session, asked.output)
        return INTERRUPTED if asked.options.budget is None else 1


def _say_how_to_go_on(session: Session, output: str | None) -> None:
    if output is not None:
        session.remark(f"stopped; --resume -o {output} goes on with the other members")
