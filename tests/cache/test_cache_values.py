"""Values come back from their bytes as they were, and nothing else can be made of bytes."""

from __future__ import annotations

import os
import pickle
from dataclasses import fields, is_dataclass
from fractions import Fraction
from typing import Any

import pytest
import sympy as sp

from lagrange_cli.cache.values import from_bytes, to_bytes
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.free_symbols import unknown_function
from lagrange_cli.mechanics.stored_derivation import unwritten
from lagrange_cli.scene import read_file
from tests.parts import changed
from tests.systems.shipped import NARROW, SCENES, sliced

X, Y = sp.symbols("x y", real=True)


def tree(value: Any) -> Any:
    """A value as nested tuples, with the class and the arguments of every expression in order."""
    if isinstance(value, sp.Basic):
        if not value.args:
            # Symbols are equal by their assumptions, declared in whatever words.
            return type(value).__name__, value
        return value.func.__name__, *map(tree, value.args)
    if is_dataclass(value):
        return type(value), *(tree(getattr(value, f.name)) for f in fields(value))
    if isinstance(value, dict):
        return tuple((tree(k), tree(v)) for k, v in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(tree, value))
    return type(value), repr(value)


@pytest.mark.parametrize(
    "value",
    [
        sp.Add(Y, X, X, evaluate=False),
        sp.Mul(sp.Rational(1, 2), X, sp.Add(Y, X, evaluate=False), evaluate=False),
        sp.Pow(sp.Integer(4), sp.Rational(1, 2), evaluate=False),
        sp.sin(sp.Integer(0), evaluate=False),
        sp.Piecewise((X, X > 0), (-X, True)),
        unknown_function("V'", X * Y),
        sp.Float("0.1", 40),
        Fraction(1, 3),
        {"a": (1.5, None, frozenset({2}))},
    ],
)
def test_values_come_back_as_they_were(value):
    data = to_bytes(value)
    assert data is not None
    assert tree(from_bytes(data)) == tree(value)


def test_functions_are_no_values():
    assert to_bytes(lambda: 1) is None
    assert to_bytes({"open": os.path.join}) is None


@pytest.mark.parametrize("named", [os.system, eval, pickle.loads, to_bytes])
def test_bytes_that_name_a_function_are_refused(named):
    with pytest.raises(pickle.UnpicklingError, match="no class of a value"):
        from_bytes(pickle.dumps(named))


def test_bytes_that_call_a_function_are_refused():
    class Forged:
        def __reduce__(self):
            return os.system, ("true",)

    with pytest.raises(pickle.UnpicklingError, match="no class of a value"):
        from_bytes(pickle.dumps(Forged()))


def test_too_deep_expressions_are_not_written():
    deep: Any = X
    for _ in range(100_000):
        deep = (deep,)
    assert to_bytes(deep) is None


@pytest.mark.slow
@sliced(SCENES, NARROW)
def test_equations_of_shipped_scenes_come_back_node_by_node(name):
    equations = derive(read_file(str(SCENES[name])))
    parts = changed(equations, textbook=unwritten), equations.derivation.textbook()
    data = to_bytes(parts)
    assert data is not None
    assert tree(from_bytes(data)) == tree(parts)
