"""Typst's compiler, from PyPI: whether a document compiles, and what stands on its pages."""

from __future__ import annotations

import os
from types import ModuleType

import pytest


def typst() -> ModuleType:
    """The compiler; a test without it is skipped, except in CI."""
    if os.environ.get("CI") == "true":
        import typst as compiler
    else:
        compiler = pytest.importorskip("typst", reason="typst is not installed (pip install typst)")
    return compiler


def pages(text: str) -> list[str]:
    """Compile a document; return its pages as SVG."""
    compiled = typst().compile(text.encode(), format="svg")
    return [page.decode() for page in (compiled if isinstance(compiled, list) else [compiled])]
