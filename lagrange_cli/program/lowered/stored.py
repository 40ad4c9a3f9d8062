"""Functions as text that a cache keeps: JSON of nested lists, read again when one is asked for.

A list begins with the kind of what it is; an operand that is a name is the name alone.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Constant,
    Element,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.program.lowered.functions import (
    For,
    Function,
    Let,
    LocalArray,
    Remark,
    Require,
    RequireFinite,
    Scope,
    Solve,
    Step,
    Store,
    Total,
)


@dataclass(frozen=True)
class StoredFunctions(Mapping[str, Function]):
    """Functions by name.

    Attributes
    ----------
    text
        The functions as JSON; empty if there are none.
    """

    text: str = ""

    @classmethod
    def from_functions(cls, functions: Mapping[str, Function]) -> StoredFunctions:
        """Store functions by their names."""
        stored = {name: _stored(function) for name, function in functions.items()}
        return cls(json.dumps(stored, separators=(",", ":"))) if stored else cls()

    def __getitem__(self, name: str) -> Function:
        functions = _read_texts(self.text)
        function = functions[name]
        if not isinstance(function, Function):
            function = functions[name] = _function(name, *function)
        return function

    def __iter__(self) -> Iterator[str]:
        return iter(_read_texts(self.text))

    def __len__(self) -> int:
        return len(_read_texts(self.text))


@lru_cache(maxsize=64)
def _read_texts(text: str) -> dict[str, Any]:
    """Return functions by name, as lists until they are asked for."""
    functions: dict[str, Any] = json.loads(text or "{}")
    return functions


# -- written -------------------------------------------------------------------------


def _stored(function: Function) -> list[Any]:
    sizes = (function.shape, function.coordinates, function.parameters, function.driven)
    body = list(map(_step, function.body))
    return [function.kind.name, body, *sizes, function.given_functions, function.states]


def _step(step: Step) -> list[Any]:
    if isinstance(step, Let):
        return ["let", step.name, _operand(step.operand)]
    if isinstance(step, Store):
        return ["store", _operand(step.target), _operand(step.operand)]
    if isinstance(step, For):
        return ["for", _index(step.count), list(map(_step, step.body)), step.independent]
    if isinstance(step, Scope):
        return ["scope", list(map(_step, step.body))]
    if isinstance(step, Remark):
        return ["remark", step.text]
    if isinstance(step, LocalArray):
        return ["array", step.name, step.shape, step.start]
    if isinstance(step, Solve):
        return ["solve", step.routine, step.sizes, list(map(_operand, step.arrays)), step.tables]
    if isinstance(step, Total):
        return ["total", step.count, _operand(step.start)]
    if isinstance(step, Require):
        return ["require", _operand(step.value), _operand(step.bound)]
    return ["finite", step.count]


def _operand(operand: Operand) -> Any:
    if isinstance(operand, Constant):
        return _coefficient(operand.value)
    if isinstance(operand, Element):
        table = [] if operand.table is None else [operand.table]
        return ["at", operand.name, _index(operand.index), *table]
    if isinstance(operand, Variable):
        return operand.name
    if isinstance(operand, Sum):
        return ["+", *((_coefficient(c), _operand(part)) for c, part in operand.terms)]
    if isinstance(operand, Product):
        return [
            "*",
            *(list(map(_operand, part)) for part in (operand.numerator, operand.denominator)),
        ]
    return ["call", operand.function, *map(_operand, operand.arguments)]


def _coefficient(value: Fraction | int) -> Any:
    """Return an integer, or numerator and denominator with what tells them from other lists."""
    numerator, denominator = Fraction(value).as_integer_ratio()
    return numerator if denominator == 1 else ["/", numerator, denominator]


def _index(index: AffineIndex) -> list[int]:
    return [index.base, *index.steps]


# -- read ----------------------------------------------------------------------------


def _function(
    name: str,
    kind: str,
    body: Sequence[Any],
    shape: Sequence[int],
    coordinates: int,
    parameters: int,
    driven: int,
    earlier: Sequence[str],
    states: int,
) -> Function:
    sizes = tuple(shape), coordinates, parameters, driven
    return Function(name, ProgramKind[kind], _read_steps(body), *sizes, tuple(earlier), states)


def _read_steps(body: Sequence[Any]) -> tuple[Step, ...]:
    return tuple(_read_step(*step) for step in body)


def _read_step(kind: str, *parts: Any) -> Step:
    if kind == "let":
        return Let(parts[0], _read_operand(parts[1]))
    if kind == "store":
        return Store(_element(parts[0]), _read_operand(parts[1]))
    if kind == "for":
        return For(_read_index(parts[0]), _read_steps(parts[1]), parts[2])
    if kind == "scope":
        return Scope(_read_steps(parts[0]))
    if kind == "remark":
        return Remark(parts[0])
    if kind == "array":
        return LocalArray(parts[0], tuple(parts[1]), parts[2])
    if kind == "solve":
        routine, sizes, arrays, tables = parts
        elements = tuple(map(_element, arrays))
        return Solve(routine, tuple(sizes), elements, tuple(map(tuple, tables)))
    if kind == "total":
        return Total(parts[0], _element(parts[1]))
    if kind == "require":
        return Require(_read_operand(parts[0]), _read_operand(parts[1]))
    assert kind == "finite", kind
    return RequireFinite(parts[0])


def _element(stored: Sequence[Any]) -> Element:
    element = _read_operand(stored)
    assert isinstance(element, Element)
    return element


def _read_operand(stored: Any) -> Operand:
    if isinstance(stored, str):
        return Variable(stored)
    if isinstance(stored, int):
        return Constant(stored)
    kind, *parts = stored
    if kind == "/":
        return Constant(Fraction(*parts))
    if kind == "at":
        table = tuple(parts[2]) if len(parts) > 2 else None
        return Element(parts[0], _read_index(parts[1]), table)
    if kind == "+":
        return Sum(tuple((_number(c), _read_operand(part)) for c, part in parts))
    if kind == "*":
        numerator, denominator = (tuple(map(_read_operand, factors)) for factors in parts)
        return Product(numerator, denominator)
    assert kind == "call", kind
    return FunctionCall(parts[0], tuple(map(_read_operand, parts[1:])))


def _number(stored: Any) -> Fraction | int:
    return stored if isinstance(stored, int) else Fraction(*stored[1:])


def _read_index(stored: Sequence[int]) -> AffineIndex:
    base, *steps = stored
    return AffineIndex(base, tuple(steps))
