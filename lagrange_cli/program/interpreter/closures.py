"""Closures of operations on registers: one for each shape of operands that occurs often.

A register is a place in a list ``r``. Calls cost more than operations, so shapes of several
operations have closures of their own (superinstructions). A shape is written in Polish notation:
``r`` is a register, ``n`` another closure, ``~`` a negation, ``f`` and ``g`` functions of one and
of two arguments.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

#: Function of the registers.
Closure: TypeAlias = Callable[[list[Any]], Any]

#: A register, or an operation with its operands; those of ``f`` and ``g`` follow the function.
Expression: TypeAlias = "int | tuple[Any, ...]"

#: Shape → closure of its registers and closures, from the left.
_CLOSURES: dict[str, Callable[..., Closure]] = {
    "r": lambda a: lambda r: r[a],
    "~r": lambda a: lambda r: -r[a],
    "~n": lambda a: lambda r: -a(r),
    "fr": lambda f, a: lambda r: f(r[a]),
    "fn": lambda f, a: lambda r: f(a(r)),
    "grr": lambda g, a, b: lambda r: g(r[a], r[b]),
    "grn": lambda g, a, b: lambda r: g(r[a], b(r)),
    "gnr": lambda g, a, b: lambda r: g(a(r), r[b]),
    "gnn": lambda g, a, b: lambda r: g(a(r), b(r)),
    "+rr": lambda a, b: lambda r: r[a] + r[b],
    "+rn": lambda a, b: lambda r: r[a] + b(r),
    "+nr": lambda a, b: lambda r: a(r) + r[b],
    "+nn": lambda a, b: lambda r: a(r) + b(r),
    "-rr": lambda a, b: lambda r: r[a] - r[b],
    "-rn": lambda a, b: lambda r: r[a] - b(r),
    "-nr": lambda a, b: lambda r: a(r) - r[b],
    "-nn": lambda a, b: lambda r: a(r) - b(r),
    "*rr": lambda a, b: lambda r: r[a] * r[b],
    "*rn": lambda a, b: lambda r: r[a] * b(r),
    "*nr": lambda a, b: lambda r: a(r) * r[b],
    "*nn": lambda a, b: lambda r: a(r) * b(r),
    "/rr": lambda a, b: lambda r: r[a] / r[b],
    "/rn": lambda a, b: lambda r: r[a] / b(r),
    "/nr": lambda a, b: lambda r: a(r) / r[b],
    "/nn": lambda a, b: lambda r: a(r) / b(r),
    ">rr": lambda a, b: lambda r: r[a] > r[b],
    ">rn": lambda a, b: lambda r: r[a] > b(r),
    ">nr": lambda a, b: lambda r: a(r) > r[b],
    ">nn": lambda a, b: lambda r: a(r) > b(r),
    # The most frequent among the right-hand sides of shipped scenes.
    "**rrr": lambda a, b, c: lambda r: r[a] * r[b] * r[c],
    "***rrrr": lambda a, b, c, d: lambda r: r[a] * r[b] * r[c] * r[d],
    "*r*rr": lambda a, b, c: lambda r: r[a] * (r[b] * r[c]),
    "*r*nr": lambda a, b, c: lambda r: r[a] * (b(r) * r[c]),
    "*r*frr": lambda a, f, b, c: lambda r: r[a] * (f(r[b]) * r[c]),
    "**nrr": lambda a, b, c: lambda r: a(r) * r[b] * r[c],
    "**rnr": lambda a, b, c: lambda r: r[a] * b(r) * r[c],
    "**rrn": lambda a, b, c: lambda r: r[a] * r[b] * c(r),
    "**r*nrr": lambda a, b, c, d: lambda r: r[a] * (b(r) * r[c]) * r[d],
    "*rfr": lambda a, f, b: lambda r: r[a] * f(r[b]),
    "*frr": lambda f, a, b: lambda r: f(r[a]) * r[b],
    "**rfrr": lambda a, f, b, c: lambda r: r[a] * f(r[b]) * r[c],
    "+r*rr": lambda a, b, c: lambda r: r[a] + r[b] * r[c],
    "+n*rr": lambda a, b, c: lambda r: a(r) + r[b] * r[c],
    "+*rrn": lambda a, b, c: lambda r: r[a] * r[b] + c(r),
    "+*rr*rr": lambda a, b, c, d: lambda r: r[a] * r[b] + r[c] * r[d],
    "+r**rrr": lambda a, b, c, d: lambda r: r[a] + r[b] * r[c] * r[d],
    "+n**rrr": lambda a, b, c, d: lambda r: a(r) + r[b] * r[c] * r[d],
    "+**rrrn": lambda a, b, c, d: lambda r: r[a] * r[b] * r[c] + d(r),
    "+**rrr**rrr": lambda a, b, c, d, e, h: lambda r: r[a] * r[b] * r[c] + r[d] * r[e] * r[h],
    "+n*rn": lambda a, b, c: lambda r: a(r) + r[b] * c(r),
    "-r*rr": lambda a, b, c: lambda r: r[a] - r[b] * r[c],
    "-n*rr": lambda a, b, c: lambda r: a(r) - r[b] * r[c],
    "-*rrn": lambda a, b, c: lambda r: r[a] * r[b] - c(r),
    "-*rr*rr": lambda a, b, c, d: lambda r: r[a] * r[b] - r[c] * r[d],
    "-r**rrr": lambda a, b, c, d: lambda r: r[a] - r[b] * r[c] * r[d],
    "-n**rrr": lambda a, b, c, d: lambda r: a(r) - r[b] * r[c] * r[d],
    "*r-rr": lambda a, b, c: lambda r: r[a] * (r[b] - r[c]),
    "*r+rr": lambda a, b, c: lambda r: r[a] * (r[b] + r[c]),
    "*-rrr": lambda a, b, c: lambda r: (r[a] - r[b]) * r[c],
    "*+rrr": lambda a, b, c: lambda r: (r[a] + r[b]) * r[c],
    "*+rnr": lambda a, b, c: lambda r: (r[a] + b(r)) * r[c],
    "*r-nn": lambda a, b, c: lambda r: r[a] * (b(r) - c(r)),
    "*-nnr": lambda a, b, c: lambda r: (a(r) - b(r)) * r[c],
    "*r+r*rr": lambda a, b, c, d: lambda r: r[a] * (r[b] + r[c] * r[d]),
    "*r-r*rr": lambda a, b, c, d: lambda r: r[a] * (r[b] - r[c] * r[d]),
    "~*rr": lambda a, b: lambda r: -r[a] * r[b],
    "~*rn": lambda a, b: lambda r: -r[a] * b(r),
    "~/nr": lambda a, b: lambda r: -a(r) / r[b],
    "~/*rrr": lambda a, b, c: lambda r: -r[a] * r[b] / r[c],
    "~/***rrrrr": lambda a, b, c, d, e: lambda r: -r[a] * r[b] * r[c] * r[d] / r[e],
    "~/**nrrr": lambda a, b, c, d: lambda r: -a(r) * r[b] * r[c] / r[d],
    "~/+*rr*rrr": lambda a, b, c, d, e: lambda r: -(r[a] * r[b] + r[c] * r[d]) / r[e],
    "/*rrr": lambda a, b, c: lambda r: r[a] * r[b] / r[c],
    "/*nrr": lambda a, b, c: lambda r: a(r) * r[b] / r[c],
    "/*rnr": lambda a, b, c: lambda r: r[a] * b(r) / r[c],
    "/**nrrr": lambda a, b, c, d: lambda r: a(r) * r[b] * r[c] / r[d],
    "/***rrrrr": lambda a, b, c, d, e: lambda r: r[a] * r[b] * r[c] * r[d] / r[e],
    "/+*rr*rrr": lambda a, b, c, d, e: lambda r: (r[a] * r[b] + r[c] * r[d]) / r[e],
    "/-n*rrr": lambda a, b, c, d: lambda r: (a(r) - r[b] * r[c]) / r[d],
    "/*r-rrr": lambda a, b, c, d: lambda r: r[a] * (r[b] - r[c]) / r[d],
    "f*rr": lambda f, a, b: lambda r: f(r[a] * r[b]),
    "f-rr": lambda f, a, b: lambda r: f(r[a] - r[b]),
    "f+rr": lambda f, a, b: lambda r: f(r[a] + r[b]),
    "*rf*rr": lambda a, f, b, c: lambda r: r[a] * f(r[b] * r[c]),
    ">*rrr": lambda a, b, c: lambda r: r[a] * r[b] > r[c],
    ">frr": lambda f, a, b: lambda r: f(r[a]) > r[b],
}


def closure(expression: Expression) -> Closure:
    """Return the closure of an expression, of as few calls as the shapes allow."""
    shape, operands = _matched(expression)
    return _CLOSURES[shape](*operands)


def _matched(expression: Expression) -> tuple[str, list[Any]]:
    """Return the largest known shape of an expression, and its operands."""
    if isinstance(expression, int):
        return "r", [expression]
    operation, *operands = expression
    functions = [operands.pop(0)] if operation in "fg" else []
    parts = [_matched(operand) for operand in operands]
    while (shape := operation + "".join(part for part, _ in parts)) not in _CLOSURES:
        # The longest shape becomes a closure of its own.
        k = max(range(len(parts)), key=lambda k: (parts[k][0] != "n", len(parts[k][0])))
        inner, values = parts[k]
        parts[k] = "n", [_CLOSURES[inner](*values)]
    return shape, [*functions, *(value for _, values in parts for value in values)]
