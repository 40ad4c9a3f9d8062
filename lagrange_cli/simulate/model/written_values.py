"""Values that options write in the scene language, as further outputs of equations.

Beside each value stand its derivatives by the state, by which errors of a motion become errors of
what is read off it: of crossings of a section, of numbers that a motion is reduced to.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

_OPENING, _CLOSING = "([", ")]"

_RELATION = re.compile(r"[<>=!]+")

#: Sign of left side less right side where an inequality holds.
INEQUALITIES = {">": 1, ">=": 1, "<": -1, "<=": -1}


@dataclass(frozen=True)
class WrittenText:
    """A text over the state of a motion.

    Attributes
    ----------
    text
        The text.
    source
        The option or argument that holds it, as messages name it: ``--section``.
    """

    text: str
    source: str

    #: The rule that messages about it name.
    rule: ClassVar[str] = "expression"

    def mark(self, start: int, end: int) -> Mark:
        """Mark a part of the text, without the blanks around it."""
        part = self.text[start:end]
        begin = start + len(part) - len(part.lstrip())
        return Mark(self.source, 1, begin + 1, self.text, max(1, len(part.strip())))

    def refusal(self, message: str, start: int, end: int, hint: str = "") -> InputError:
        """Return the refusal of a part of the text."""
        return InputError(Problem(message, self.mark(start, end), hint, rule=self.rule))

    def parts(self) -> list[tuple[int, int]]:
        """Return the bounds of the parts between commas outside brackets."""
        commas = [k for k, c in enumerate(self.text) if c == "," and not self._depth(0, k)]
        return list(zip([0, *(k + 1 for k in commas)], [*commas, len(self.text)], strict=True))

    def relations(self, start: int, end: int) -> list[re.Match[str]]:
        """Return the signs of relations in a part of the text, outside brackets."""
        signs = _RELATION.finditer(self.text, start, end)
        return [sign for sign in signs if not self._depth(start, sign.start())]

    def _depth(self, start: int, place: int) -> int:
        """Count the brackets that are opened from a start on and not closed at a place."""
        part = self.text[start:place]
        return sum((c in _OPENING) - (c in _CLOSING) for c in part)


def value_of(
    equations: Equations,
    written: WrittenText,
    start: int,
    end: int,
    further: Mapping[str, Expr] = MappingProxyType({}),
) -> Expr:
    """Read a part of a text as an expression over the symbols of the equations.

    Parameters
    ----------
    equations, written
        The equations and the text.
    start, end
        Bounds of the part.
    further
        Names that may be used beside those of the equations.

    Raises
    ------
    InputError
        Located: it is no such expression, or has accelerations or multipliers in it.
    """
    from lagrange_cli.mechanics.interpretation import interpret
    from lagrange_cli.scene.language.families import Budget, written_expression
    from lagrange_cli.scene.language.grammar import parse_expression

    mark, functions = written.mark(start, end), {f.name for f in equations.functions}
    parsed = parse_expression(written.text[start:end].strip(), mark, functions=functions)
    parsed = written_expression(parsed, dict(equations.sizes), Budget())
    value = interpret(equations, parsed, further)
    unknown = {c.a for c in equations.coordinates} | {c.multiplier for c in equations.pushing}
    if not value.free_symbols.isdisjoint(unknown):
        said = "neither accelerations nor multipliers belong to a state"
        raise written.refusal(said, start, end, "write it with coordinates and their dot(...)")
    return value


def output_names(kind: str, number: int, coordinates: int) -> tuple[str, ...]:
    """Names of the outputs of a value: itself, then its 2n derivatives by the state."""
    # No name of a scene has a blank.
    return (f"{kind} {number}", *(f"{kind} {number} by {i}" for i in range(2 * coordinates)))


def with_values(equations: Equations, kind: str, values: Sequence[Expr]) -> Equations:
    """Return equations whose outputs include those of :func:`output_names` for each value."""
    from lagrange_cli.mechanics.algebra.derivatives import derivative

    state = [*(c.q for c in equations.coordinates), *(c.v for c in equations.coordinates)]
    outputs: list[tuple[str, Expr]] = []
    for number, value in enumerate(values):
        names = output_names(kind, number, len(equations.coordinates))
        expressions = [value, *(derivative(value, symbol) for symbol in state)]
        outputs += zip(names, expressions, strict=True)
    return replace(equations, outputs=(*equations.outputs, *outputs))
