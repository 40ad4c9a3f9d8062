"""Conditions of Poincaré sections: an equation and inequalities as further outputs of equations.

A condition is written in the scene language: ``theta2 = 0, dot(theta2) > 0``. What it compares
becomes outputs of the equations, beside the derivatives of these by the state, by which errors of
a motion become errors of its crossings. If the equation is one between angles it holds modulo
whole turns: what is evaluated then is a sine that vanishes at all of them.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from sympy import Expr, Rational, Symbol

    from lagrange_cli.mechanics.equations import Coordinate, Equations
    from lagrange_cli.scene.language.expression import Expression

_OPENING, _CLOSING = "([", ")]"

_RELATION = re.compile(r"[<>=]+")

#: Sign of what is positive where an inequality holds: left side less right side, or the reverse.
_INEQUALITIES = {">": 1, ">=": 1, "<": -1, "<=": -1}


@dataclass(frozen=True)
class WrittenCondition:
    """A condition of a section as it was written.

    Attributes
    ----------
    text
        The text.
    source
        What holds it, as messages name it: ``--section``.
    """

    text: str
    source: str


def section_outputs(conditions: int, coordinates: int) -> tuple[tuple[str, ...], ...]:
    """Names of outputs: for each condition its value, then the 2n derivatives by the state."""
    # No name of a scene has a blank.
    return tuple(
        (f"section {k}", *(f"section {k} by {i}" for i in range(2 * coordinates)))
        for k in range(conditions)
    )


def with_section(equations: Equations, condition: WrittenCondition) -> Equations:
    """Return equations whose outputs include those of :func:`section_outputs`.

    The first condition is the equation, which holds where its value is zero; inequalities hold
    where theirs are positive.

    Raises
    ------
    InputError
        Located: what is wrong with the condition; or there are contacts.
    """
    if equations.contacts:
        message = "sections of motions with contacts, where velocities jump, are not found"
        raise InputError(Problem(message, hint="--plot-of shows samples", rule="section"))
    equation, *inequalities = _read(equations, condition)
    values = [_modulo_turns(equations, equation), *inequalities]
    state = [*(c.q for c in equations.coordinates), *(c.v for c in equations.coordinates)]
    names = section_outputs(len(values), len(equations.coordinates))
    outputs = [
        (name, expression)
        for group, value in zip(names, values, strict=True)
        for name, expression in zip(group, [value, *_gradient(value, state)], strict=True)
    ]
    return replace(equations, outputs=(*equations.outputs, *outputs))


def _gradient(value: Expr, state: list[Symbol]) -> Iterator[Expr]:
    from lagrange_cli.mechanics.algebra.derivatives import derivative

    yield from (derivative(value, symbol) for symbol in state)


def free_coordinates(equations: Equations, condition: WrittenCondition) -> tuple[str, ...]:
    """Names of the coordinates that the equation of a section does not fix; all if it fixes all."""
    equation, *_ = _read(equations, condition)
    free = [c.name for c in equations.coordinates if c.q not in equation.free_symbols]
    return tuple(free or [c.name for c in equations.coordinates])


def turning_coordinates(equations: Equations) -> tuple[str, ...]:
    """Names of the angles a whole turn of which is proven to leave the equations as they are."""
    return tuple(c.name for c in equations.coordinates if _turns(equations, c))


def _turns(equations: Equations, coordinate: Coordinate) -> bool:
    from lagrange_cli.mechanics.proofs.periods import is_periodic

    everything = (equations.lagrangian, *equations.forcing)
    return coordinate.is_angle and all(is_periodic(e, coordinate.q) for e in everything)


def _modulo_turns(equations: Equations, difference: Expr) -> Expr:
    """Return what vanishes wherever a whole number of turns makes an equation hold.

    If turns of angles change the sides of the equation by numbers, it holds for some choice of the
    turns where their difference is a multiple of the largest number that divides all of these.
    """
    import sympy

    steps: list[Rational] = []
    for c in equations.coordinates:
        if c.q in difference.free_symbols and _turns(equations, c):
            step = sympy.expand(difference.xreplace({c.q: c.q + 2 * sympy.pi}) - difference)
            step = sympy.simplify(step / (2 * sympy.pi))
            if not step.is_Rational:
                return difference
            steps.append(abs(step))
    if not any(steps):
        return difference
    period = 2 * sympy.pi * reduce(lambda a, b: sympy.gcd(a, b), steps)
    return sympy.sin(sympy.pi * difference / period) * period / sympy.pi


# Reading.


def _read(equations: Equations, condition: WrittenCondition) -> list[Expr]:
    """Read a condition: left side less right side of its equation, then what is positive."""
    equalities: list[Expr] = []
    inequalities: list[Expr] = []
    for start, end in _parts(condition.text):
        difference, relation = _relation(equations, condition, start, end)
        mark = _mark(condition, start, end)
        if relation == "=":
            _require_section(equations, difference, mark)
            if equalities:
                message = "a section has one equation; further conditions are inequalities"
                raise _refused(message, mark, "'theta2 = 0, dot(theta2) > 0'")
            equalities.append(difference)
        else:
            inequalities.append(_INEQUALITIES[relation] * difference)
    if not equalities:
        whole = _mark(condition, 0, len(condition.text))
        raise _refused("a section needs an equation", whole, "'theta2 = 0, dot(theta2) > 0'")
    return [*equalities, *inequalities]


def _relation(
    equations: Equations, condition: WrittenCondition, start: int, end: int
) -> tuple[Expr, str]:
    """Read one part; return left side less right side, and the sign between them."""
    text = condition.text
    signs = [m for m in _RELATION.finditer(text, start, end) if not _depth(text, start, m.start())]
    if len(signs) != 1:
        said = "an equation or inequality has one of =, <, <=, >, >="
        raise _refused(said, _mark(condition, start, end), "'theta2 = 0, dot(theta2) > 0'")
    (sign,) = signs
    if sign[0] != "=" and sign[0] not in _INEQUALITIES:
        said = f"'{sign[0]}' is none of =, <, <=, >, >="
        raise _refused(said, _mark(condition, sign.start(), sign.end()))
    left = _side(equations, condition, start, sign.start())
    return left - _side(equations, condition, sign.end(), end), sign[0]


def _side(equations: Equations, condition: WrittenCondition, start: int, end: int) -> Expr:
    """Read a side of a relation over the symbols of the equations."""
    from lagrange_cli.mechanics.interpretation import interpret
    from lagrange_cli.scene.language.families import Budget, written_expression
    from lagrange_cli.scene.language.grammar import parse_expression

    mark, functions = _mark(condition, start, end), {f.name for f in equations.functions}
    text = condition.text[start:end].strip()
    parsed = parse_expression(text, mark, functions=functions)
    parsed = written_expression(parsed, dict(equations.sizes), Budget())
    value = interpret(equations, parsed)
    _require_known_along(equations, value, parsed)
    return value


def _require_known_along(equations: Equations, value: Expr, written: Expression) -> None:
    """Refuse accelerations and multipliers, which states do not hold."""
    unknown = {c.a for c in equations.coordinates} | {c.multiplier for c in equations.pushing}
    if not value.free_symbols.isdisjoint(unknown):
        said = "a section is a set of states: neither accelerations nor multipliers belong to one"
        raise _refused(said, written.mark())


def _require_section(equations: Equations, difference: Expr, mark: Mark) -> None:
    """Refuse an equation that holds always or never, or whose sides jump."""
    import sympy

    moving = {equations.t, *(u.symbol for u in equations.inputs)}
    moving |= {symbol for c in equations.coordinates for symbol in (c.q, c.v)}
    if difference.free_symbols.isdisjoint(moving):
        said = "nothing in this equation changes along a motion"
        raise _refused(said, mark, "a section is a condition on the state or the time")
    if difference.has(sympy.sign):
        said = "'sign' jumps past zero, so that this equation need not hold where it changes sides"
        raise _refused(said, mark, "write its argument: 'x = 0, dot(x) > 0'")


def _refused(message: str, mark: Mark, hint: str = "") -> InputError:
    return InputError(Problem(message, mark, hint, rule="section"))


def _mark(condition: WrittenCondition, start: int, end: int) -> Mark:
    """Mark a part of the text without the blanks around it."""
    part = condition.text[start:end]
    begin = start + len(part) - len(part.lstrip())
    length = max(1, len(part.strip()))
    return Mark(condition.source, 1, begin + 1, condition.text, length)


def _depth(text: str, start: int, place: int) -> int:
    """Count the brackets that are open at a place."""
    part = text[start:place]
    return sum((c in _OPENING) - (c in _CLOSING) for c in part)


def _parts(text: str) -> Iterator[tuple[int, int]]:
    """Yield the bounds of the parts between commas outside brackets."""
    start = 0
    for place, character in enumerate(text):
        if character == "," and _depth(text, start, place) == 0:
            yield start, place
            start = place + 1
    yield start, len(text)
