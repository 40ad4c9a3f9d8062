"""A complete LaTeX document of a derivation, in one column or two."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from lagrange_cli.emit.latex.options import LatexOptions
from lagrange_cli.emit.width import length
from lagrange_cli.notation.latex_escape import latex_prose, latex_text

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

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
    setter = options.setter(equations)
    sections = options.sections(equations)
    body = [setter.section(section) for section in sections]
    spread = [] if equations.steps is None else [r"\setlength{\jot}{1ex}"]
    title = latex_prose(equations.title or equations.name)
    opening = [
        f"% {latex_text(equations.name)}: {options.about}, written by lagrange",
        _preamble(options) + options.definitions(equations, chain(*body)) + r"\begin{document}",
        rf"\begin{{center}}\LARGE {title}\end{{center}}",
    ]
    if equations.description:
        opening += ["", latex_prose(equations.description)]
    blocks = [opening, spread, *body, [r"\end{document}"]]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


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
