"""LaTeX: a complete document, a snippet of equations, single equations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.latex.document import latex_document
from lagrange_cli.emit.latex.steps import LatexLetters, block_lines
from lagrange_cli.emit.latex.typesetter import Typesetter
from lagrange_cli.emit.steps.board import conclusions, working
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.layout import joined

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import DerivationSteps


def emit_latex(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Return ``NAME.tex``.

    Parameters
    ----------
    equations
        What a derivation yields.
    options
        ``style``: ``latex_document`` for a complete document that pdfLaTeX compiles
        with amsmath, booktabs and longtable; ``latex_snippet`` for the equations of
        motion alone (amsmath). ``form``: ``lagrange`` or ``explicit``.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    form = str(options["form"])
    write = latex_document if options["style"] == "document" else _latex_snippet
    return {f"{equations.name}.tex": write(equations, form)}


def _latex_snippet(equations: Equations, form: str = "lagrange") -> str:
    """The equations of motion, or the steps to them, for pasting (amsmath)."""
    setter = Typesetter.of(equations)
    title = equations.title or equations.name
    if equations.steps is not None:
        return _steps_snippet(setter, equations.steps, latex_text(title))
    rows = [*setter.motion(form), *setter.closures(), *setter.contacts()]
    lines = [
        f"% {latex_text(title)}: equations of motion (needs amsmath)",
        *setter.align([*rows, *setter.abbreviations()]),
    ]
    return "\n".join(lines) + "\n"


def _steps_snippet(setter: Typesetter, steps: DerivationSteps, title: str) -> str:
    """The steps with run-in headings, which fit into any section."""
    equations, letters = setter.equations, LatexLetters()
    lines = [f"% {title}: steps to the equations of motion (needs amsmath)"]
    sections = working(equations, steps, letters) + conclusions(equations, steps, letters)
    for section in sections:
        lines += [rf"\paragraph{{{section.heading}}}", *block_lines(setter, section.blocks), ""]
    return "\n".join(lines).rstrip() + "\n"


def equation_latex(equations: Equations, index: int) -> str:
    """One shown equation of motion on a line, without math delimiters or abbreviations."""
    setter = Typesetter.of(equations, abbreviating=False)
    return joined(setter.row(index))


def equations_latex(equations: Equations) -> str:
    """All equations of motion, then those of closures and contacts and what abbreviations stand
    for, in an ``aligned`` environment, without math delimiters."""
    setter = Typesetter.of(equations)
    rows = [f"& {joined(setter.row(i))}" for i in range(len(equations.shown))]
    rows += [f"& {joined(row.pieces)}" for row in (*setter.closures(), *setter.contacts())]
    rows += [f"& {row.label} {joined(row.pieces)}" for row in setter.abbreviations()]
    return "\n".join([r"\begin{aligned}", " \\\\\n".join(rows), r"\end{aligned}"])
