"""``lagrange simulate --section``: the points at which motions meet a condition."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lagrange_cli.api.ensembles import MemberChoice
from lagrange_cli.api.simulations import SectionSearch, SimulationRequest
from lagrange_cli.cli import options as shared
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.interrupts import noted_interrupts
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.report.formats import spoken
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from lagrange_cli.api import Section
    from lagrange_cli.report.formats import ReportForm


def require_fit(
    asked: SimulationRequest,
    choice: MemberChoice | None,
    resume: str | None,
    checkpoint: str | None,
) -> None:
    """Refuse options that say nothing of a section.

    Raises
    ------
    click.UsageError
        One of them is given.
    """
    options = asked.options
    excluded_options = {
        "--samples": options.samples is not None,
        "--step": options.step is not None,
        "--sensitivity": bool(asked.scene.sensitivity),
        **{f"--with {name}": name in asked.columns for name in ("forces", "momenta", "conserved")},
        "--checkpoint": checkpoint is not None,
        "--resume": resume is not None,
        "--final": choice is not None and choice.final,
        "--columns": choice is not None and choice.columns is not None,
        "--reduce": choice is not None and bool(choice.reductions),
        "--map": choice is not None and choice.map_names is not None,
        "--on": choice is not None and choice.scheduler is not None,
    }
    for name, is_given in excluded_options.items():
        if is_given:
            raise click.UsageError(f"{name} does not go with --section")


def find_section(
    session: Session,
    text: str,
    choice: MemberChoice | None,
    asked: SimulationRequest,
    form: ReportForm,
) -> int:
    """Find a section and report it; return the exit code.

    Raises
    ------
    InputError
        The scene, the condition, the members or the options are wrong.
    """
    from lagrange_cli.report.contents.section import FoundSection

    search, code = asked.section(text), 0
    if choice is None:
        section, code = _of_one(session, search)
    else:
        members = choice.members()
        with session.progress("integrating") as progress:
            section = search.of_members(
                members, choice.jobs or session.defaults.jobs or shared.cores(), progress
            )
    session.explain_code()
    if asked.output is not None:
        section.write(asked.output, asked.columns)
    print_report(FoundSection(section, asked.columns), form)
    if asked.plot is not None:
        section.plot(asked.plot, asked.plot_of)
    for number, points in enumerate(section.members):
        if points.reason:
            member = f"member {number}: " if len(section.members) > 1 else ""
            session.remark(member + spoken(points.reason, form.language))
    return code or section.exit_code


def _of_one(session: Session, search: SectionSearch) -> tuple[Section, int]:
    """Find the section of the scene's motion; return also the exit code of an interrupt, or 0."""
    with session.progress("integrating") as progress, noted_interrupts() as interrupt:

        def stop() -> bool:
            return interrupt.asked

        with heard_by(Listener(ends=stop)):
            section = search.of_motion(progress, stop)
    ended = section.members[0].status == "stopped" and interrupt.asked
    return section, interrupt.exit_code if ended else 0
