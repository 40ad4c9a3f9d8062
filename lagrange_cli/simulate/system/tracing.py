"""A model's functions over doubles, and over objects in place of numbers.

Comparisons of right-hand sides tell whether a state has accelerations; objects that stand for all
states answer them as regular states do.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache, lru_cache
from typing import Any

from lagrange_cli.program.interpreter.arithmetic import (
    DOUBLES,
    Arithmetic,
    UnsupportedError,
    digits,
    objects,
)
from lagrange_cli.program.interpreter.interpreter import Runnable, compiled
from lagrange_cli.program.lowered.functions import Function
from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.integrators.right_hand_side import Tracer

#: Why a function cannot be run over objects.
_LOOPS = "its equations are solved by loops over numbers"


class InterpretedFunctions(Mapping[str, Runnable]):
    """Functions of t, y, p and u by name, each made of closures when it is first asked for."""

    def __init__(self, functions: Mapping[str, Function], arithmetic: Arithmetic = DOUBLES) -> None:
        self._functions, self._arithmetic = functions, arithmetic
        self._made: dict[str, Runnable] = {}

    def __getitem__(self, name: str) -> Runnable:
        if name not in self._made:
            function = self._functions[name]
            self._made[name] = compiled(function, self._arithmetic, self._functions)
        return self._made[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._functions)

    def __len__(self) -> int:
        return len(self._functions)


@lru_cache(maxsize=64)
def functions_of(stored: Mapping[str, Function]) -> InterpretedFunctions:
    """Return a model's functions over doubles; those of equal models are made once."""
    return InterpretedFunctions(stored)


def over_objects(stored: Mapping[str, Function], arithmetic: Arithmetic) -> Callable[..., Any]:
    """Make what calls a model's functions by name, over objects in place of numbers.

    Raises
    ------
    UnfitError
        At a call: the function needs more than the arithmetic has.
    """
    functions = InterpretedFunctions(stored, arithmetic)

    def called(name: str, *arguments: Any) -> Any:
        try:
            return functions[name](*arguments)
        except (UnsupportedError, TypeError, AttributeError, ArithmeticError, ValueError) as error:
            raise UnfitError(_LOOPS) from error

    return called


def in_mpmath(
    stored: Mapping[str, Function], name: str
) -> Callable[[Any, Sequence[Any], Sequence[Any]], Any]:
    """Make one of a model's functions of t, y and p, with a single result, run over mpmath.

    Raises
    ------
    UnfitError
        At a call: the function needs more than numbers.
    """
    from mpmath import mp

    called = over_objects(stored, digits(mp))
    return lambda t, y, p: called(name, t, y, p)[0]


@cache
def tracer(stored: Mapping[str, Function], name: str) -> Tracer:
    """Make the function that runs one of a model's functions over objects.

    Parameters
    ----------
    stored
        The functions of a model.
    name
        That of a right-hand side.
    """

    def trace(
        known: Mapping[str, Callable[..., Any]],
        t: Any,
        y: Sequence[Any],
        p: Sequence[Any],
        u: Sequence[Any],
    ) -> Sequence[Any]:
        called = over_objects(stored, objects(known))
        slopes: Sequence[Any] = called(name, t, y, p, u)
        return slopes

    return trace
