"""Initial states: values as people write them, steps of tables, words on violated closures."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import comment_text
from lagrange_cli.errors import InputError, Problem

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Closure, Parameter

#: Intervals between the rows that an emitted program prints.
ROWS = 500

#: Steps from one row to the next where the scene gives no step.
_STEPS_PER_ROW = 20

#: Most steps between two rows that an emitted program prints: a C int holds them.
_MOST_STEPS = 1_000_000_000

#: Angles are multiples of π over a number up to this one, if they are so to the last digit.
_LARGEST_DENOMINATOR = 24


def multiple_of_pi(value: float) -> Expr | None:
    """Return an angle that is a simple fraction of π as that; None for others."""
    import sympy

    if not math.isfinite(value):
        return None
    near = Fraction(value / math.pi).limit_denominator(_LARGEST_DENOMINATOR)
    exact = near.numerator * math.pi / near.denominator
    if value == 0 or not math.isclose(exact, value, rel_tol=4e-16):
        return None
    return sympy.Rational(near.numerator, near.denominator) * sympy.pi


def exact_value(parameter: Parameter) -> Expr | None:
    """A parameter's value if it is a simple fraction of π; None of others, which are decimals."""
    import sympy

    ratio = sympy.Integer(0) if parameter.exact is None else parameter.exact / sympy.pi
    simple = ratio.is_Rational and ratio != 0 and ratio.q <= _LARGEST_DENOMINATOR
    return parameter.exact if simple else None


def steps_per_row(equations: Equations) -> int:
    """Return the steps between two rows of a table, by the scene's step if it gives one."""
    defaults = equations.system.simulate
    if not defaults.step:
        return _STEPS_PER_ROW
    until = defaults.start + 10.0 if defaults.until is None else defaults.until
    return max(1, round(min((until - defaults.start) / ROWS / defaults.step, _MOST_STEPS)))


def require_a_program(equations: Equations) -> None:
    """Refuse a program that would integrate the motion where nothing can move, or where controllers
    sample it, which the program would not."""
    if equations.system.controllers:
        problem = "the program of --main does not sample the motion: its inputs would stay 0"
        hint = "leave out --main, and set the inputs where the functions are called"
        raise InputError(Problem(problem, hint=hint, rule="controllers"))
    if not equations.system.coordinates:
        problem = f"nothing can move: '{equations.presentation.name}' has no degrees of freedom"
        hint = "leave out --main, which would integrate the motion"
        raise InputError(Problem(problem, hint=hint, rule="nothing-moves"))


def residual_labels(equations: Equations) -> list[str]:
    """Name each residual of the function ``constraints`` for messages."""
    closures = [
        *equations.system.closures,
        *(contact.closure for contact in equations.system.contacts),
    ]
    positions = [c for c in closures if c.kind == "position"]
    starts = ", ".join(_start_names(equations))
    return [
        *(_position_label(c, starts) for c in positions),
        *(comment_text(c.name if c.kind == "velocity" else f"rate of {c.name}") for c in closures),
    ]


def _position_label(closure: Closure, starts: str) -> str:
    name = comment_text(closure.name)
    if not closure.integral:
        return name
    return f"{name}: its constant is that of the start{starts and f', {starts}'}"


def _start_names(equations: Equations) -> list[str]:
    """Return names of the parameters that are starts, in constants of integration."""
    return [comment_text(p.name) for p in equations.system.parameters if p.start_of is not None]


def rates_note(equations: Equations) -> list[str]:
    """Return lines that say which closures hold for one constant of integration only."""
    names = [comment_text(c.name) for c in equations.system.closures if c.integral]
    if not names:
        return []
    starts = ", ".join(_start_names(equations)) or "of 'initial'"
    return [
        "The scene states the rates of these closures; the constants of their integrals are",
        f"those of the start that the parameters {starts} say: {', '.join(names)}",
    ]
