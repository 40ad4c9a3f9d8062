"""``lagrange simulate --section``: the points at which motions meet a condition."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from lagrange_cli.cli import options as shared
from lagrange_cli.cli.commands.ensemble import MemberChoice, chosen_members
from lagrange_cli.cli.models import (
    RememberedMembers,
    SceneRequest,
    SimulationRequest,
    section_model_of_scene,
)
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.interrupts import noted_interrupts
from lagrange_cli.cli.terminal.output import print_report
from lagrange_cli.stages import Listener, heard_by

if TYPE_CHECKING:
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition
    from lagrange_cli.studies.section.members import SectionModel
    from lagrange_cli.studies.section.result import Section


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
    session: Session, text: str, choice: MemberChoice | None, asked: SimulationRequest
) -> int:
    """Find a section and report it; return the exit code.

    Raises
    ------
    InputError
        The scene, the condition, the members or the options are wrong.
    """
    from lagrange_cli.report.section import FORMATS, FoundSection
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition

    condition = WrittenCondition(text, "--section")
    known = section_model_of_scene(session, asked.scene, condition)
    _require_curves(known, asked)
    if choice is None:
        section, code = _of_one(session, known, asked)
    else:
        section, code = _of_members(session, condition, known, choice, asked)
    session.explain_code()
    if asked.output is not None:
        section.write(asked.output, asked.columns)
    print_report(FoundSection(section, asked.columns), FORMATS, as_json=asked.as_json)
    if asked.plot is not None:
        section.plot(asked.plot, asked.plot_of)
    for number, points in enumerate(section.members):
        if points.reason and len(section.members) == 1:
            session.remark(points.reason)
        elif points.reason:
            session.remark(f"member {number}: {points.reason}")
    return code or section.exit_code


def _require_curves(known: SectionModel, asked: SimulationRequest) -> None:
    """Refuse names of curves that points will not have, before anything is run."""
    if asked.plot is None or asked.plot_of is None:
        return
    from lagrange_cli.simulate.results.curves import read_panels

    names = [name for name in known.model.columns if not name.startswith("section ")]
    read_panels(asked.plot_of, ("t", *names, "energy"), "--plot-of")


def _of_one(session: Session, known: SectionModel, asked: SimulationRequest) -> tuple[Section, int]:
    """Find the section of the scene's motion; return also the exit code of an interrupt, or 0."""
    from lagrange_cli.simulate.simulation import RunContext
    from lagrange_cli.studies.section.members import single_section

    with session.progress("integrating") as progress, noted_interrupts() as interrupt:

        def stop() -> bool:
            return interrupt.asked

        context = RunContext(cache=session.cache, progress=progress, stop=stop)
        with heard_by(Listener(ends=stop)):
            section = single_section(known, asked.options, context)
    ended = section.members[0].status == "stopped" and interrupt.asked
    return section, interrupt.exit_code if ended else 0


def _of_members(
    session: Session,
    condition: WrittenCondition,
    known: SectionModel,
    choice: MemberChoice,
    asked: SimulationRequest,
) -> tuple[Section, int]:
    """Find the section of all members."""
    from lagrange_cli.studies.section.members import section_of_members

    def model(scene: SceneRequest) -> Model:
        return section_model_of_scene(session, scene, condition).model

    models = RememberedMembers(session, asked.scene, model, condition)
    members = chosen_members(choice)
    with session.progress("integrating") as progress:
        section = section_of_members(
            known,
            models,
            members,
            asked.options,
            jobs=choice.jobs or shared.cores(),
            progress=progress,
        )
    return section, 0
