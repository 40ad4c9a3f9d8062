"""``lagrange analyze``: equilibria, stability, linear systems, modes."""

from __future__ import annotations

import base64
import math
from dataclasses import astuple, dataclass, replace
from typing import TYPE_CHECKING, Any

import click

from lagrange_cli.api.formats import ANALYZED, ENDINGS, completed
from lagrange_cli.api.remembered import read_source
from lagrange_cli.api.remembered_scene import RememberedScene
from lagrange_cli.cli import options
from lagrange_cli.cli.format_options import of_formats
from lagrange_cli.cli.guard import guard
from lagrange_cli.cli.requests.analysis import AnalysisPictures, AnalysisRequest
from lagrange_cli.cli.session import Session
from lagrange_cli.cli.terminal.command import Command, heading
from lagrange_cli.cli.terminal.output import deliver, page_encoding
from lagrange_cli.files import ending_of, write_file
from lagrange_cli.report import USUAL_WIDTH, Page
from lagrange_cli.report.tables import json_text

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation
    from lagrange_cli.api.analyzed import Analyzed


#: Endings of files in place of what is printed.
_OF_FORMATS = tuple(ending for name, ending in ENDINGS.items() if name != "json")


def _value_range(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, str, str] | None:
    """Split ``NAME=FROM..TO``; both ends stay texts for the scene reader."""
    if value is None:
        return None
    name, _, ends = (part.strip() for part in value.partition("="))
    first, _, last = (part.strip() for part in ends.partition(".."))
    if not (name and first and last):
        raise click.BadParameter(f"'{value}' is not of the form NAME=FROM..TO", ctx, option)
    return name, first, last


def _frequencies(
    ctx: click.Context, option: click.Parameter, value: str | None
) -> tuple[float, float] | None:
    """Read a range of angular frequencies, ``FROM..TO``."""
    if value is None:
        return None
    first, dots, last = value.partition("..")
    try:
        low, high = float(first), float(last)
    except ValueError:
        low = high = math.nan
    if not (dots and 0 < low < high < math.inf):
        message = f"'{value}' is no range of positive frequencies, as 0.1..100"
        raise click.BadParameter(message, ctx, option)
    return low, high


@click.command(cls=Command)
@options.scene
@heading("Parts; without any of these options, the first five")
@click.option(
    "--symmetries",
    is_flag=True,
    help="Symmetries that are linear in the coordinates, and what they conserve.",
)
@click.option(
    "--equilibria",
    is_flag=True,
    help="Configurations of rest, and their stability.",
)
@click.option(
    "--linearization",
    is_flag=True,
    help="M, C, K at an equilibrium, and A, B, C, D of first order.",
)
@click.option(
    "--modes",
    is_flag=True,
    help="Frequencies and shapes; poles where there is damping.",
)
@click.option(
    "--contacts",
    is_flag=True,
    help="Forces of closed contacts, and where these are lost.",
)
@click.option(
    "--steady",
    is_flag=True,
    help="Steady motions, in which cyclic coordinates turn, in place of equilibria.",
)
@click.option(
    "--branches",
    callback=_value_range,
    metavar="NAME=FROM..TO",
    help="Branches of equilibria, and their stability, as a parameter varies.",
)
@click.option(
    "--lyapunov",
    type=float,
    metavar="UNTIL",
    help="Lyapunov exponents of the motion until this time.",
)
@click.option(
    "--along",
    type=float,
    metavar="UNTIL",
    help="A(t), B(t), C(t), D(t) along the motion until this time.",
)
@click.option(
    "--response",
    callback=_frequencies,
    metavar="FROM..TO",
    help="Responses of outputs to inputs between two angular frequencies.",
)
@heading("State and parameters")
@options.at
@options.parameters
@options.number(
    "--accuracy",
    "EPS",
    "With --along: largest error, as a part of scales.  [default: 1e-6]",
)
@click.option(
    "--samples",
    type=int,
    metavar="N",
    help="With --along: number of samples.  [default: the scene's, or 501]",
)
@heading("Output")
@options.file(
    "-o --output",
    "Write the report, as .json, the matrices, as .npz, or what --format says, as"
    f" {', '.join(_OF_FORMATS)}.",
    callback=options.writable_as(".json", ".npz", *_OF_FORMATS),
)
@options.format_by_ending(ANALYZED)
@options.json_flag("The same as --format json.")
@click.option("--ascii", "ascii_only", is_flag=True, help="Text in plain ASCII.")
@heading("Pictures")
@options.plot(
    "Draw the shapes of --modes, the Bode diagram of --response or the bifurcation diagram of"
    " --branches, as .pdf, .svg, .png, .pgf or .tex.",
    "tex",
)
@options.file(
    "--animate",
    "Draw the modes of --modes moving, as .svg or .gif.",
    callback=options.writable_as(".svg", ".gif"),
)
@options.plot(
    "Draw the root loci of --branches, as .pdf, .svg, .png, .pgf or .tex.",
    "tex",
    name="--loci",
)
@heading("Documents")
@of_formats(ANALYZED)
@options.common
@click.pass_context
def analyze(
    ctx: click.Context,
    /,
    scene: str,
    symmetries: bool,
    equilibria: bool,
    linearization: bool,
    modes: bool,
    contacts: bool,
    lyapunov: float | None,
    along: float | None,
    response: tuple[float, float] | None,
    accuracy: float | None,
    samples: int | None,
    steady: bool,
    at: dict[str, str],
    plot: str | None,
    animate: str | None,
    branches: tuple[str, str, str] | None,
    loci: str | None,
    format_: str | None,
    ascii_only: bool,
    parameters: dict[str, str],
    as_json: bool,
    output: str | None,
    **chosen: str | bool | None,
) -> None:
    """Analyze the equations of motion of SCENE, a YAML file or - for standard input."""
    session: Session = ctx.obj
    asked = RememberedScene(session, read_source(scene), parameters)
    guard(asked, {"-o": output, "--plot": plot, "--animate": animate, "--loci": loci})
    named = {
        "symmetries": symmetries,
        "equilibria": equilibria,
        "linearization": linearization and along is None,
        "modes": modes,
        "contacts": contacts,
    }
    request = AnalysisRequest(
        tuple(part for part, wanted in named.items() if wanted),
        at,
        steady,
        branches,
        lyapunov,
        along,
        response,
        accuracy,
        samples,
    )
    request.require_use()
    pictures = AnalysisPictures.of(request, plot, loci, animate)
    # JSON is written beside what the terminal shows.
    document = output if output is not None and ending_of(output) in _OF_FORMATS else None
    to = options.chosen_format(session, format_, document, as_json=as_json)
    given_options = {name: value for name, value in chosen.items() if value is not None}
    form = _Form.of(
        to, output, ascii_only, session.defaults.for_documents(ANALYZED[to], given_options)
    )
    if form.ending == ".npz":
        request.require_linear_system(linearization=linearization)
    branch_pictures = {name: ending_of(path) for name, path in pictures.of_branches.items()}

    def analyzed(derivation: Derivation) -> Any:
        analysis = request.analysis(derivation, session)
        answer = {"report": analysis.report(), "shown": form.written(analysis)}
        for name, ending in branch_pictures.items():
            drawing = analysis.drawn(ending.lstrip("."), loci=name == "loci")
            answer[name] = base64.b64encode(drawing).decode()
        return answer

    question = astuple(request), branch_pictures, form.key
    value = asked.answer("analyze", question, "", analyzed, reads_recordings=request.of_motions)
    for name, path in pictures.of_branches.items():
        write_file(path, base64.b64decode(value[name]))
    if replace(pictures, diagram=None, loci=None) != AnalysisPictures():
        pictures.draw_others(asked.derivation(), request, session)
    form.deliver(value)
    if along is not None and value["report"]["along"]["status"] != "ok":
        ctx.exit(1)


@dataclass(frozen=True)
class _Form:
    """Format and file of an analysis.

    Attributes
    ----------
    format_
        What is written for readers.
    output
        The file, None for the terminal; of a report as JSON or of arrays, which is written beside
        what the terminal shows; or of the text itself.
    written_with
        Options of the format that were given.
    ascii_only
        Text in plain ASCII.
    """

    format_: str
    output: str | None
    written_with: dict[str, str | bool]
    ascii_only: bool

    @classmethod
    def of(
        cls,
        format_: str,
        output: str | None,
        ascii_only: bool,
        written_with: dict[str, str | bool],
    ) -> _Form:
        """Check that options belong to the format.

        Raises
        ------
        click.UsageError
            They do not, or the file's name does not end as it should.
        """
        completed(format_, ANALYZED[format_], written_with)
        form = cls(format_, output, written_with, ascii_only)
        if output is not None and form.ending not in (".json", ".npz", ENDINGS[format_]):
            message = f"'{output}' does not end in .json, .npz or {ENDINGS[format_]}"
            raise click.BadParameter(f"{message}, as --format {format_} asks", param_hint="'-o'")
        return form

    @property
    def ending(self) -> str:
        return "" if self.output is None else ending_of(self.output)

    @property
    def _reported(self) -> bool:
        """True if the file is for programs, and the terminal shows the text."""
        return self.ending in (".json", ".npz")

    @property
    def _encoding(self) -> str:
        """Files are in UTF-8; terminals may show less."""
        return page_encoding() if self.output is None or self._reported else "utf-8"

    @property
    def key(self) -> list[Any]:
        """The same as JSON values, as far as the text depends on it."""
        return [self.format_, sorted(self.written_with.items()), self.ascii_only, self._encoding]

    def written(self, analysis: Analyzed) -> Any:
        """Return an analysis in this form, as a JSON value."""
        shown = analysis.written(
            self.format_, ascii=self.ascii_only, encoding=self._encoding, **self.written_with
        )
        return shown.to_json() if isinstance(shown, Page) else shown

    def deliver(self, value: dict[str, Any]) -> None:
        """Write a report and what readers are shown, from an answer."""
        report, shown = value["report"], value["shown"]
        if self.output is not None and self._reported:
            write_file(self.output, self._content(report))
        page = shown if isinstance(shown, str) else Page.from_json(shown)
        file = None if self._reported else self.output
        deliver(page, self.format_, file, width=USUAL_WIDTH)

    def _content(self, report: dict[str, Any]) -> str | bytes:
        """Return the report as its file holds it."""
        if self.ending == ".json":
            return json_text(report)
        from lagrange_cli.api.analyzed import matrices_of

        return matrices_of(report)
