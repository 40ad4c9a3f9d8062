"""What the helpers of a scene are written out to: expressions and equations over its names."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from lagrange_cli.scene.language.expression import Equation, Expression, Name, Node
from lagrange_cli.scene.language.families import written_equation, written_expression
from lagrange_cli.scene.language.grammar import parse_equation, parse_expression
from lagrange_cli.scene.language.templates import is_template, with_names_of, with_zero_indices
from lagrange_cli.scene.model import Link

if TYPE_CHECKING:
    from lagrange_cli.errors import Mark
    from lagrange_cli.scene.reading.entries import Reading
    from lagrange_cli.scene.reading.source import SourceNode


@dataclass(slots=True)
class HelperTexts:
    """The helpers of a scene that is being read; texts of one shape are parsed once.

    Attributes
    ----------
    parts
        Expressions given to helpers, each with a description of its place.
    links
        The helpers between two bodies.
    """

    parts: list[tuple[Expression, str]] = field(default_factory=list)
    links: list[Link] = field(default_factory=list)
    _templates: dict[str, Node] = field(default_factory=dict)

    def part(self, node: SourceNode, key: str, what: str, reading: Reading) -> Expression | None:
        """An expression that is given to the helper of ``what`` at ``key``."""
        expression = reading.expression(node, f"'{key}' of {what}")
        if expression:
            self.parts.append((expression, what))
        return expression

    def charge(self, terms: int, mark: Mark, reading: Reading) -> None:
        """Count names and numbers that a helper is written out to, before that is done.

        Raises
        ------
        InputError
            All together would be more than a scene may be written out to.
        """
        at = Expression(Name("", (0, 0)), "", mark, exact=False)
        with reading.writing_out(at, 0, ""):
            reading.budget.charge(terms, (0, 0))

    def expression(self, text: str, mark: Mark, reading: Reading) -> Expression:
        """The expression that a helper at ``mark`` stands for."""
        key = with_zero_indices(text)
        if key in self._templates:
            return Expression(with_names_of(self._templates[key], text), text, mark, exact=False)
        functions = reading.functions
        parsed = parse_expression(text, mark, exact=False, limited=False, functions=functions)
        if is_template(parsed.node, text, reading.indices):
            self._templates[key] = parsed.node
        return written_expression(parsed, reading.indices, reading.budget)

    def equation(self, text: str, mark: Mark, reading: Reading) -> Equation:
        """The equation that a helper at ``mark`` stands for."""
        functions = reading.functions
        parsed = parse_equation(text, mark, exact=False, limited=False, functions=functions)
        return written_equation(parsed, reading.indices, reading.budget)
