"""Functions without a language: what is executed, in an order that each language prints.

A function reads ``t``, the state ``y``, inputs ``u`` and parameters ``p`` and fills the array
``out``. Numbers that it names are assigned once (:class:`Let`); numbers of arrays are stored
(:class:`Store`); families are loops (:class:`For`); systems of equations are solved by routines
that every language has, or borrows from a library (:class:`Solve`). A function ends with its
results, or as singular (:class:`Require`), or without a finite result (:class:`RequireFinite`).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TypeAlias

from lagrange_cli.program.graph.operands import (
    AffineIndex,
    Element,
    Operand,
    variables,
)
from lagrange_cli.program.kinds import ProgramKind
from lagrange_cli.state_layout import StateLayout

#: Array of the results of every function.
RESULTS = "out"

#: Variable that stands for the rounding error of the number type.
EPSILON = "epsilon"


@dataclass(frozen=True, slots=True)
class Let:
    """Name a number: ``name = operand``."""

    name: str
    operand: Operand


@dataclass(frozen=True, slots=True)
class Store:
    """Store a number: ``target = operand``."""

    target: Element
    operand: Operand


@dataclass(frozen=True, slots=True)
class For:
    """Execute statements ``count`` times, with a counter from 0.

    Attributes
    ----------
    count
        Number of repetitions, which may depend on the counters of loops around this one.
    body
        The statements.
    independent
        No repetition reads what another one stores, so that languages of arrays need no loop.
    """

    count: AffineIndex
    body: tuple[Step, ...]
    independent: bool = False


@dataclass(frozen=True, slots=True)
class Scope:
    """Statements whose names are their own."""

    body: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Remark:
    """A comment on the statements that follow."""

    text: str


@dataclass(frozen=True, slots=True)
class LocalArray:
    """An array of the function, whose numbers are undefined until they are stored.

    Attributes
    ----------
    name
        Name of the array; a later one of the same name replaces it.
    shape
        Rows and columns, or the number of its numbers. Indices count by rows.
    start
        Its first number in the workspace, for languages that are handed one.
    """

    name: str
    shape: tuple[int, ...]
    start: int


@dataclass(frozen=True, slots=True)
class Solve:
    """Call a routine that solves equations, and end as singular where it finds no solution.

    Attributes
    ----------
    routine
        A name of :data:`~lagrange_cli.program.lowered.routines.registry.ROUTINES`. ``definite``:
        A x = b with the upper triangle of a positive definite A. ``pivoted``: A x = b with a whole
        A. ``saddle``: [[M, Gᵀ], [G, C]] with the upper triangle of M, the rows of G and the
        diagonal C. ``banded``: a positive definite band, by rows. ``sparse``: supernodes, described
        by ``tables``. ``columns``: a saddle with many right-hand sides, which stand in the columns
        of a matrix.
    sizes
        ``definite`` and ``pivoted``: unknowns; ``saddle``: coordinates and closures; ``banded``:
        unknowns and width; ``sparse``: unknowns and nodes; ``columns``: coordinates, unknowns and
        columns.
    arrays
        First numbers of the matrix and of the right-hand side, which the solution replaces, and
        of the arrays behind them, which the routine overwrites. None of them overlap.
    tables
        Tables of indices.
    """

    routine: str
    sizes: tuple[int, ...]
    arrays: tuple[Element, ...]
    tables: tuple[tuple[int, ...], ...] = ()


@dataclass(frozen=True, slots=True)
class Total:
    """Replace the first of ``count`` numbers by their sum; the others are lost."""

    count: int
    start: Element


@dataclass(frozen=True, slots=True)
class Require:
    """End as singular unless ``value > bound``."""

    value: Operand
    bound: Operand


@dataclass(frozen=True, slots=True)
class RequireFinite:
    """End as not finite unless the first ``count`` results are finite."""

    count: int


Step: TypeAlias = (
    Let | Store | For | Scope | Remark | LocalArray | Solve | Total | Require | RequireFinite
)


@dataclass(frozen=True)
class Function:
    """A function as a language prints it.

    Attributes
    ----------
    name
        Its name in the interface.
    kind
        The quantity that it computes.
    body
        Its statements.
    shape
        Shape of the results, of which indices count by rows; empty for a number.
    coordinates, parameters, driven, states
        Numbers of coordinates, parameters, inputs and states that it is handed.
    given_functions
        Functions to be evaluated first, whose results stand one after the other in the array
        ``given``.
    """

    name: str
    kind: ProgramKind
    body: tuple[Step, ...]
    shape: tuple[int, ...]
    coordinates: int
    parameters: int
    driven: int = 0
    given_functions: tuple[str, ...] = ()
    states: int = 0

    @property
    def layout(self) -> StateLayout:
        """Layout of the state vector that it is handed."""
        return StateLayout(self.coordinates, self.states)


def steps_in(body: Iterable[Step]) -> Iterator[Step]:
    """Yield statements with those of the loops and scopes among them, each before its own."""
    for step in body:
        yield step
        if isinstance(step, For | Scope):
            yield from steps_in(step.body)


def loop_depth(body: Iterable[Step]) -> int:
    """Return the largest number of loops within each other, that of a finite check among them."""
    deepest = 0
    for step in body:
        if isinstance(step, For | Scope):
            deepest = max(deepest, loop_depth(step.body) + isinstance(step, For))
        elif isinstance(step, RequireFinite):
            deepest = max(deepest, 1)
    return deepest


def operands_in(body: Iterable[Step]) -> Iterator[Operand]:
    """Yield the operands that statements evaluate."""
    for step in steps_in(body):
        if isinstance(step, Let | Store):
            yield step.operand
        elif isinstance(step, Require):
            yield step.value
            yield step.bound


def names_read(body: Iterable[Step]) -> frozenset[str]:
    """Return the names that statements read: variables, and arrays of elements."""
    return frozenset(v.name for operand in operands_in(body) for v in variables(operand))


def numbers_read(body: Iterable[Step], array: str) -> list[int]:
    """List the indices at which loops read an array, in ascending order."""
    return sorted(set(_numbers(body, array, ())))


def _numbers(body: Iterable[Step], array: str, counters: tuple[int, ...]) -> Iterator[int]:
    for step in body:
        if isinstance(step, Scope):
            yield from _numbers(step.body, array, counters)
        elif isinstance(step, For):
            if array in names_read(step.body):
                for i in range(step.count.at(counters)):
                    yield from _numbers(step.body, array, (*counters, i))
        elif isinstance(step, Let | Store):
            for leaf in variables(step.operand):
                if isinstance(leaf, Element) and leaf.name == array:
                    behind = leaf.table[counters[-1]] if leaf.table is not None else 0
                    yield leaf.index.at(counters) + behind
