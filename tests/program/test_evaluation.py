"""Values of graphs in several arithmetics: beside SymPy's numbers, and products multiplied once."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import mpmath
import pytest
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.equilibria.rest_functions import MANY_DIGITS
from lagrange_cli.analysis.interval_values import (
    BY_ENDS,
    IN_INTERVALS,
    NotEnclosedError,
    enclosed,
    ends,
    interval,
    interval_of_ratio,
)
from lagrange_cli.program.graph.evaluation import Arithmetic, Evaluation
from lagrange_cli.program.graph.value_graph import ValueGraph

X, Y, Z = SYMBOLS = sp.symbols("x y z", positive=True)
EXPRESSIONS = (
    3 + X * Y / 2 - Z,
    X**2 * Y**2 / Z**3,
    1 / X,
    X * Y * sp.sin(Z) + X * Y * sp.cos(Z) / 7,
    sp.sqrt(X) * sp.exp(-Y) * sp.atan2(Y, Z),
    sp.Integer(5),
)
PLACE = {"x": "0.7", "y": "1.3", "z": "2.1"}


def evaluation(*expressions: sp.Expr) -> Evaluation:
    graph = ValueGraph([(s, str(s), 0) for s in SYMBOLS])
    return Evaluation(graph, [graph.convert(sp.sympify(e)) for e in expressions])


def test_values_are_those_of_sympy_to_all_digits() -> None:
    with mpmath.workdps(40):
        point = {name: mpf(x) for name, x in PLACE.items()}
        values = evaluation(*EXPRESSIONS).at(point, MANY_DIGITS)
        exact = {s: sp.Rational(PLACE[str(s)]) for s in SYMBOLS}
        for value, expression in zip(values, EXPRESSIONS, strict=True):
            expected = mpf(sp.N(expression.xreplace(exact), 45))
            assert abs(value - expected) < mpf(10) ** -38


def test_products_that_begin_alike_are_multiplied_once() -> None:
    counted = Counter[str]()

    def multiplied(a: float, b: float) -> float:
        counted["product"] += 1
        return a * b

    def raised(a: float, exponent: int) -> float:
        counted["power"] += 1
        return a**exponent

    products = (X**2 * Y * sp.sin(Z), X**2 * Y * sp.cos(Z), X**2 * Y * sp.sin(Z) * sp.cos(Z))
    arithmetic = Arithmetic({"sin": math.sin, "cos": math.cos}, float, multiply=multiplied)
    arithmetic = replace(arithmetic, power=raised)
    point = {name: float(x) for name, x in PLACE.items()}
    values = evaluation(*products).at(point, arithmetic)
    shared = 0.7**2 * 1.3
    expected = [shared * math.sin(2.1), shared * math.cos(2.1)]
    expected.append(shared * math.sin(2.1) * math.cos(2.1))
    assert values == pytest.approx(expected, rel=1e-15)
    assert counted == {"product": 4, "power": 1}


def test_ends_of_intervals_are_those_of_mpmaths_class() -> None:
    boxes = {name: interval(mpf(x), mpf(x) + mpf("1e-9")) for name, x in PLACE.items()}
    steps = evaluation(*EXPRESSIONS)
    found = enclosed(steps, boxes, BY_ENDS)
    expected = steps.at(boxes, Arithmetic(IN_INTERVALS, interval_of_ratio))
    assert [ends(x) for x in found] == [ends(x) for x in expected]
    with mpmath.workdps(40):
        inside = {name: mpf(x) + mpf("3e-10") for name, x in PLACE.items()}
        for x, value in zip(found, steps.at(inside, MANY_DIGITS), strict=True):
            low, high = ends(x)
            assert low <= value <= high


def test_intervals_that_are_not_real_are_refused() -> None:
    wide = {name: interval(mpf(-1), mpf(1)) for name in PLACE}
    with pytest.raises(NotEnclosedError):
        enclosed(evaluation(sp.sqrt(X)), wide, BY_ENDS)
