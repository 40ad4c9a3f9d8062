"""Vocabularies of emitted Python: one text of a function, over numbers, arrays or symbols."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS

#: Functions that NumPy calls otherwise than a program.
_OTHERWISE = {
    **{f"{arc}": f"arc{arc[1:]}" for arc in ("asin", "acos", "atan", "asinh", "acosh", "atanh")},
    "atan2": "arctan2",
    "pow": "power",
    "min": "minimum",
    "max": "maximum",
}


@dataclass(frozen=True)
class Style:
    """Objects that the functions of an emitted module run over: numbers, arrays or symbols.

    Attributes
    ----------
    functions
        Function of a program → text of the callee.
    takes_arrays
        Whether many states at once are handed to the functions of NumPy.
    traced
        Whether functions run over symbols, of which no branch can be asked: what has no result
        is selected at the end.
    """

    functions: Mapping[str, str]
    takes_arrays: bool = False
    traced: bool = False


def array_functions(module: str) -> dict[str, str]:
    """Return function of a program → the function of a module with the names of NumPy."""
    return {name: f"{module}.{_OTHERWISE.get(name, name)}" for name in PROGRAM_FUNCTIONS}


_MATH = {
    **{name: name for name in PROGRAM_FUNCTIONS},
    "sign": "_sign",
    "min": "_min",
    "max": "_max",
}


def many_lines(label: str, parameter: str, few_argument: str = "") -> list[str]:
    """The lines of a function that hand many states to the function of the module for them."""
    passed = ", ".join(argument.split("=")[0] for argument in parameter.split(", "))
    return [
        "    if y.ndim > _AXES:",
        f"        return _of_many({label}, t, y, {passed}{few_argument})",
    ]


#: Numbers, one state at a time: several times faster than NumPy.
NUMBERS = Style(_MATH)

#: The same, and many states at once.
ARRAYS = Style(_MATH, takes_arrays=True)
