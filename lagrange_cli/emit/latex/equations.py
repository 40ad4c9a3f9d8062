"""LaTeX: a complete document, a snippet of equations, single equations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.contents import contents
from lagrange_cli.emit.document.motion import (
    accelerations,
    closure_rows,
    contact_rows,
    lagrange_equations,
)
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.forms.contents import form_sections
from lagrange_cli.emit.latex.document import latex_document
from lagrange_cli.emit.latex.letters import LatexLetters
from lagrange_cli.emit.latex.typesetter import Typesetter
from lagrange_cli.emit.steps.sections import Formula, Formulas, formulas
from lagrange_cli.notation.latex_escape import latex_text
from lagrange_cli.notation.layout import joined

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations


def emit_latex(equations: Equations, options: Mapping[str, OptionValue]) -> dict[str, str]:
    """Return ``NAME.tex``.

    Parameters
    ----------
    equations
        What a derivation yields.
    options
        ``style``: ``document`` for a complete document that pdfLaTeX compiles with amsmath,
        booktabs and longtable; ``snippet`` for the equations of motion alone (amsmath). ``form``:
        ``lagrange``, ``explicit``, ``hamiltonian`` or ``routhian``.

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
    title = latex_text(equations.title or equations.name)
    setter = Typesetter(stem=equations.name)
    writer = DocumentWriter(equations, LatexLetters(equations))
    if equations.steps is not None:
        return _steps_snippet(setter, writer, title)
    rows = _rows(writer, form)
    rows += [*closure_rows(writer), *contact_rows(writer)]
    rows += writer.abbreviations()
    lines = [
        f"% {title}: equations of motion (needs amsmath)",
        *setter.display(setter.rows(formulas(rows)), "equations", numbered=True),
    ]
    return "\n".join(lines) + "\n"


def _rows(writer: DocumentWriter, form: str) -> list[Formula]:
    """The formulas of a form."""
    if form == "lagrange":
        return lagrange_equations(writer)
    if form == "explicit":
        return accelerations(writer)
    sections = form_sections(form, writer, writer.words, writer.noted)
    blocks = (block for section in sections for block in section.blocks)
    return [row for block in blocks if isinstance(block, Formulas) for row in block.rows]


def _steps_snippet(setter: Typesetter, writer: DocumentWriter, title: str) -> str:
    """The steps with run-in headings, which fit into any section."""
    lines = [f"% {title}: steps to the equations of motion (needs amsmath)"]
    for section in contents(writer, ("energies", "equations", "conserved"), "lagrange"):
        lines += [rf"\paragraph{{{section.heading}}}", *setter.blocks(section), ""]
    return "\n".join(lines).rstrip() + "\n"


def equation_latex(equations: Equations, index: int) -> str:
    """One shown equation of motion on a line, without math delimiters or abbreviations."""
    writer = DocumentWriter(equations, LatexLetters(equations), abbreviating=False)
    (row,) = Typesetter().rows(formulas(lagrange_equations(writer)[index : index + 1]))
    return joined(row.pieces)


def equations_latex(equations: Equations) -> str:
    """All equations of motion, then those of closures and contacts and what abbreviations stand
    for, in an ``aligned`` environment, without math delimiters."""
    writer, setter = DocumentWriter(equations, LatexLetters(equations)), Typesetter()
    held = [*lagrange_equations(writer), *closure_rows(writer), *contact_rows(writer)]
    rows = [f"& {joined(row.pieces)}" for row in setter.rows(formulas(held))]
    named = setter.rows(formulas(writer.abbreviations()))
    rows += [f"& {row.label} {joined(row.pieces)}" for row in named]
    return "\n".join([r"\begin{aligned}", " \\\\\n".join(rows), r"\end{aligned}"])
