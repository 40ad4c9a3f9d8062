"""The complete LaTeX document of a derivation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.base import DEFAULT_SECTIONS
from lagrange_cli.emit.document.contents import contents
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.latex.letters import LatexLetters
from lagrange_cli.emit.latex.typesetter import Typesetter
from lagrange_cli.notation.latex_escape import latex_text

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_PREAMBLE = r"""\documentclass[11pt,a4paper]{article}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage[margin=25mm]{geometry}
\usepackage{amsmath}
\usepackage{booktabs}
\usepackage{longtable}
\allowdisplaybreaks
\setlength{\emergencystretch}{3em}
\setlength{\parindent}{0pt}
\setlength{\parskip}{0.5\baselineskip}
"""


def latex_document(equations: Equations, form: str = "lagrange") -> str:
    """A document that pdfLaTeX compiles by itself: system, freedom, L, motion, conservation."""
    setter = Typesetter(stem=equations.name)
    writer = DocumentWriter(equations, LatexLetters(equations))
    sections = contents(writer, DEFAULT_SECTIONS, form)
    spread = [] if equations.steps is None else [r"\setlength{\jot}{1ex}"]
    blocks = [_opening(equations), spread, *map(setter.section, sections), [r"\end{document}"]]
    return "\n\n".join("\n".join(block) for block in blocks if block) + "\n"


def _opening(equations: Equations) -> list[str]:
    title = latex_text(equations.title or equations.name)
    lines = [
        f"% {latex_text(equations.name)}: equations of motion, written by lagrange",
        _PREAMBLE + r"\begin{document}",
        rf"\begin{{center}}\LARGE {title}\end{{center}}",
    ]
    if equations.description:
        lines += ["", latex_text(equations.description)]
    return lines
