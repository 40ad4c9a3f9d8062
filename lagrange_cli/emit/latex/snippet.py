"""Parts of a derivation for a document of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.document.contents import contents
from lagrange_cli.emit.document.motion import (
    accelerations,
    closure_rows,
    contact_rows,
    lagrange_equations,
)
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.steps.sections import formulas
from lagrange_cli.notation.latex_escape import latex_text

if TYPE_CHECKING:
    from lagrange_cli.emit.latex.options import LatexOptions
    from lagrange_cli.mechanics.equations import Equations


def latex_snippet(equations: Equations, options: LatexOptions) -> str:
    """The equations of motion alone, or several parts with run-in headings."""
    writer = options.writer(equations)
    title = latex_text(equations.title or equations.name)
    needs = "amsmath and tikz" if "sketch" in options.parts else "amsmath"
    if equations.steps is not None:
        lines = [f"% {title}: steps to the equations of motion (needs {needs})"]
        return _with_headings(lines, writer, options)
    lines = [f"% {title}: equations of motion (needs {needs})"]
    if options.parts != ("equations",):
        return _with_headings(lines, writer, options)
    setter = options.setter(equations)
    rows = accelerations(writer) if options.form == "explicit" else lagrange_equations(writer)
    rows += [*closure_rows(writer), *contact_rows(writer)]
    rows += writer.abbreviations()
    shown = setter.rows(formulas(rows))
    lines += setter.display(shown, "equations", numbered=options.numbered)
    return "\n".join(lines) + "\n"


def _with_headings(lines: list[str], writer: DocumentWriter, options: LatexOptions) -> str:
    """Headings within the text, which fit into any section."""
    setter = options.setter(writer.equations)
    for section in contents(writer, options.parts, options.form):
        lines += [rf"\paragraph{{{section.heading}}}", *setter.blocks(section), ""]
    return "\n".join(lines).rstrip() + "\n"
