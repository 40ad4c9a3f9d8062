"""Operands of a program: expressions over names, and walks over them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple, TypeAlias

Coefficient: TypeAlias = int | Fraction
"""An exact number; most are integers, which :class:`int` reckons with many times faster."""


def magnitude(coefficient: Coefficient) -> Coefficient:
    """Return the absolute value."""
    return -coefficient if coefficient < 0 else coefficient


def quotient(dividend: Coefficient, divisor: Coefficient) -> Coefficient:
    """Divide exactly."""
    if divisor in (1, -1):
        return dividend * divisor
    ratio = Fraction(dividend) / divisor
    return ratio.numerator if ratio.denominator == 1 else ratio


@dataclass(frozen=True, slots=True)
class Constant:
    value: Coefficient


class Cell(NamedTuple):
    """A number in an array.

    ``p``, ``t``, ``u``, ``q``, ``v``, ``w`` (workspace) and ``out`` are the arrays of a program of
    loops; ``s`` are those parameters that are flags of contacts and targets of impulses, ``d`` the
    unknowns of a solver and ``o`` results, which copies read.
    """

    array: str
    number: int


@dataclass(frozen=True, slots=True)
class Variable:
    """An input or an assigned name."""

    name: str

    @property
    def cell(self) -> Cell:
        """Return the cell of the name: ``q3`` is number 3 of the positions, ``t`` the time."""
        return cell_named(self.name)


@dataclass(frozen=True, slots=True)
class AffineIndex:
    """base + Σ step · counter, over the counters of the enclosing loops, outermost first."""

    base: int
    steps: tuple[int, ...] = ()

    def at(self, counters: Sequence[int]) -> int:
        # The bound of a loop depends on the counters outside of it alone.
        return self.base + sum(s * c for s, c in zip(self.steps, counters, strict=False))


#: Array of a number that is its index: ``Element(COUNTED, i)`` is i itself.
COUNTED = "#"


@dataclass(frozen=True, slots=True)
class Element(Variable):
    """A number of the array ``name``, in statements that loops may repeat.

    Attributes
    ----------
    index
        Index of the number, to which ``table`` at the innermost counter is added.
    table
        Indices that do not advance evenly; None where they do.
    """

    index: AffineIndex
    table: tuple[int, ...] | None = None


@dataclass(frozen=True, slots=True)
class Sum:
    """Σ coefficient · operand; a constant term has a :class:`Constant` of 1 as operand."""

    terms: tuple[tuple[Coefficient, Operand], ...]


@dataclass(frozen=True, slots=True)
class Product:
    """Product of ``numerator`` over product of ``denominator`` (either may be empty)."""

    numerator: tuple[Operand, ...]
    denominator: tuple[Operand, ...]


@dataclass(frozen=True, slots=True)
class FunctionCall:
    """One of :data:`PROGRAM_FUNCTIONS` of one argument, or of two."""

    function: str
    arguments: tuple[Operand, ...]


#: Functions that a program may call, with the number of arguments each takes.
PROGRAM_FUNCTIONS: dict[str, int] = {
    **dict.fromkeys(("sin", "cos", "tan", "asin", "acos", "atan"), 1),
    **dict.fromkeys(("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"), 1),
    **dict.fromkeys(("exp", "log", "sqrt", "abs", "sign"), 1),
    **dict.fromkeys(("atan2", "pow", "min", "max"), 2),
}

Operand: TypeAlias = Constant | Variable | Sum | Product | FunctionCall


def cell_named(name: str) -> Cell:
    """Return the cell of a variable by its name; the number of ``t`` is 0."""
    return Cell(array_named(name), int(name[1:] or 0))


def array_named(name: str) -> str:
    """Return the array that a variable of that name is in."""
    return name[0]


def variables(*operands: Operand) -> list[Variable]:
    """The variables of operands from left to right, each as often as it stands there."""
    standing: list[Variable] = []
    stack = list(operands[::-1])
    while stack:
        part = stack.pop()
        if isinstance(part, Variable):
            standing.append(part)
        elif isinstance(part, Sum):
            stack.extend([term for _, term in part.terms[::-1]])
        elif isinstance(part, Product):
            stack.extend(part.denominator[::-1])
            stack.extend(part.numerator[::-1])
        elif isinstance(part, FunctionCall):
            stack.extend(part.arguments[::-1])
    return standing


def rebuilt(operand: Operand, change: Callable[[Variable], Operand]) -> Operand:
    """The operand with every variable replaced, from left to right."""
    if isinstance(operand, Variable):
        return change(operand)
    if isinstance(operand, Sum):
        return Sum(tuple((c, rebuilt(part, change)) for c, part in operand.terms))
    if isinstance(operand, Product):
        numerator = tuple(rebuilt(part, change) for part in operand.numerator)
        return Product(numerator, tuple(rebuilt(part, change) for part in operand.denominator))
    if isinstance(operand, FunctionCall):
        return FunctionCall(
            operand.function, tuple(rebuilt(part, change) for part in operand.arguments)
        )
    return operand
