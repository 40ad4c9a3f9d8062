"""Formats of reports of values, the same for all: text, documents, JSON."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lagrange_cli.drawn import Reported
from lagrange_cli.files import can_encode
from lagrange_cli.notation.page import Page
from lagrange_cli.report.document_options import ENDINGS, writer_of
from lagrange_cli.report.inlines import Lettering
from lagrange_cli.report.phrases.language import Language, language
from lagrange_cli.report.registry import contents_of, json_of
from lagrange_cli.report.tables import json_text
from lagrange_cli.report.tree import Document

#: Names of the formats.
FORMATS = tuple(ENDINGS)


@dataclass(frozen=True)
class ReportForm:
    """The format of a report, and the language of its words, one of ``LANGUAGES``."""

    format: str = "text"
    language: str = "en"

    def written(self, value: object, encoding: str = "utf-8") -> str | Page:
        """Return the report of a value; text is in plain ASCII where an encoding has no more."""
        if self.format == "json":
            return json_text(json_of(value))
        document, say = contents_of(value), language(self.language)
        if self.format == "text":
            return _page(document.seen_by("terminal"), say, encoding)
        text: str = writer_of(self.format, "report")(document.seen_by("document"), say)
        return text


def spoken(text: str, code: str) -> str:
    """Return a phrase of a result in a language, as a terminal has it; other texts unchanged."""
    if code == "en":
        return text
    from lagrange_cli.report.contents.numbers import phrased
    from lagrange_cli.report.writers.terminal.letters import UnicodeLetters

    return Lettering(UnicodeLetters(), language(code)).text(phrased(text))


def _page(document: Document, say: Language, encoding: str) -> Page:
    from lagrange_cli.report.writers.terminal.sections import report_page

    page = report_page(document, say)
    is_plain = can_encode(page.text(), encoding)
    return page if is_plain else report_page(document, say, ascii=True)


def notebook_text(value: Reported, to: Literal["html", "latex"]) -> str:
    """Return the report of a value as a notebook holds it: between what other cells wrote."""
    document, say = contents_of(value.reported), language(value.language)
    text: str = writer_of(to, "body")(document.seen_by("document"), say)
    return text
