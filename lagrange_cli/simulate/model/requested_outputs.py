"""Outputs that options request beside those of the scene: momenta, reductions, sections.

A reduction is a number of a motion: ``max(abs(theta2))``, ``first(abs(theta2) > pi)``. A Poincaré
section has a condition: ``theta2 = 0, dot(theta2) > 0``. Both are written in the scene language and
become outputs of the equations. Beside each value stand its derivatives by the state, by which
errors of a motion become errors of the value.

If the equation of a section is one between angles it holds modulo whole turns: its output then is
a sine that vanishes at all of them.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from importlib import import_module
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.errors import InputError, Problem, nearest
from lagrange_cli.scene.language.written_text import INEQUALITIES, WrittenText

if TYPE_CHECKING:
    from sympy import Expr, Rational, Symbol

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate


#: Name → function that adds its outputs, as ``module:function``, in this order. The functions need
#: the coordinates of the scene.
FURTHER: Mapping[str, str] = {
    "momenta": "lagrange_cli.analysis.forms.momenta:with_momenta",
    "conserved": "lagrange_cli.analysis.symmetries.conserved_quantities:with_constants_of_motion",
}


def with_further_outputs(equations: Equations, names: Collection[str]) -> Equations:
    """Add the outputs of these names to those of the scene.

    Raises
    ------
    InputError
        There is none of a name.
    """
    for name in names:
        if name not in FURTHER:
            hint = nearest(name, FURTHER) or f"there are {', '.join(FURTHER)}"
            raise InputError(Problem(f"no further columns are '{name}'", hint=hint, rule="extra"))
    for name, place in FURTHER.items():
        if name in names:
            module, function = place.split(":")
            equations = getattr(import_module(module), function)(equations)
    return equations


def output_names(kind: str, number: int, size: int) -> tuple[str, ...]:
    """Name the outputs of a value: itself, then its derivatives by the ``size`` numbers of y."""
    # No name of a scene has a blank.
    return (f"{kind} {number}", *(f"{kind} {number} by {i}" for i in range(size)))


def with_values(equations: Equations, kind: str, values: Sequence[Expr]) -> Equations:
    """Return equations whose outputs include those of :func:`output_names` for each value."""
    from lagrange_cli.mechanics.algebra.derivatives import derivative
    from lagrange_cli.mechanics.symbols.inputs import closed_loop

    equations = closed_loop(equations)
    state = equations.system.state_symbols
    outputs: list[tuple[str, Expr]] = []
    for number, value in enumerate(values):
        names = output_names(kind, number, len(state))
        expressions = [value, *(derivative(value, symbol) for symbol in state)]
        outputs += zip(names, expressions, strict=True)
    return replace(
        equations, system=replace(equations.system, outputs=(*equations.system.outputs, *outputs))
    )


#: Kind → what its number is.
KINDS = {
    "max": "largest value",
    "min": "least value",
    "mean": "mean over the time",
    "first": "first time at which a condition holds",
}

_CALL = re.compile(r"\s*([a-z]+)\s*\((.*)\)\s*", re.DOTALL)

_REDUCTIONS = "'max(abs(theta2))', 'mean(energy)', 'first(abs(theta2) > pi)'"


@dataclass(frozen=True)
class Reduction(WrittenText):
    """A number of a motion; its results are named by its text.

    Attributes
    ----------
    kind
        One of :data:`KINDS`.
    start, end
        Bounds in the text of what is reduced.
    """

    kind: str
    start: int
    end: int

    rule: ClassVar[str] = "reduce"


def read_reduction(text: str, source: str = "--reduce") -> Reduction:
    """Read the kind of a reduction; what is reduced is read with the equations.

    Raises
    ------
    InputError
        Located: there is no such kind.
    """
    text = text.strip()
    called = _CALL.fullmatch(text)
    if called is None or called[1] not in KINDS:
        whole = Reduction(text, source, "", 0, len(text))
        hint = "; ".join(f"{kind}(...): {meaning}" for kind, meaning in KINDS.items())
        raise whole.refusal("this is no reduction", whole.start, whole.end, hint)
    return Reduction(text, source, called[1], *called.span(2))


def reduction_outputs(number: int, size: int) -> tuple[str, ...]:
    """Name the outputs of a reduction: its value, then its derivatives by the numbers of y."""
    return output_names("reduced", number, size)


def with_reductions(equations: Equations, reductions: Sequence[Reduction]) -> Equations:
    """Return equations whose outputs include those of :func:`reduction_outputs`.

    The condition of ``first`` holds where its value is positive.

    Raises
    ------
    InputError
        Located: what is reduced is no expression over the state.
    """
    values = [_reduced_value(equations, reduction) for reduction in reductions]
    return with_values(equations, "reduced", values)


def _reduced_value(equations: Equations, reduction: Reduction) -> Expr:
    from lagrange_cli.mechanics.interpretation import value_of

    further = {**dict(equations.system.outputs), "energy": equations.system.energy}
    start, end = reduction.start, reduction.end
    if reduction.kind != "first":
        return value_of(equations, reduction, start, end, further)
    signs = reduction.relations(start, end)
    if len(signs) != 1 or signs[0][0] not in INEQUALITIES:
        raise reduction.refusal("a condition has one of <, <=, >, >=", start, end, _REDUCTIONS)
    (sign,) = signs
    left = value_of(equations, reduction, start, sign.start(), further)
    right = value_of(equations, reduction, sign.end(), end, further)
    return INEQUALITIES[sign[0]] * (left - right)


_SECTION = "'theta2 = 0, dot(theta2) > 0'"


class WrittenCondition(WrittenText):
    """A condition of a section as it was written."""

    rule: ClassVar[str] = "section"


def section_outputs(conditions: int, size: int) -> tuple[tuple[str, ...], ...]:
    """Name the outputs: for each condition its value, then the derivatives by y."""
    return tuple(output_names("section", k, size) for k in range(conditions))


def with_section(equations: Equations, condition: WrittenCondition) -> Equations:
    """Return equations whose outputs include those of :func:`section_outputs`.

    The first condition is the equation, which holds where its value is zero; inequalities hold
    where theirs are positive.

    Raises
    ------
    InputError
        Located: what is wrong with the condition; or there are contacts or controllers.
    """
    if equations.system.controllers:
        message = "sections of motions that controllers sample, whose forces jump, are not found"
        raise InputError(Problem(message, hint="--plot-of shows samples", rule="section"))
    if equations.system.contacts:
        message = "sections of motions with contacts, where velocities jump, are not found"
        raise InputError(Problem(message, hint="--plot-of shows samples", rule="section"))
    equation, *inequalities = _read_condition(equations, condition)
    equation = _modulo_turns(equations, _without_poles(equations, equation))
    return with_values(equations, "section", [equation, *inequalities])


def free_coordinates(equations: Equations, condition: WrittenCondition) -> tuple[str, ...]:
    """List the coordinates that the equation of a section does not fix; all if it fixes all."""
    equation, *_ = _read_condition(equations, condition)
    free = [c.name for c in equations.system.coordinates if c.q not in equation.free_symbols]
    return tuple(free or [c.name for c in equations.system.coordinates])


def turning_coordinates(equations: Equations) -> tuple[str, ...]:
    """List the angles a whole turn of which is proven to leave the equations as they are."""
    return tuple(c.name for c in equations.system.coordinates if _turns(equations, c))


def _turns(equations: Equations, coordinate: Coordinate) -> bool:
    from lagrange_cli.mechanics.proofs.zero_test import is_periodic

    everything = (equations.system.lagrangian, *equations.system.forcing)
    return coordinate.is_angle and all(is_periodic(e, coordinate.q) for e in everything)


def _without_poles(equations: Equations, difference: Expr) -> Expr:
    """Return the numerator of a fraction, which vanishes where the fraction does and has no poles
    beside which that changes its sign; the whole where nothing that moves is below it."""
    import sympy

    moving = _moving(equations)
    tangents = [e for e in difference.atoms(sympy.tan) if not moving.isdisjoint(e.free_symbols)]
    whole = difference.xreplace({e: sympy.sin(e.args[0]) / sympy.cos(e.args[0]) for e in tangents})
    numerator, denominator = sympy.fraction(sympy.together(whole))
    return difference if moving.isdisjoint(denominator.free_symbols) else numerator


def _moving(equations: Equations) -> set[Symbol]:
    """Symbols that change along a motion."""
    moving = {equations.system.t, *(u.symbol for u in equations.system.inputs)}
    return moving | set(equations.system.state_symbols)


def _modulo_turns(equations: Equations, difference: Expr) -> Expr:
    """Return what vanishes wherever a whole number of turns makes an equation hold.

    If turns of angles change the sides of the equation by numbers, it holds for some choice of the
    turns where their difference is a multiple of the largest number that divides all of these.
    """
    import sympy

    steps: list[Rational] = []
    for c in equations.system.coordinates:
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


def _read_condition(equations: Equations, condition: WrittenCondition) -> list[Expr]:
    """Read a condition: left side less right side of its equation, then what is positive."""
    equalities: list[Expr] = []
    inequalities: list[Expr] = []
    for start, end in condition.parts():
        difference, relation = _relation(equations, condition, start, end)
        if relation == "=":
            _require_section(equations, difference, condition, start, end)
            if equalities:
                message = "a section has one equation; further conditions are inequalities"
                raise condition.refusal(message, start, end, _SECTION)
            equalities.append(difference)
        else:
            inequalities.append(INEQUALITIES[relation] * difference)
    if not equalities:
        whole = 0, len(condition.text)
        raise condition.refusal("a section needs an equation", *whole, _SECTION)
    return [*equalities, *inequalities]


def _relation(
    equations: Equations, condition: WrittenCondition, start: int, end: int
) -> tuple[Expr, str]:
    """Read one part; return left side less right side, and the sign between them."""
    signs = condition.relations(start, end)
    if len(signs) != 1:
        said = "an equation or inequality has one of =, <, <=, >, >="
        raise condition.refusal(said, start, end, _SECTION)
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
    from lagrange_cli.mechanics.kinks import JUMPING

    moving = _moving(equations)
    if difference.free_symbols.isdisjoint(moving):
        said = "nothing in this equation changes along a motion"
        hint = "a section is a condition on the state or the time"
        raise condition.refusal(said, start, end, hint)
    if _without_poles(equations, difference).free_symbols.isdisjoint(moving):
        said = (
            "this equation never holds: one side less the other is a fraction with a constant above"
        )
        raise condition.refusal(said, start, end, _SECTION)
    if difference.has(*JUMPING):
        said = "a jump leads past zero, so that this equation need not hold where it changes sides"
        raise condition.refusal(said, start, end, "write its argument: 'x = 0, dot(x) > 0'")
