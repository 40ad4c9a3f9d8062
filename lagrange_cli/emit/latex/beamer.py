"""A derivation as frames of beamer, one idea a frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import chain
from typing import TYPE_CHECKING

from lagrange_cli.emit.steps.sections import Block, Section, Title
from lagrange_cli.notation.symbols import latex_prose, latex_text

if TYPE_CHECKING:
    from lagrange_cli.emit.latex.options import LatexOptions
    from lagrange_cli.mechanics.equations import Equations

_PREAMBLE = r"""\documentclass[10pt]{beamer}
\usepackage[T1]{fontenc}
\usepackage[utf8]{inputenc}
\IfFileExists{lmodern.sty}{\usepackage{lmodern}}{}
\usepackage{amsmath}
\usepackage{booktabs}
\usepackage{tabularx}
\usefonttheme[onlymath]{serif}
\setbeamertemplate{navigation symbols}{}
\setbeamertemplate{footline}[frame number]
\setbeamertemplate{frametitle continuation}[from second]
\allowdisplaybreaks
\setlength{\splitmaxdepth}{4pt}
\setlength{\emergencystretch}{3em}
\setlength{\parskip}{0.3\baselineskip}
"""


def latex_frames(equations: Equations, options: LatexOptions) -> str:
    """Frames that pdfLaTeX compiles with beamer: a title, then one for each idea.

    A section is a frame, and each coordinate, particle or force of its own within one. What is too
    long for a frame goes on in the next, broken between lines.
    """
    setter = options.setter(equations)
    title = latex_prose(equations.presentation.title or equations.presentation.name)
    frames = [
        [
            r"\begin{frame}[allowframebreaks=0.85]",
            r"\begin{center}\usebeamerfont{title}\usebeamercolor[fg]{title}",
            title,
            r"\end{center}",
            latex_prose(equations.presentation.description or ""),
            r"\end{frame}",
        ]
    ]
    frames += [
        [
            rf"\begin{{frame}}[allowframebreaks=0.85]{{{section.heading}}}",
            *([rf"\framesubtitle{{{subtitle}}}"] if subtitle else []),
            *setter.blocks(part),
            r"\end{frame}",
        ]
        for section in options.sections(equations)
        for subtitle, part in _ideas(section)
    ]
    opening = [
        f"% {latex_text(equations.presentation.name)}: {options.about}, written by lagrange",
        _PREAMBLE
        + ("\\usepackage{tikz}\n" if "sketch" in options.parts else "")
        + options.definitions(equations, chain(*frames))
        + r"\begin{document}",
    ]
    blocks = [opening, *frames, [r"\end{document}"]]
    return "\n\n".join("\n".join(filter(None, block)) for block in blocks) + "\n"


def _ideas(section: Section) -> Iterator[tuple[str, Section]]:
    """Return the parts of a section that have a title of their own, each with it."""
    subtitle, gathered = "", list[Block]()
    for block in section.blocks:
        if isinstance(block, Title):
            if gathered:
                yield subtitle, replace(section, blocks=tuple(gathered))
            subtitle, gathered = block.text.rstrip(" :\u00a0"), []
        else:
            gathered.append(block)
    if gathered:
        yield subtitle, replace(section, blocks=tuple(gathered))
