"""LaTeX of a derivation or analysis: a document that compiles, a snippet, single equations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from lagrange_cli.notation.layout import joined, prefixed
from lagrange_cli.notation.symbols import latex_text
from lagrange_cli.report.contents.derivation.documents import titled
from lagrange_cli.report.contents.derivation.motion import (
    accelerations,
    closure_rows,
    contact_rows,
    lagrange_equations,
)
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.forms.contents import FORMS
from lagrange_cli.report.document_options import EXERCISES, length
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import ENGLISH
from lagrange_cli.report.tree import formulas
from lagrange_cli.report.writers.latex.beamer import latex_frames
from lagrange_cli.report.writers.latex.letters import LatexLetters
from lagrange_cli.report.writers.latex.options import LatexOptions
from lagrange_cli.report.writers.latex.typesetter import Typesetter

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.report.contents.derivation.documents import Content
    from lagrange_cli.report.phrases.language import Language
    from lagrange_cli.report.tree import Document, Section

_PACKAGES = r"""\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
"""

_SETTINGS = r"""\usepackage{amsmath}
\usepackage{booktabs}
\usepackage{tabularx}
\allowdisplaybreaks
\setlength{\emergencystretch}{3em}
\setlength{\parindent}{0pt}
\setlength{\parskip}{0.5\baselineskip}
"""

#: Millimetres of a page that are no lines, and of a page in A4.
_MARGINS, _A4 = 50, 210


def latex_document(equations: Equations, options: LatexOptions | None = None) -> str:
    """A document that pdfLaTeX compiles by itself: system, freedom, L, motion, conservation."""
    options = options or LatexOptions()
    document = titled(equations, options.shown(equations), options.sections(equations))
    return _document_latex(document, options)


def report_latex(document: Document, say: Language) -> str:
    """Return a document in A4 that pdfLaTeX compiles by itself."""
    return _document_latex(document, LatexOptions(say=say))


def body_latex(document: Document, say: Language) -> str:
    """Return what a document holds, as part of another one, which needs amsmath and booktabs."""
    lettering = Lettering(LatexLetters(document.equations), say)
    setter = Typesetter(lettering, numbered=False, has_tabularx=False)
    title, description = setter.text(document.title), setter.text(document.description)
    opening = [rf"\subsection*{{{title}}}"] if title else []
    return "\n".join([*opening, description, *_run_in(document.sections, setter)])


def _run_in(sections: Iterable[Section], setter: Typesetter) -> Iterator[str]:
    """Yield sections whose headings stand within the text, so that they fit into any other."""
    for section in sections:
        if heading := setter.text(section.heading):
            yield rf"\paragraph{{{heading}}}"
        yield from (*setter.blocks(section), "")


def _document_latex(document: Document, options: LatexOptions) -> str:
    equations, sections = document.equations, document.sections
    setter = options.setter(equations, document.name)
    has_steps = equations is not None and equations.derivation.steps is not None
    body = _kept_together(setter, sections, [setter.section(section) for section in sections])
    title, description = setter.text(document.title), setter.text(document.description)
    opening = [
        f"% {latex_text(document.name)}: {document.about}, written by lagrange",
        _preamble(options) + setter.definitions(chain(*body)) + r"\begin{document}",
        *([rf"\begin{{center}}\LARGE {title}\end{{center}}"] if title else []),
        *(["", description] if description else []),
    ]
    spread = [r"\setlength{\jot}{1ex}"] if has_steps else []
    blocks = [opening, spread, *body, [r"\end{document}"]]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _kept_together(
    setter: Typesetter, sections: Sequence[Section], body: list[list[str]]
) -> list[list[str]]:
    """Keep the certificate on a page with the end of what stands before it."""
    if len(sections) > 1 and sections[-1].name == "certificate":
        body[-2].insert(0, r"\postdisplaypenalty=10000")
        heading = rf"\bigskip{{\Large\bfseries {setter.text(sections[-1].heading)}}}"
        body[-1][0] = rf"\par\nobreak{heading}\par\nobreak\smallskip"
    return body


def _preamble(options: LatexOptions) -> str:
    points, pictures = length(options.width), ""
    if "sketch" in options.parts:
        pictures = "\\usepackage{tikz}\n"
    if options.width == "column":
        # Lines of a narrow column may be looser than those of a page.
        return (
            "\\documentclass[10pt,a4paper,twocolumn]{article}\n"
            f"{_PACKAGES}\\usepackage[margin=20mm,columnsep=8mm]{{geometry}}\n"
            f"{_SETTINGS}{pictures}\\sloppy\n"
        )
    geometry = "margin=25mm"
    if points is not None:
        paper = max(_A4, points / 72.27 * 25.4 + _MARGINS)
        geometry = f"paperwidth={paper:.4g}mm,textwidth={options.width},hcentering,vmargin=25mm"
    return (
        "\\documentclass[11pt,a4paper]{article}\n"
        f"{_PACKAGES}\\usepackage[{geometry}]{{geometry}}\n{_SETTINGS}{pictures}"
    )


def latex_snippet(equations: Equations, options: LatexOptions) -> str:
    """Return the equations of motion alone, or several parts with run-in headings."""
    writer, setter = (
        options.writer(equations),
        options.setter(equations, equations.presentation.name),
    )
    title = latex_text(equations.presentation.title or equations.presentation.name)
    needs = "amsmath and tikz" if "sketch" in options.parts else "amsmath"
    is_alone = options.parts == ("equations",) and options.form not in FORMS
    if equations.derivation.steps is None and is_alone and options.content is None:
        rows = accelerations(writer) if options.form == "explicit" else lagrange_equations(writer)
        rows += [*closure_rows(writer), *contact_rows(writer)]
        rows += writer.abbreviations()
        shown = setter.rows(formulas(rows))
        body = setter.display(shown, "equations", numbered=options.numbered)
        note = writer.left_out()
        body += [] if note is None else [setter.text(note.text)]
    else:
        body = list(_run_in(options.sections(equations), setter))
    heading = f"% {title}: {options.shown(equations).about} (needs {needs})\n"
    return heading + setter.definitions(body) + "\n".join(body).rstrip() + "\n"


_STYLES = {
    "beamer": latex_frames,
    "snippet": latex_snippet,
    **dict.fromkeys(("document", *EXERCISES), latex_document),
}


def emit_latex(
    equations: Equations, options: Mapping[str, OptionValue], content: Content | None = None
) -> dict[str, str]:
    """Return ``NAME.tex`` of a content, by default that of the derivation.

    Parameters
    ----------
    equations
        What a derivation yields.
    options
        Those of the registry. A document needs amsmath and booktabs, a snippet amsmath, frames
        beamer too; sketches need tikz.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    InputError
        Constraint forces are asked for and were not derived, or the system cannot be drawn.
    """
    chosen = LatexOptions.of(equations, options, content)
    return {f"{equations.presentation.name}.tex": _STYLES[chosen.style](equations, chosen)}


def equation_latex(equations: Equations, index: int) -> str:
    """One shown equation of motion on a line, without math delimiters or abbreviations."""
    writer = DocumentWriter(equations, abbreviating=False, written_out=True)
    (row,) = _setter(equations).rows(formulas(lagrange_equations(writer)[index : index + 1]))
    return joined(row.pieces)


def equations_latex(equations: Equations) -> str:
    """All equations of motion, then those of closures and contacts and what abbreviations stand
    for, in an ``aligned`` environment, without math delimiters; long ones on several lines."""
    writer, setter = DocumentWriter(equations), _setter(equations)
    equation_rows = [*lagrange_equations(writer), *closure_rows(writer), *contact_rows(writer)]
    rows = [replace(row, label="") for row in setter.rows(formulas(equation_rows))]
    for row in setter.rows(formulas(writer.abbreviations())):
        label = f"{row.label} "
        rows.append(replace(row, label="", pieces=prefixed(row.pieces, label, setter.room(label))))
    lines = " \\\\\n".join(line.strip() for line in setter.lines(rows))
    return "\n".join([r"\begin{aligned}", lines, r"\end{aligned}"])


def _setter(equations: Equations) -> Typesetter:
    return Typesetter(Lettering(LatexLetters(equations), ENGLISH))
