"""``lagrange analyze``: equilibria, stability, linear systems, modes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.cli import options
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.models import SceneRequest, answer_of, derivation_of_scene
from lagrange_cli.cli.remembered import Answer, read_source, remembered
from lagrange_cli.cli.reports.analyze import (
    analysis_json,
    analysis_text,
    npz_of,
    with_lyapunov,
)
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.output import Command, page_encoding, print_text
from lagrange_cli.files import write_file
from lagrange_cli.notation.page import USUAL_WIDTH, Page

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation


@click.command(
    cls=Command, short_help="Symmetries, equilibria and their stability, linear system, modes."
)
@options.scene
@click.option(
    "--symmetries",
    is_flag=True,
    help="Displacements linear in the coordinates that change nothing, and what they conserve."
    "  [default: all parts that can be found]",
)
@click.option(
    "--equilibria",
    is_flag=True,
    help="Configurations of rest, and their stability.  [default: as before]",
)
@click.option(
    "--linearization",
    is_flag=True,
    help="M, C, K at an equilibrium, and A, B, C, D of first order.  [default: as before]",
)
@click.option(
    "--modes",
    is_flag=True,
    help="Frequencies and shapes; poles where there is damping.  [default: as before]",
)
@click.option(
    "--lyapunov",
    type=float,
    metavar="UNTIL",
    help="Lyapunov exponents of the motion until this time.  [default: none]",
)
@options.at
@click.option("--ascii", "ascii_only", is_flag=True, help="Text in plain ASCII.  [default: off]")
@options.parameters
@options.json_flag("Report as JSON.")
@options.analysis_path
@options.common
@click.pass_obj
def analyze(
    session: Session,
    scene: str,
    symmetries: bool,
    equilibria: bool,
    linearization: bool,
    modes: bool,
    lyapunov: float | None,
    at: dict[str, str],
    ascii_only: bool,
    parameters: dict[str, str],
    as_json: bool,
    output: str | None,
) -> None:
    """Analyze the equations of motion of SCENE, a YAML file or - for standard input."""
    source = read_source(scene)
    guard(source, parameters, {"-o": output})
    asked = {
        "symmetries": symmetries,
        "equilibria": equilibria,
        "linearization": linearization,
        "modes": modes,
    }
    parts = [part for part, wanted in asked.items() if wanted]
    as_arrays = output is not None and Path(output).suffix.lower() == ".npz"
    if as_arrays and parts and not linearization:
        raise click.UsageError("an .npz file holds the linear system; add --linearization")
    encoding = page_encoding()
    request = SceneRequest(source, parameters)

    def work() -> Answer:
        derivation = derivation_of_scene(session, request)
        asked = parts if parts or lyapunov is None else None
        answer = _answer(derivation, asked, at, ascii_only, encoding)
        if lyapunov is not None:
            with session.progress("following neighbouring motions") as move:
                found = derivation.lyapunov(until=lyapunov, progress=move)
            answer = with_lyapunov(answer, found)
        return answer_of(derivation, answer)

    question = parts, lyapunov, list(at.items()), ascii_only, encoding, list(parameters.items())
    value = remembered(session, "analyze", source, question, work)
    report = value["report"]
    if output is not None:
        write_file(output, npz_of(_with_matrices(report)) if as_arrays else analysis_json(report))
    if as_json:
        print_text(analysis_json(report), "json")
    else:
        print_text(Page.from_json(value["page"]), width=USUAL_WIDTH)


def _answer(
    derivation: Derivation,
    parts: list[str] | None,
    at: dict[str, str],
    ascii_only: bool,
    encoding: str,
) -> dict[str, Any]:
    """Report and page of an analysis; of the equations alone if no parts are wanted."""
    from lagrange_cli.analysis.values import Analysis
    from lagrange_cli.emit.analysis.report import analysis_report

    empty = Analysis(derivation.equations)
    analysis = empty if parts is None else derivation.analyze(*parts, at=at)
    text = analysis_text(analysis, ascii=ascii_only, encoding=encoding)
    return {"report": analysis_report(analysis), "page": text.to_json()}


def _with_matrices(report: dict[str, Any]) -> dict[str, Any]:
    """Return a report that has a linear system.

    Raises
    ------
    InputError
        It was left out.
    """
    if report["linearization"] is None:
        from lagrange_cli.errors import InputError, Problem

        reasons = [left["reason"] for left in report["left_out"]]
        raise InputError(Problem(f"there is no linear system: {reasons[0]}", rule="analyze"))
    return report
