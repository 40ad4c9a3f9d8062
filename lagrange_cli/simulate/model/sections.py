"""Conditions of Poincaré sections: an equation and inequalities as further outputs of equations.

A condition is written in the scene language: ``theta2 = 0, dot(theta2) > 0``. If its equation is
one between angles it holds modulo whole turns: what is evaluated then is a sine that vanishes at
all of them.
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.scene.language.written_text import INEQUALITIES, WrittenText
from lagrange_cli.simulate.model.written_values import output_names, with_values

if TYPE_CHECKING:
    from sympy import Expr, Rational

    from lagrange_cli.mechanics.equations import Coordinate, Equations

_EXAMPLE = "'theta2 = 0, dot(theta2) > 0'"


class WrittenCondition(WrittenText):
    """A condition of a section as it was written."""

    rule: ClassVar[str] = "section"


def section_outputs(conditions: int, coordinates: int) -> tuple[tuple[str, ...], ...]:
    """Names of outputs: for each condition its value, then the 2n derivatives by the state."""
    return tuple(output_names("section", k, coordinates) for k in range(conditions))


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
    return with_values(equations, "section", [_modulo_turns(equations, equation), *inequalities])


def free_coordinates(equations: Equations, condition: WrittenCondition) -> tuple[str, ...]:
    """Names of the coordinates that the equation of a section does not fix; all if it fixes all."""
    equation, *_ = _read(equations, condition)
    free = [c.name for c in equations.coordinates if c.q not in equation.free_symbols]
    return tuple(free or [c.name for c in equations.coordinates])


def turning_coordinates(equations: Equations) -> tuple[str, ...]:
    """Names of the angles a whole turn of which is proven to leave the equations as they are."""
    return tuple(c.name for c in equations.coordinates if _turns(equations, c))


def _turns(equations: Equations, coordinate: Coordinate) -> bool:
    from lagrange_cli.mechanics.proofs.zero_test import is_periodic

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
    for start, end in condition.parts():
        difference, relation = _relation(equations, condition, start, end)
        if relation == "=":
            _require_section(equations, difference, condition, start, end)
            if equalities:
                message = "a section has one equation; further conditions are inequalities"
                raise condition.refusal(message, start, end, _EXAMPLE)
            equalities.append(difference)
        else:
            inequalities.append(INEQUALITIES[relation] * difference)
    if not equalities:
        whole = 0, len(condition.text)
        raise condition.refusal("a section needs an equation", *whole, _EXAMPLE)
    return [*equalities, *inequalities]


def _relation(
    equations: Equations, condition: WrittenCondition, start: int, end: int
) -> tuple[Expr, str]:
    """Read one part; return left side less right side, and the sign between them."""
    signs = condition.relations(start, end)
    if len(signs) != 1:
        said = "an equation or inequality has one of =, <, <=, >, >="
        raise condition.refusal(said, start, end, _EXAMPLE)
    from lagrange_cli.mechanics.interpretation import value_of

    (sign,) = signs
    if sign[0] != "=" and sign[0] not in INEQUALITIES:
        raise condition.refusal(f"'{sign[0]}' is none of =, <, <=, >, >=", *sign.span())
    left = value_of(equations, condition, start, sign.start())
    return left - value_of(equations, condition, sign.end(), end), sign[0]


def _require_section(
    equations: Equations, difference: Expr, condition: WrittenCondition, start: int, end: int
) -> None:
    """Refuse an equation that holds always or never, or whose sides jump."""
    import sympy

    moving = {equations.t, *(u.symbol for u in equations.inputs)}
    moving |= {symbol for c in equations.coordinates for symbol in (c.q, c.v)}
    if difference.free_symbols.isdisjoint(moving):
        said = "nothing in this equation changes along a motion"
        hint = "a section is a condition on the state or the time"
        raise condition.refusal(said, start, end, hint)
    if difference.has(sympy.sign):
        said = "'sign' jumps past zero, so that this equation need not hold where it changes sides"
        raise condition.refusal(said, start, end, "write its argument: 'x = 0, dot(x) > 0'")
