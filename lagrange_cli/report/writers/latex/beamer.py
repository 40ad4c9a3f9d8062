"""A derivation as frames of beamer, each filled with the ideas that it has room for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import chain, pairwise
from typing import TYPE_CHECKING

from lagrange_cli.notation.symbols import latex_prose, latex_text
from lagrange_cli.report.tree import Block, Section, Title
from lagrange_cli.report.writers.latex.typesetter import Typesetter, letter_count

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.report.writers.latex.options import LatexOptions

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


#: Lines that a frame has room for below its title; beamer breaks a frame that takes more.
_ROOM = 18.6

#: Lines that a heading within a frame takes, with the space above it.
_HEADING = 1.6

#: Lines that a title below that of the frame takes.
_SUBTITLE = 1.5

#: Letters of a line of text.
_LETTERS = 62

#: What begins a display, a table or a list: its environment, or none.
_OPENS = re.compile(r"\\begin\{([a-z]+\*?)\}|\\\[")

#: What is higher than a line in a formula.
_TALL = re.compile(r"\\[dt]?frac|\\sum|\\sqrt|\\int|\\begin\{[pb]matrix\}")


@dataclass(frozen=True)
class _Idea:
    """A part of a section that is not torn apart unless it is longer than a frame.

    Attributes
    ----------
    heading
        The heading of its section.
    subtitle
        The coordinate, particle or force that it is about, empty if there is none.
    lines
        Its text.
    small
        True if it is set in small print.
    """

    heading: str
    subtitle: str
    lines: list[str]
    small: bool = False

    @cached_property
    def height(self) -> float:
        return (0.7 if self.small else 1.0) * _height("\n".join(self.lines))

    @property
    def text(self) -> list[str]:
        return [r"{\footnotesize", *self.lines, r"\par}"] if self.small else self.lines


def latex_frames(equations: Equations, options: LatexOptions) -> str:
    """Write frames that pdfLaTeX compiles with beamer.

    A frame holds the sections, and the coordinates, particles or forces within one, that it has
    room for. What is too long for a frame goes on in the next, broken between lines.
    """
    setter = options.setter(equations, equations.presentation.name)
    title = latex_prose(equations.presentation.title or equations.presentation.name)
    opening = _Idea(title, "", [latex_prose(equations.presentation.description or "")])
    ideas = [
        _Idea(
            setter.text(section.heading),
            subtitle,
            setter.blocks(part),
            small=section.name == "certificate",
        )
        for section in options.sections(equations)
        for subtitle, part in _ideas(section, setter)
    ]
    frames = [_frame(together) for together in _filled([opening, *ideas])]
    about = options.shown(equations).about
    preamble = [
        f"% {latex_text(equations.presentation.name)}: {about}, written by lagrange",
        _PREAMBLE
        + ("\\usepackage{tikz}\n" if "sketch" in options.parts else "")
        + setter.definitions(chain(*frames))
        + r"\begin{document}",
    ]
    blocks = [preamble, *frames, [r"\end{document}"]]
    return "\n\n".join("\n".join(filter(None, block)) for block in blocks) + "\n"


def _ideas(section: Section, setter: Typesetter) -> Iterator[tuple[str, Section]]:
    """Return the parts of a section that have a title of their own, each with it."""
    subtitle, gathered = "", list[Block]()
    for block in setter.fitted(section):
        if isinstance(block, Title):
            if gathered:
                yield subtitle, replace(section, blocks=tuple(gathered))
            subtitle, gathered = setter.text(block.text).rstrip(" :\u00a0"), []
        else:
            gathered.append(block)
    if gathered:
        yield subtitle, replace(section, blocks=tuple(gathered))


def _filled(ideas: Sequence[_Idea]) -> list[list[_Idea]]:
    """Distribute ideas over frames; small print is never alone on one."""
    frames: list[list[_Idea]] = []
    room = 0.0
    for idea in ideas:
        needed = _HEADING + idea.height
        if frames and (needed <= room or idea.small):
            frames[-1].append(idea)
            room -= needed
        else:
            frames.append([idea])
            room = _ROOM - idea.height - _SUBTITLE * bool(idea.subtitle)
    return frames


def _frame(ideas: Sequence[_Idea]) -> list[str]:
    """Write a frame, whose title is the heading of its first idea."""
    first = ideas[0]
    lines = [rf"\begin{{frame}}[allowframebreaks=0.95]{{{first.heading}}}"]
    lines += [rf"\framesubtitle{{{first.subtitle}}}"] if first.subtitle else []
    lines += first.text
    for before, idea in pairwise(ideas):
        names = [idea.subtitle] if idea.heading == before.heading else [idea.heading, idea.subtitle]
        heading = ": ".join(filter(None, names))
        lines += [rf"\par\medskip\structure{{\large {heading}}}\par", *idea.text]
    return [*lines, r"\end{frame}"]


def _height(text: str) -> float:
    r"""Estimate the lines that a text takes.

    A row of a display with a fraction or a sum counts twice, and a display has space around it.
    """
    height, environment, end = 0.0, "", ""
    for line in map(str.strip, text.split("\n")):
        opened = _OPENS.match(line)
        if opened and not end:
            environment = opened[1] or ""
            end = rf"\end{{{environment}}}" if environment else r"\]"
            height += 0.9
        if end:
            height += _row_height(line, environment)
            end = "" if line.endswith(end) else end
        else:
            height += 1.2 * -(-letter_count(line) // _LETTERS)
    return height


def _row_height(line: str, environment: str) -> float:
    """Estimate the lines that a row of a display, a table or a list takes."""
    if not re.sub(r"\\(begin|end)\{.*|\\[a-z]+rule$|\\[\[\]]", "", line):
        return 0.0
    if environment.startswith(("tabular", "itemize")):
        return 1.05
    return 2.2 if _TALL.search(line) else 1.3
