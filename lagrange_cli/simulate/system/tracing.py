"""A model's right-hand sides run over objects in place of numbers.

The Python text of the model is run (see :class:`.right_hand_side.Expressions`). Its comparisons
tell whether a state has accelerations; objects that stand for all states answer them as regular
states do.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from functools import cache, partial
from types import CodeType, SimpleNamespace
from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import UnfitError
from lagrange_cli.simulate.integrators.right_hand_side import Tracer

#: Functions of :mod:`math` that texts call.
_MATH = ["sin", "cos", "tan", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh"]
_MATH += ["asinh", "acosh", "atanh", "sqrt", "exp", "log", "hypot"]

#: Why a text cannot be run over objects.
_LOOPS = "its equations are solved by loops over numbers"


def _refused(*_: Any, **__: Any) -> Any:
    raise UnfitError(_LOOPS)


def _array(values: Sequence[Any], _: Any) -> Any:
    objects = np.empty(len(values), dtype=object)
    objects[:] = values
    return objects


#: Functions that the text calls, for objects.
_OF_OBJECTS: dict[str, Any] = {
    "np": SimpleNamespace(full=_refused, errstate=lambda **_: nullcontext(), linalg=np.linalg),
    "array": _array,
    "asarray": lambda values, _: list(values),
    "_number": lambda x: x,
    "_numbers": list,
}


def functions_of(code: str) -> dict[str, Any]:
    """Return the functions of a model's code in Python, by name.

    The text is made of names and numbers that the program chose: nothing of a scene is executed.
    """
    functions: dict[str, Any] = {}
    exec(_compiled(code), functions)
    return functions


@cache
def _compiled(code: str) -> CodeType:
    return compile(code, "<model>", "exec")


def over_objects(code: str, known: Mapping[str, Any]) -> Callable[..., Any]:
    """Make what calls a model's functions by name, over objects in place of numbers.

    Parameters
    ----------
    known
        Functions that the text calls, by name.

    Raises
    ------
    UnfitError
        At a call: the function needs more than numbers.
    """
    namespace = functions_of(code)
    namespace |= known
    namespace |= _OF_OBJECTS

    def called(name: str, *arguments: Any) -> Any:
        try:
            return namespace[name](*arguments)
        except (TypeError, AttributeError, KeyError, ValueError) as error:
            raise UnfitError(_LOOPS) from error

    return called


def in_mpmath(code: str, name: str) -> Callable[[Any, Sequence[Any], Sequence[Any]], Any]:
    """Make one of a model's functions of t, y and p, with a single result, run over mpmath.

    Raises
    ------
    UnfitError
        At a call: the function needs more than numbers.
    """
    from mpmath import mp

    return partial(over_objects(code, {word: getattr(mp, word) for word in _MATH}), name)


@cache
def tracer(code: str, name: str) -> Tracer:
    """Make the function that runs one of a model's functions over objects.

    Parameters
    ----------
    code
        The Python text of a model.
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
        namespace = functions_of(code)
        namespace |= known
        namespace |= _OF_OBJECTS | {"_solve_saddle": known["solve"], "_sign": known["sign"]}
        arguments = [lambda *_: u] if len(u) else []
        try:
            return list(namespace[name](t, y, p, *arguments))
        except (TypeError, AttributeError, KeyError) as error:
            raise UnfitError(_LOOPS) from error

    return trace
