"""Functions of one argument whose truth is known: text, value, slope, and what they do.

``U`` stands for the argument and ``W`` for a width in texts. Values and slopes are computed with
mpmath, from formulas of their own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath as mp

__all__ = ["BOUNDED", "CONSTANTS", "JUMPS", "SHAPES", "Shape"]

Number = Any
Function = Callable[[Number, Number], Number]


@dataclass(frozen=True)
class Shape:
    """A function f(U) with f'(U).

    Attributes
    ----------
    constant
        It is the same number everywhere, in disguise.
    jumps
        It has a jump.
    narrow
        It acts within a few W of U = 0.
    shift
        A text for f with its switching surface elsewhere; empty where there is none.
    """

    name: str
    text: str
    slope_text: str
    value: Function
    slope: Function
    constant: bool = False
    jumps: bool = False
    narrow: bool = False


def _step(u: Number) -> Number:
    return mp.mpf(u > 0)


def _zero(u: Number, w: Number) -> Number:
    return mp.mpf(0)


def _one(u: Number, w: Number) -> Number:
    return mp.mpf(1)


KINKED = (
    Shape(
        "stop",
        "max(0, U)^2/2",
        "max(0, U)",
        lambda u, w: max(0, u) ** 2 / 2,
        lambda u, w: max(mp.mpf(0), u),
    ),
    Shape("push", "max(0, U)", "(1 + sign(U))/2", lambda u, w: max(0, u), lambda u, w: _step(u)),
    Shape("pull", "min(0, U)", "(1 - sign(U))/2", lambda u, w: min(0, u), lambda u, w: _step(-u)),
    Shape("bent", "abs(U)", "sign(U)", lambda u, w: abs(u), lambda u, w: mp.sign(u)),
    Shape(
        "cubed",
        "abs(U)^3",
        "3*U*abs(U)",
        lambda u, w: abs(u) ** 3,
        lambda u, w: 3 * u * abs(u),
    ),
    Shape(
        "nested",
        "max(0, abs(U) - 1)",
        "sign(U)*(1 + sign(abs(U) - 1))/2",
        lambda u, w: max(0, abs(u) - 1),
        lambda u, w: mp.sign(u) * _step(abs(u) - 1),
    ),
    Shape(
        "ramp",
        "max(0, min(1, U))",
        "(1 + sign(U))*(1 + sign(1 - U))/4",
        lambda u, w: max(0, min(1, u)),
        lambda u, w: _step(u) * _step(1 - u),
    ),
    Shape(
        "hidden",
        "sqrt(U^2)",
        "U/sqrt(U^2)",
        lambda u, w: abs(u),
        lambda u, w: mp.sign(u),
    ),
    Shape(
        "well hidden",
        "sqrt(U^2 - 2*U + 1)",
        "(U - 1)/sqrt(U^2 - 2*U + 1)",
        lambda u, w: abs(u - 1),
        lambda u, w: mp.sign(u - 1),
    ),
    Shape(
        "triangle",
        "max(0, 1 - abs(U/W))",
        "-sign(U)*(1 + sign(1 - abs(U/W)))/(2*W)",
        lambda u, w: max(0, 1 - abs(u / w)),
        lambda u, w: -mp.sign(u) * _step(1 - abs(u / w)) / w,
        narrow=True,
    ),
)

SMOOTH = (
    Shape("spring", "U^2/2", "U", lambda u, w: u * u / 2, lambda u, w: u),
    Shape("wave", "sin(U)", "cos(U)", lambda u, w: mp.sin(u), lambda u, w: mp.cos(u)),
    Shape(
        "logarithm",
        "log(1 + U^2)",
        "2*U/(1 + U^2)",
        lambda u, w: mp.log(1 + u * u),
        lambda u, w: 2 * u / (1 + u * u),
    ),
    Shape(
        "power",
        "(U/10)^40",
        "4*(U/10)^39",
        lambda u, w: (u / 10) ** 40,
        lambda u, w: 4 * (u / 10) ** 39,
    ),
    Shape(
        "needle",
        "exp(-(U/W)^2)",
        "-2*U/W^2*exp(-(U/W)^2)",
        lambda u, w: mp.exp(-((u / w) ** 2)),
        lambda u, w: -2 * u / w**2 * mp.exp(-((u / w) ** 2)),
        narrow=True,
    ),
    Shape(
        "peak",
        "1/(1 + (U/W)^2)",
        "-2*U/W^2/(1 + (U/W)^2)^2",
        lambda u, w: 1 / (1 + (u / w) ** 2),
        lambda u, w: -2 * u / w**2 / (1 + (u / w) ** 2) ** 2,
        narrow=True,
    ),
    Shape(
        "step",
        "tanh(U/W)",
        "(1 - tanh(U/W)^2)/W",
        lambda u, w: mp.tanh(u / w),
        lambda u, w: mp.sech(u / w) ** 2 / w,
        narrow=True,
    ),
)

JUMPS = (
    Shape("jump", "sign(U)", "0", lambda u, w: mp.sign(u), _zero, jumps=True),
    Shape("quotient", "U/abs(U)", "0", lambda u, w: mp.sign(u), _zero, jumps=True),
    Shape(
        "hidden jump",
        "(U - 1)/sqrt(U^2 - 2*U + 1)",
        "0",
        lambda u, w: mp.sign(u - 1),
        _zero,
        jumps=True,
    ),
)

CONSTANTS = tuple(
    Shape(name, text, "0", value, _zero, constant=True)
    for name, text, value in (
        ("circle", "(cos(U)^2 + sin(U)^2)", _one),
        ("half circle", "(cos(U) - 2*cos(U/2)^2)", lambda u, w: mp.mpf(-1)),
        ("hyperbola", "(cosh(U)^2 - sinh(U)^2)", _one),
        ("exponentials", "exp(U + 1)/exp(U - 1)", lambda u, w: mp.e**2),
        ("square", "((U + 1)^2 - U^2 - 2*U)", _one),
        ("both sides", "(max(0, U) + min(0, U) - U)", _zero),
        ("abs by max", "(abs(U) - max(U, -U))", _zero),
        ("root", "(sqrt(1 + U^2)^2 - U^2)", _one),
        ("tangent", "(1 + tan(U)^2)*cos(U)^2", _one),
    )
)

SHAPES = (*KINKED, *SMOOTH)

#: Between 0 and 1, so that an inertia may be made of them.
BOUNDED = tuple(s for s in SHAPES if s.name in ("ramp", "triangle", "peak"))
