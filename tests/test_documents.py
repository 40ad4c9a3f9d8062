"""Documents of shipped scenes are typeset by other programs, which find what is wrong with them."""

from __future__ import annotations

import importlib
from pathlib import Path
from types import ModuleType

import pytest

from lagrange_cli.api.emitters import EMITTERS
from tests.emit.emit_scenes import chain_pendulum

ROOT = Path(__file__).resolve().parents[1]

#: Scenes with contacts, inputs, families, closures, and keys of LaTeX.
SLICE = (
    "contact/bouncing_ball",
    "chains/toda_ring",
    "oscillators/driven_spring",
    "oscillators/calogero_moser",
    "rolling/knife_edge_on_incline",
)


@pytest.fixture
def documents(monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """The command as a module."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return importlib.import_module("documents")


def written(documents: ModuleType, to: str) -> list[object]:
    """All documents of a few scenes in a format."""
    return [
        d
        for name in SLICE
        for path in documents.shipped(name)
        for d in documents.documents(path, to)
    ]


def test_formulas_of_markdown_are_found(documents):
    shown = "\\begin{aligned}\na &= \\text{\\$}\n\\end{aligned}"
    page = f"# A\\$ $x_1$ and\n\n$$\n{shown}\n$$\n\nof $y\\$z$.\n"
    assert documents.formulas(page) == [
        ("x_1", False),
        (shown, True),
        ("y\\$z", False),
    ]


@pytest.mark.slow
def test_katex_renders_every_formula_of_markdown(documents):
    if not documents.has_katex():
        pytest.skip("node does not find katex (npm install --no-save katex)")
    outcome = documents.markdown(written(documents, "markdown"))
    assert outcome.failures == []
    assert int(outcome.counted.split()[0]) > 400


@pytest.mark.slow
def test_long_formulas_of_markdown_stand_in_several_displays(documents):
    """KaTeX expands 1,000 macros in a display."""
    (page,) = EMITTERS["markdown"].emit(chain_pendulum(8), {}).values()
    lines = [formula.count("\n") - 1 for formula, shown in documents.formulas(page) if shown]
    assert max(lines) == 24
    assert sum(lines) > 100
    if documents.has_katex():
        assert documents.refused_by_katex(documents.formulas(page)) == []


def test_katex_refuses_what_is_not_its_language(documents):
    if not documents.has_katex():
        pytest.skip("node does not find katex (npm install --no-save katex)")
    page = "of $x$ and $\\frac{1}$\n\n$$\n\\begin{align} a &= 1 \\end{align}\n$$\n\n$é$\n"
    outcome = documents.markdown([documents.Document("it", page)])
    assert outcome.counted == "4 formulas"
    assert [line.split(":")[0] for line in outcome.failures] == ["it", "it"]


@pytest.mark.slow
def test_the_checker_of_html_finds_no_error(documents):
    if not documents.has_checker():
        pytest.skip("no java, or no checker (npm install --no-save vnu-jar)")
    pages = written(documents, "html")
    assert documents.html(pages).failures == []
    wrong = documents.Document("it", pages[0].text.replace("<main>", "<main><b>"))
    assert documents.html([wrong]).failures
