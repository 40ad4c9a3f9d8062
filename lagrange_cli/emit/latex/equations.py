"""LaTeX: documents, frames, snippets, single equations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.motion import closure_rows, contact_rows, lagrange_equations
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.latex.beamer import latex_frames
from lagrange_cli.emit.latex.document import latex_document
from lagrange_cli.emit.latex.letters import LatexLetters
from lagrange_cli.emit.latex.options import LatexOptions
from lagrange_cli.emit.latex.snippet import latex_snippet
from lagrange_cli.emit.latex.typesetter import Typesetter
from lagrange_cli.emit.steps.sections import formulas
from lagrange_cli.notation.layout import joined, prefixed

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.emit.document.contents import Content
    from lagrange_cli.mechanics.equations import Equations

_STYLES = {"document": latex_document, "beamer": latex_frames, "snippet": latex_snippet}


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
    return {f"{equations.name}.tex": _STYLES[chosen.style](equations, chosen)}


def equation_latex(equations: Equations, index: int) -> str:
    """One shown equation of motion on a line, without math delimiters or abbreviations."""
    writer = DocumentWriter(
        equations, LatexLetters(equations), abbreviating=False, written_out=True
    )
    (row,) = Typesetter().rows(formulas(lagrange_equations(writer)[index : index + 1]))
    return joined(row.pieces)


def equations_latex(equations: Equations) -> str:
    """All equations of motion, then those of closures and contacts and what abbreviations stand
    for, in an ``aligned`` environment, without math delimiters; long ones on several lines."""
    writer, setter = DocumentWriter(equations, LatexLetters(equations)), Typesetter()
    held = [*lagrange_equations(writer), *closure_rows(writer), *contact_rows(writer)]
    rows = [replace(row, label="") for row in setter.rows(formulas(held))]
    for row in setter.rows(formulas(writer.abbreviations())):
        label = f"{row.label} "
        rows.append(replace(row, label="", pieces=prefixed(row.pieces, label, setter.room(label))))
    lines = " \\\\\n".join(line.strip() for line in setter.lines(rows))
    return "\n".join([r"\begin{aligned}", lines, r"\end{aligned}"])
