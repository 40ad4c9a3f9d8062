"""``lagrange check``: scenes and folders of scenes against what they expect."""

from __future__ import annotations

import itertools
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NoReturn

import click
from click.core import ParameterSource

from lagrange_cli.cli import engines, options
from lagrange_cli.cli.guard import guard_scenes
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import deliver, difference, print_text
from lagrange_cli.errors import InputError
from lagrange_cli.files import stamp_of, write_file
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from lagrange_cli.api import (
        CheckedMotions,
        CheckOptions,
        Limits,
        Report,
        SceneReport,
        Selection,
    )
    from lagrange_cli.report.formats import ReportForm

#: Seconds between two looks at the files that are watched.
_LOOKED_AFTER = 0.5

#: Bytes of a megabyte, in which memory is limited.
_MEGABYTE = 10**6


@dataclass(frozen=True)
class _Run:
    """A way to check scenes.

    Attributes
    ----------
    session
        The session of the command.
    asked
        Options that outcomes depend on.
    limits
        The most that one scene may take.
    jobs, scheduler
        Scenes at a time on this machine, or a cluster; None for the default.
    stops
        No check begins after a scene that does not pass.
    """

    session: Session
    asked: CheckOptions
    limits: Limits
    jobs: int | None
    scheduler: str | None
    stops: bool

    def __call__(self, scenes: Sequence[str]) -> Report:
        """Check scenes, with a progress bar if stderr is a terminal."""
        from lagrange_cli.api import check_paths, note_outcomes

        session, done = self.session, itertools.count(1)

        def tell(scene: SceneReport) -> None:
            session.detail(f"{scene.path}: {scene.outcome} after {scene.seconds:.2f} s")
            move(next(done) / len(scenes))

        with (
            engines.cluster(session, self.scheduler, self.jobs) as cluster,
            session.progress("checking") as move,
            heard_by(Listener(hears=move.says)),
        ):
            report = check_paths(
                scenes,
                self.asked,
                jobs=self.jobs or session.defaults.jobs or 1,
                limits=self.limits,
                stops=self.stops,
                cluster=cluster,
                cache=session.cache,
                progress=tell,
            )
        note_outcomes(report, session.cache)
        return report


@dataclass(frozen=True)
class _Reporting:
    """A way to report outcomes.

    Attributes
    ----------
    form
        Format and language.
    output
        File of the report; None for standard output.
    junit
        File of a JUnit report; None for none.
    slowest
        Number of the slowest scenes that are listed.
    """

    form: ReportForm
    output: str | None
    junit: str | None
    slowest: int

    def __call__(self, session: Session, report: Report) -> None:
        """Report the outcomes."""
        from lagrange_cli.report.contents.annotations import CHECK_FORMATS, junit_xml

        shown = replace(report, slowest=self.slowest, brief=report.brief or session.verbosity < 0)
        write = CHECK_FORMATS.get(self.form.format)
        written = write(shown) if write else self.form.written(shown)
        deliver(written, self.form.format, self.output)
        if self.junit is not None:
            write_file(self.junit, junit_xml(report))
        if session.traceback:
            for scene in report.scenes:
                click.echo(scene.trace, err=True, nl=False)

    def show_difference(self, text: str) -> None:
        """Print a difference: before a text, else on stderr, where it is no part of the report."""
        if self.form.format == "text":
            print_text(text)
        else:
            click.echo(text, err=True, nl=False)


@click.command(cls=Command)
@click.argument(
    "paths", nargs=-1, required=True, type=click.Path(allow_dash=True), metavar="PATH..."
)
@heading("Scenes")
@click.option("-k", "--keyword", default="", metavar="TEXT", help="Those whose path holds TEXT.")
@options.excluded
@click.option(
    "--changed-since",
    metavar="REV",
    help="Those that differ from a revision of git, or read files that do.",
)
@click.option("--only-failed", is_flag=True, help="Those that did not pass in the last run.")
@heading("Exercises")
@click.option(
    "--answers",
    multiple=True,
    type=click.Path(allow_dash=True),
    metavar="FILE",
    help="Judge answers to the exercise that the scene is, of dof, cyclic, lagrangian, equations"
    " and conserved; repeatable.",
)
@heading("Run")
@click.option(
    "--simulate", is_flag=True, help="Integrate the first tenth of each scene with until, too."
)
@click.option("--full", is_flag=True, help="Integrate to the end of each; implies --simulate.")
@options.parameters
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1),
    help="Check this many scenes at the same time.  [default: 1]",
)
@engines.on("Check scenes")
@click.option("-x", "--exitfirst", is_flag=True, help="Stop after a scene that does not pass.")
@click.option(
    "--timeout",
    type=click.FloatRange(0, min_open=True),
    metavar="SECONDS",
    help="Give a scene up after this time.",
)
@click.option(
    "--memory",
    type=click.IntRange(200),
    metavar="MB",
    help="Give a scene up that takes more memory.",
)
@click.option("--watch", is_flag=True, help="Go on, and check again what is changed.")
@heading("Expectations")
@click.option(
    "--update", is_flag=True, help="Write values that were found over expected ones that fail."
)
@click.option("--diff", is_flag=True, help="Print what --update would change, and write nothing.")
@heading("Output")
@options.reporting("github", "gitlab", "sarif", replaces=True)
@options.file("--junit", "Write a JUnit XML report to this file as well.")
@options.file(
    "-o --output", "Write the report to this file.  [default: standard output]", metavar="PATH"
)
@click.option(
    "--durations",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    metavar="N",
    help="List the N slowest scenes.",
)
@options.messages("Failures and the summary alone, no warnings and remarks.")
@click.pass_context
def check(
    ctx: click.Context,
    paths: tuple[str, ...],
    keyword: str,
    exclude: tuple[str, ...],
    changed_since: str | None,
    only_failed: bool,
    answers: tuple[str, ...],
    simulate: bool,
    full: bool,
    parameters: dict[str, str],
    jobs: int | None,
    scheduler: str | None,
    exitfirst: bool,
    timeout: float | None,
    memory: int | None,
    watch: bool,
    update: bool,
    diff: bool,
    form: ReportForm,
    junit: str | None,
    output: str | None,
    durations: int,
) -> None:
    """Validate, derive and certify scenes, and compare them with their section expect.

    PATH is a scene, a folder (searched for *.yaml and *.yml), or - for standard input.
    """
    from lagrange_cli.api import CheckOptions, Limits, Selection, scenes_in

    if watch and "-" in paths:
        raise click.UsageError("--watch: standard input is read once")
    if update or diff:
        _require_updatable(paths, parameters, watch)
    session = ctx.ensure_object(Session)
    reporting = _Reporting(form, output, junit, durations)
    if answers:
        _judge(ctx, paths, answers, parameters, reporting)
    exclude = exclude or session.defaults.exclude or ()
    selection = Selection(keyword, exclude, changed_since, only_failed)
    scenes = selection.selected(scenes_in(paths), session.cache)
    guard_scenes(scenes, parameters, {"-o": output, "--junit": junit})
    motions: CheckedMotions = "full" if full else "short" if simulate else "expected"
    run = _Run(
        session,
        CheckOptions(parameters, session.strict, motions),
        Limits(timeout, None if memory is None else memory * _MEGABYTE),
        jobs,
        scheduler,
        exitfirst,
    )
    report = run(scenes)
    if update or diff:
        report = _updated(report, run, reporting, writes=not diff)
    reporting(session, report)
    if watch:
        _watch(report, paths, Selection(keyword, exclude), run, reporting)
    ctx.exit(report.exit_code)


#: Options that are not for answers.
_OF_SCENES = (
    *("keyword", "exclude", "changed_since", "only_failed", "simulate", "full", "jobs"),
    *("scheduler", "exitfirst", "timeout", "memory", "watch", "update", "diff"),
)


def _judge(
    ctx: click.Context,
    paths: tuple[str, ...],
    answers: tuple[str, ...],
    parameters: dict[str, str],
    reporting: _Reporting,
) -> NoReturn:
    """Judge answers to an exercise; the exit code is 2 where a file holds none."""
    from lagrange_cli.api import judged_answers

    session = ctx.ensure_object(Session)
    for option in ctx.command.params:
        source = ctx.get_parameter_source(option.name or "")
        if option.name in _OF_SCENES and source is ParameterSource.COMMANDLINE:
            raise click.UsageError(f"{option.opts[-1]} is for checks of scenes, not for --answers")
    if len(paths) > 1 or os.path.isdir(paths[0]):
        raise click.UsageError("--answers judges answers to one scene")
    outputs = {"-o": reporting.output, "--junit": reporting.junit}
    guard_scenes([*paths, *answers], parameters, outputs)
    report = judged_answers(paths[0], answers, parameters, session.cache)
    reporting(session, report)
    is_invalid = any(one.outcome == "invalid" for one in report.scenes)
    ctx.exit(2 if is_invalid else report.exit_code)


def _require_updatable(paths: Sequence[str], parameters: dict[str, str], watch: bool) -> None:
    """Refuse an update of what is no file, or with values that are not those of the file."""
    if "-" in paths:
        raise click.UsageError("--update: standard input cannot be written")
    if parameters:
        raise click.UsageError("--update: expectations are of the scene's own parameters, not -p")
    if watch:
        raise click.UsageError("--update and --watch exclude each other")


def _updated(report: Report, run: _Run, reporting: _Reporting, *, writes: bool) -> Report:
    """Show the values found for expectations that fail, and write them.

    Returns the outcomes, of scenes that were written anew.
    """
    from lagrange_cli.api import update_of

    scenes = []
    for scene in report.scenes:
        if scene.outcome == "pass":
            scenes.append(scene)
            continue
        try:
            update = update_of(scene, run.asked, cache=run.session.cache)
        except InputError as error:
            reason = error.problems[0].message
            run.session.remark(f"{scene.path}: left as it is: {reason}")
            scenes.append(scene)
            continue
        reporting.show_difference(difference(update.path, update.before, update.after))
        if writes:
            write_file(update.path, update.after)
            run.session.remark(f"{update.path}: written")
        scenes.append(update.report if writes else scene)
    updated = replace(report, scenes=tuple(scenes))
    if writes:
        from lagrange_cli.api import note_outcomes

        note_outcomes(updated, run.session.cache)
    return updated


def _watch(
    report: Report, paths: Sequence[str], selection: Selection, run: _Run, reporting: _Reporting
) -> NoReturn:
    """Check scenes again whenever they, or files that they read, change; until Ctrl-C."""
    from lagrange_cli.api import Report, scenes_in

    outcomes = {scene.path: scene for scene in report.scenes}
    known = {path: _stamps(path) for path in selection.selected(scenes_in(paths), None)}
    run.session.remark("watching; Ctrl-C ends")
    while True:
        time.sleep(_LOOKED_AFTER)
        try:
            scenes = selection.selected(scenes_in(paths), None)
        except InputError:
            continue  # An editor may replace a file by another one.
        changed = [path for path in scenes if known.get(path) != _stamps(path)]
        if changed or known.keys() != set(scenes):
            known = {path: _stamps(path) for path in scenes}
            outcomes |= {scene.path: scene for scene in run(changed).scenes}
            together = Report(tuple(outcomes[path] for path in scenes if path in outcomes))
            reporting(run.session, replace(together, brief=True))


def _stamps(scene: str) -> list[tuple[int, ...]]:
    """Return numbers that usually change when a scene, or a file that it reads, does."""
    from lagrange_cli.api import files_of

    return [stamp_of(path) for path in files_of(scene)]
