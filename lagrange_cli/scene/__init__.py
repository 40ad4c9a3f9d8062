"""YAML text → Scene: source with marks, expression grammar, frozen model.

A file or text goes in; a :class:`~.model.Scene` comes out, checked as a whole, in which every
value has its place in the file, or a refusal with all problems. Nothing here knows SymPy or NumPy.
Read :mod:`.reader` first.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.scene.checks.table import declares
    from lagrange_cli.scene.language.families import read_equation as parse_equation
    from lagrange_cli.scene.language.families import read_expression as parse_expression
    from lagrange_cli.scene.layout import laid_out
    from lagrange_cli.scene.reader import SceneText, expected_error, read_file, read_text

__all__ = [
    "SceneText",
    "declares",
    "expected_error",
    "laid_out",
    "parse_equation",
    "parse_expression",
    "read_file",
    "read_text",
]

_HOMES = {
    "SceneText": "reader.SceneText",
    "declares": "checks.table.declares",
    "expected_error": "reader.expected_error",
    "laid_out": "layout.laid_out",
    "parse_equation": "language.families.read_equation",
    "parse_expression": "language.families.read_expression",
    "read_file": "reader.read_file",
    "read_text": "reader.read_text",
}


def __getattr__(name: str) -> Any:
    """Import what reads YAML when it is used: a simulation out of the cache does without."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    module, _, value = _HOMES[name].rpartition(".")
    return getattr(import_module(f"{__name__}.{module}"), value)
