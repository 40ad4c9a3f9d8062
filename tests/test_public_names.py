"""Tests go by public names: an underscore says that a name may change without notice."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

TESTS = Path(__file__).parent

#: Names of others that are public in spite of the underscore.
PUBLIC = {"_asdict", "_exit", "_fields", "_fields_", "_replace", "_t"}
PUBLIC |= {"_repr_html_", "_repr_latex_"}


def private_names(tree: ast.Module) -> Iterator[str]:
    """Underscore names of others that a module reads, imports or replaces."""
    own = {node.attr for node in ast.walk(tree) if _is_on_self(node)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.Attribute) and node.attr not in own:
            yield node.attr
        elif isinstance(node, ast.Call) and "attr" in ast.unparse(node.func):
            words = [a.value for a in node.args if isinstance(a, ast.Constant)]
            yield from (word.split(".")[-1] for word in words if isinstance(word, str))


def _is_on_self(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("self", "cls")


@pytest.mark.slow
def test_no_test_reads_a_private_name() -> None:
    for path in TESTS.rglob("*.py"):
        names = private_names(ast.parse(path.read_text(encoding="utf-8")))
        private = {n for n in names if n.startswith("_") and not n.endswith("__")} - PUBLIC
        assert not private, path


def test_private_names_are_found() -> None:
    lines = ("from m import _a", "m._b", "monkeypatch.setattr(m, '_c', 1)", "getattr(m, '_d')")
    for line in lines:
        assert any(name.startswith("_") for name in private_names(ast.parse(line)))
