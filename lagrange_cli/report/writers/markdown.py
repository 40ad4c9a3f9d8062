"""Markdown with LaTeX formulas between dollars, as notebooks and forges of code show it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from lagrange_cli.notation.symbols import printable
from lagrange_cli.report import tree
from lagrange_cli.report.inlines import Lettering, say
from lagrange_cli.report.phrases.language import Language
from lagrange_cli.report.writers.latex.letters import LatexLetters
from lagrange_cli.report.writers.latex.typesetter import Typesetter

#: Punctuation that is markup anywhere in a line, and at its beginning.
_MARKUP = re.compile(r"([\\`*_{}\[\]<>#$|~&!])")
_OPENING = re.compile(r"^(\d*)([-+=.):])")


class MarkdownLetters(LatexLetters):
    """Letters of LaTeX; text of a scene with all its punctuation escaped."""

    def words(self, text: str) -> str:
        plain = " ".join(printable(text).split())
        return _OPENING.sub(r"\1\\\2", _MARKUP.sub(r"\\\1", plain))

    def typed(self, text: str) -> str:
        return f"`{text}`"

    def unit(self, text: str) -> str:
        written = super().unit(text)
        return written if written.startswith("$") else self.words(text)


def report_markdown(document: tree.Document, say: Language) -> str:
    """Return a document."""
    setter = Typesetter(Lettering(MarkdownLetters(document.equations), say))
    title, description = setter.text(document.title), setter.text(document.description)
    paragraphs = [*([f"# {title}"] if title else []), *([description] if description else [])]
    for section in document.sections:
        paragraphs += _section(section, setter)
    return "\n\n".join(paragraphs) + "\n"


def _section(section: tree.Section, setter: Typesetter) -> Iterator[str]:
    if heading := setter.text(section.heading):
        yield f"## {heading}"
    for block in setter.fitted(section):
        yield from _block(block, setter)


def _block(block: tree.PlainBlock, setter: Typesetter) -> Iterator[str]:
    match block:
        case tree.Paragraph(text) | tree.Title(text):
            yield setter.text(text)
        case tree.Law(text):
            yield _display([setter.text(text)])
        case tree.Formulas():
            yield from map(_display, setter.aligned(setter.rows(block)))
        case tree.Table(heads, rows):
            dashes = ["---:" if head in block.numeric else "---" for head in heads]
            lines = (
                " | ".join(_cell(setter.text(cell)) for cell in row)
                for row in (heads, dashes, *rows)
            )
            yield "\n".join(f"| {line} |" for line in lines)
        case tree.Bullets(items, counted):
            shown = enumerate(map(setter.text, items), 1)
            yield "\n".join(f"{f'{k}.' if counted else '-'} {item}" for k, item in shown)
        case tree.Labelled(rows):
            terms = (
                say("{name}: {value}", name=f"**{setter.text(label)}**", value=text)
                for label, text in rows
            )
            yield "\n".join(f"- {setter.text(term)}" for term in terms)
        case tree.Verbatim(lines):
            # A fence is longer than any within it.
            runs = re.findall("`+", "\n".join(lines))
            fence = "`" * max(3, *(len(run) + 1 for run in runs), 0)
            yield "\n".join([f"{fence}text", *lines, fence])
        case tree.Picture():
            pass


def _cell(text: str) -> str:
    """Return a cell of a table; bars of a formula would end it."""
    return text.replace("|", r"\vert{}") if text.startswith("$") else text


def _display(lines: Sequence[str]) -> str:
    return "\n".join(["$$", *lines, "$$"])
