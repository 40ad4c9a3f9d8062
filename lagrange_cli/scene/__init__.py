"""YAML text → Scene: source with marks, expression grammar, frozen model.

What comes in is a file or text; what comes out is a :class:`~.model.Scene`, checked as a whole,
in which every value has its place in the file, or a refusal with all problems. Nothing here knows
SymPy or NumPy. Read :mod:`.reader` first.
"""

from lagrange_cli.scene.checks.table import declares
from lagrange_cli.scene.language.families import read_equation as parse_equation
from lagrange_cli.scene.language.families import read_expression as parse_expression
from lagrange_cli.scene.reader import expected_error, read_file, read_text

__all__ = [
    "declares",
    "expected_error",
    "parse_equation",
    "parse_expression",
    "read_file",
    "read_text",
]
