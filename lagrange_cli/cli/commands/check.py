"""``lagrange check``: scenes and folders of scenes against what they expect."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import click

from lagrange_cli.cli import engines, options
from lagrange_cli.cli.guard import guard_scenes
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command
from lagrange_cli.cli.terminal.output import deliver
from lagrange_cli.files import write_file
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from lagrange_cli.api import Report, SceneReport
    from lagrange_cli.report.formats import ReportForm


def _checked(
    session: Session,
    paths: tuple[str, ...],
    parameters: dict[str, str],
    outputs: dict[str, str | None],
    jobs: int | None,
    scheduler: str | None,
) -> Report:
    """Check the scenes, with a progress bar if stderr is a terminal."""
    from lagrange_cli.api import check_paths, scenes_in

    done = itertools.count(1)

    def tell(scene: SceneReport) -> None:
        session.detail(f"{scene.path}: {scene.outcome} after {scene.seconds:.2f} s")
        move(next(done) / len(scenes))

    scenes = scenes_in(paths)
    guard_scenes(scenes, parameters, outputs)
    with (
        engines.cluster(session, scheduler, jobs) as cluster,
        session.progress("checking") as move,
        heard_by(Listener(hears=move.says)),
    ):
        return check_paths(
            scenes,
            parameters=parameters,
            strict=session.strict,
            jobs=jobs or 1,
            cluster=cluster,
            cache=session.cache,
            progress=tell,
        )


@click.command(cls=Command)
@click.argument(
    "paths", nargs=-1, required=True, type=click.Path(allow_dash=True), metavar="PATH..."
)
@options.reporting("github", replaces=True)
@options.file("--junit", "Write a JUnit XML report to this file as well.")
@click.option(
    "-j",
    "--jobs",
    type=click.IntRange(1),
    help="Check this many scenes at the same time.  [default: 1]",
)
@engines.on("Check scenes")
@options.parameters
@options.file(
    "-o --output", "Write the report to this file.  [default: standard output]", metavar="PATH"
)
@options.common
@click.pass_context
def check(
    ctx: click.Context,
    paths: tuple[str, ...],
    form: ReportForm,
    junit: str | None,
    jobs: int | None,
    scheduler: str | None,
    parameters: dict[str, str],
    output: str | None,
) -> None:
    """Validate, derive and certify scenes, and compare them with their section expect.

    PATH is a scene, a folder (searched for *.yaml and *.yml), or - for standard input.
    """
    session = ctx.ensure_object(Session)
    outputs = {"-o": output, "--junit": junit}
    report = _checked(session, paths, parameters, outputs, jobs, scheduler)
    from lagrange_cli.report.contents.check import github_annotations, junit_xml

    is_github = form.format == "github"
    written = github_annotations(report) if is_github else form.written(report)
    deliver(written, form.format, output)
    if junit is not None:
        write_file(junit, junit_xml(report))
    if session.traceback:
        for scene in report.scenes:
            click.echo(scene.trace, err=True, nl=False)
    ctx.exit(report.exit_code)
