"""Reductions of a motion to a number: ``max(abs(theta2))``, ``first(abs(theta2) > pi)``.

What is reduced is written in the scene language. It becomes an output of the equations, beside its
derivatives by the state, by which errors of a motion become errors of the number.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations

#: Kind → what its number is.
KINDS = {
    "max": "largest value",
    "min": "least value",
    "mean": "mean over the time",
    "first": "first time at which a condition holds",
}

_CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)

_RELATION = re.compile(r"[<>=!]+")

#: Sign of left side less right side where a condition holds.
_SIGNS = {">": 1, ">=": 1, "<": -1, "<=": -1}

_EXAMPLE = "'max(abs(theta2))', 'mean(energy)', 'first(abs(theta2) > pi)'"


@dataclass(frozen=True)
class Reduction:
    """A number of a motion.

    Attributes
    ----------
    kind
        One of :data:`KINDS`.
    text
        What was written, by which its results are named.
    start, end
        Bounds in it of what is reduced.
    source
        What it was written in, as messages name it.
    """

    kind: str
    text: str
    start: int
    end: int
    source: str

    def mark(self, start: int, end: int) -> Mark:
        """Mark a part of the text, without the blanks around it."""
        part = self.text[start:end]
        begin = start + len(part) - len(part.lstrip())
        return Mark(self.source, 1, begin + 1, self.text, max(1, len(part.strip())))


def read_reduction(text: str, source: str = "--reduce") -> Reduction:
    """Read the kind of a reduction; what is reduced is read with the equations.

    Raises
    ------
    InputError
        Located: there is no such kind.
    """
    called = _CALL.fullmatch(text)
    if called is None or called[1] not in KINDS:
        mark = Mark(source, 1, 1, text, max(1, len(text)))
        hint = "; ".join(f"{kind}(...): {meaning}" for kind, meaning in KINDS.items())
        raise InputError(Problem("this is no reduction", mark, hint, rule="reduce"))
    return Reduction(called[1], text.strip(), *_bounds(text, called), source)


def _bounds(text: str, called: re.Match[str]) -> tuple[int, int]:
    blank = len(text) - len(text.lstrip())
    return called.start(2) - blank, called.end(2) - blank


def reduction_outputs(number: int, coordinates: int) -> tuple[str, ...]:
    """Names of the outputs of a reduction: its value, then the 2n derivatives by the state."""
    # No name of a scene has a blank.
    return (f"reduced {number}", *(f"reduced {number} by {i}" for i in range(2 * coordinates)))


def with_reductions(equations: Equations, reductions: Sequence[Reduction]) -> Equations:
    """Return equations whose outputs include those of :func:`reduction_outputs`.

    What ``first`` asks for holds where its value is positive.

    Raises
    ------
    InputError
        Located: what is reduced is no expression over the state.
    """
    from lagrange_cli.mechanics.algebra.derivatives import derivative

    state = [*(c.q for c in equations.coordinates), *(c.v for c in equations.coordinates)]
    outputs: list[tuple[str, Expr]] = []
    for number, reduction in enumerate(reductions):
        value = _value(equations, reduction)
        expressions = [value, *(derivative(value, symbol) for symbol in state)]
        names = reduction_outputs(number, len(equations.coordinates))
        outputs += zip(names, expressions, strict=True)
    return replace(equations, outputs=(*equations.outputs, *outputs))


def _value(equations: Equations, reduction: Reduction) -> Expr:
    if reduction.kind != "first":
        return _expression(equations, reduction, reduction.start, reduction.end)
    signs = [
        found
        for found in _RELATION.finditer(reduction.text, reduction.start, reduction.end)
        if _depth(reduction.text[reduction.start : found.start()]) == 0
    ]
    if len(signs) != 1 or signs[0][0] not in _SIGNS:
        mark = reduction.mark(reduction.start, reduction.end)
        message = "a condition has one of <, <=, >, >="
        raise InputError(Problem(message, mark, _EXAMPLE, rule="reduce"))
    (sign,) = signs
    left = _expression(equations, reduction, reduction.start, sign.start())
    return _SIGNS[sign[0]] * (left - _expression(equations, reduction, sign.end(), reduction.end))


def _depth(text: str) -> int:
    """Count the brackets that are open at the end of a text."""
    return sum((c in "([") - (c in ")]") for c in text)


def _expression(equations: Equations, reduction: Reduction, start: int, end: int) -> Expr:
    from lagrange_cli.mechanics.interpretation import interpret
    from lagrange_cli.scene.language.families import Budget, written_expression
    from lagrange_cli.scene.language.grammar import parse_expression

    mark, functions = reduction.mark(start, end), {f.name for f in equations.functions}
    parsed = parse_expression(reduction.text[start:end].strip(), mark, functions=functions)
    parsed = written_expression(parsed, dict(equations.sizes), Budget())
    further = {**dict(equations.outputs), "energy": equations.energy}
    value = interpret(equations, parsed, further)
    unknown = {c.a for c in equations.coordinates} | {c.multiplier for c in equations.pushing}
    if not value.free_symbols.isdisjoint(unknown):
        said = "neither accelerations nor multipliers are kept along a motion"
        raise InputError(Problem(said, mark, "reduce what a state holds", rule="reduce"))
    return value
