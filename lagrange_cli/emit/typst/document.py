"""Typst: a complete document, or the equations of motion alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.document.contents import Content, asked_content
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.language import language
from lagrange_cli.emit.typst.letters import TypstLetters
from lagrange_cli.emit.typst.typesetter import Typesetter
from lagrange_cli.notation.typst_symbols import typst_prose

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations

_PREAMBLE = """#set page(paper: "a4", margin: 25mm, numbering: "1")
#set text(font: "New Computer Modern", size: 11pt)
#set par(justify: true)
#set math.equation(number-align: end + bottom)
#show math.equation.where(block: true): set align(start)
#let numbered(body) = { set math.equation(numbering: "(1)"); body }
#let long(body) = { show math.equation: set block(breakable: true); body }
"""


def emit_typst(
    equations: Equations, options: Mapping[str, OptionValue], content: Content | None = None
) -> dict[str, str]:
    """Return ``NAME.typ`` of a content, by default that of the derivation.

    Parameters
    ----------
    equations
        What a derivation yields; its steps are written if it has any.
    options
        Those of the registry.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    content = content or asked_content(equations, options)
    setter, say = Typesetter(stem=equations.name), language(str(options["language"]))
    written_out = bool(options["written_out"])
    writer = DocumentWriter(equations, TypstLetters(equations), say, written_out=written_out)
    sections = content.sections(writer, setter.columns)
    blocks = [_opening(equations, say.code, content.about), *map(setter.section, sections)]
    return {f"{equations.name}.typ": "\n\n".join("\n".join(block) for block in blocks) + "\n"}


def _opening(equations: Equations, language: str, about: str) -> list[str]:
    title = typst_prose(equations.title or equations.name)
    lines = [
        f"// {equations.name}: {about}, written by lagrange",
        f'{_PREAMBLE}#set text(lang: "{language}")\n',
        f"#align(center, text(size: 17pt)[{title}])",
    ]
    if equations.description:
        lines += ["", typst_prose(equations.description)]
    return lines
