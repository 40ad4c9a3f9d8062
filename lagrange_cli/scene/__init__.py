"""YAML text → Scene: source with marks, expression grammar, frozen model."""

from lagrange_cli.scene.indices import read_equation as parse_equation
from lagrange_cli.scene.indices import read_expression as parse_expression
from lagrange_cli.scene.reader import expected_error, read_file, read_text

__all__ = ["expected_error", "parse_equation", "parse_expression", "read_file", "read_text"]
