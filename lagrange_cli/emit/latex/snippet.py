"""Parts of a derivation for a document of one's own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.document.contents import derivation_content
from lagrange_cli.emit.document.motion import (
    accelerations,
    closure_rows,
    contact_rows,
    lagrange_equations,
)
from lagrange_cli.emit.forms.contents import FORMS
from lagrange_cli.emit.steps.sections import formulas
from lagrange_cli.notation.latex_escape import latex_text

if TYPE_CHECKING:
    from lagrange_cli.emit.latex.options import LatexOptions
    from lagrange_cli.mechanics.equations import Equations


def latex_snippet(equations: Equations, options: LatexOptions) -> str:
    """The equations of motion alone, or several parts with run-in headings."""
    writer, setter = options.writer(equations), options.setter(equations)
    title = latex_text(equations.title or equations.name)
    needs = "amsmath and tikz" if "sketch" in options.parts else "amsmath"
    content = options.content or derivation_content(equations, options.parts, options.form)
    is_alone = options.parts == ("equations",) and options.form not in FORMS
    if equations.steps is None and is_alone and options.content is None:
        rows = accelerations(writer) if options.form == "explicit" else lagrange_equations(writer)
        rows += [*closure_rows(writer), *contact_rows(writer)]
        rows += writer.abbreviations()
        shown = setter.rows(formulas(rows))
        body = setter.display(shown, "equations", numbered=options.numbered)
        told = writer.left_out()
        body += [] if told is None else [told.text]
    else:
        # Headings within the text fit into any section.
        body = [
            line
            for section in options.sections(equations)
            for line in (rf"\paragraph{{{section.heading}}}", *setter.blocks(section), "")
        ]
    heading = f"% {title}: {content.about} (needs {needs})\n"
    return heading + options.definitions(equations, body) + "\n".join(body).rstrip() + "\n"
