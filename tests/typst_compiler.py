"""Typst's compiler, from PyPI: whether a document compiles, and what it says."""

from __future__ import annotations

import importlib
import os
import re
from html.parser import HTMLParser
from types import ModuleType

import pytest


def typst() -> ModuleType:
    """The compiler; a test without it is skipped, except in CI."""
    if os.environ.get("CI") == "true":
        return importlib.import_module("typst")
    return pytest.importorskip("typst", reason="typst is not installed (pip install typst)")


def pages(text: str) -> list[str]:
    """Compile a document; return its pages as SVG."""
    compiled = typst().compile(text.encode(), format="svg")
    return [page.decode() for page in (compiled if isinstance(compiled, list) else [compiled])]


class _Text(HTMLParser):
    """The text of a body, its blanks one each."""

    def __init__(self) -> None:
        super().__init__()
        self.parts: list[str] = []

    def handle_data(self, data: str) -> None:
        if self.lasttag != "style":
            self.parts.append(data)


def text_of(document: str) -> str:
    """What a document says."""
    reader = _Text()
    reader.feed(typst().compile(document.encode(), format="html").decode())
    return re.sub(r"\s+", " ", "".join(reader.parts))
