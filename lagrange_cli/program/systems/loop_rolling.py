"""Straight-line statements → nested loops.

Values live in numbered cells of a few arrays. Consecutive statements of one
shape whose cells advance by constant steps become a loop; consecutive loops
whose bounds and cells advance by constant steps become a loop of loops, and so
on (a special case of Ketterlin and Clauss, "Prediction and trace compression
of data access addresses through nested loop recognition", CGO 2008). Whole numbers
in the statements, as the masses below each link of a chain, may advance like cells. The
statements are executed in their order, so that no value changes.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from lagrange_cli.program.graph.operands import (
    COUNTED,
    AffineIndex,
    Cell,
    Coefficient,
    Constant,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
    cell_named,
    magnitude,
    variables,
)

#: Fewer repetitions than this stay written out.
_FEWEST = 4

#: Whole numbers from 2 to this may advance: no type of emitted code rounds them.
_LARGEST_COUNTED = 2**24


@dataclass(frozen=True, slots=True)
class Statement:
    """``target = operand``."""

    target: Cell
    operand: Operand


ArrayAccess: TypeAlias = tuple[str, AffineIndex]
"""An array and an index into it; with :data:`COUNTED` for an array, the index as a number."""


@dataclass(frozen=True, slots=True)
class LoopStatement:
    """A statement within loops.

    ``places``: those of the target and of each variable of ``operand`` from left
    to right (None: a scalar). A number that advances is a variable, :data:`COUNTED`.
    """

    places: tuple[ArrayAccess | None, ...]
    operand: Operand


@dataclass(frozen=True, slots=True)
class LoopNest:
    """Nested loops around statements.

    ``counts``: repetitions of each loop, outermost first.
    """

    counts: tuple[AffineIndex, ...]
    body: tuple[LoopStatement, ...]

    def numbers(self, array: str) -> Iterator[int]:
        """All numbers of an array that are read or written."""
        indices = {
            place[1]
            for statement in self.body
            for place in statement.places
            if place is not None and place[0] == array
        }
        for counters in self._counters(()) if indices else ():
            for index in indices:
                yield index.at(counters)

    def _counters(self, outer: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
        if len(outer) == len(self.counts):
            yield outer
        else:
            for i in range(self.counts[len(outer)].at(outer)):
                yield from self._counters((*outer, i))


@dataclass(frozen=True, slots=True)
class _Run:
    """Statements that form loops.

    Attributes
    ----------
    shape
        Number of the shape of the statements.
    steps
        For each loop, innermost first, what a repetition adds to the numbers that lie within it.
    numbers
        Counts of the loops, outermost first, then indices of the cells.
    first
        The first statement.
    """

    shape: int
    steps: tuple[tuple[int, ...], ...]
    numbers: tuple[int, ...]
    first: Statement


def roll_loops(
    statements: Sequence[Statement],
    locate: Callable[[str], Cell | None],
    independent: bool = False,
) -> list[Statement | LoopNest]:
    """Roll statements of one shape into loops.

    Parameters
    ----------
    locate
        The cell of a variable by its name; None if it is in no array.
    independent
        True if the statements may be executed in any order.
    """
    shapes: dict[Hashable, int] = {}
    runs = [_single(statement, locate, shapes) for statement in statements]
    runs = _settled(runs, independent)
    if independent:
        # Statements that remain of a matrix by rows may roll up by columns.
        runs = _resettled(runs, lambda run: run.numbers[::-1])
        # What no two entries share, as factors of rounding, does not tell which.
        by_values = _resettled(runs, _values_backwards)
        runs = by_values if len(by_values) < len(runs) else runs
    return _paired([_finished(run, locate) for run in runs])


def _single(
    statement: Statement,
    locate: Callable[[str], Cell | None],
    shapes: dict[Hashable, int],
) -> _Run:
    numbers = [statement.target.number]
    shape: list[Hashable] = [statement.target.array]
    stack = [statement.operand]
    while stack:
        operand = stack.pop()
        if isinstance(operand, Variable):
            cell = locate(operand.name)
            shape.append(operand.name if cell is None else f"{cell.array}[]")
            if cell is not None:
                numbers.append(cell.number)
        elif isinstance(operand, Sum):
            shape += [Sum, len(operand.terms)]
            for coefficient, part in operand.terms[::-1]:
                # Coefficients come before their operands.
                shape.append(coefficient < 0)
                stack += [part, Constant(magnitude(coefficient))]
        elif isinstance(operand, Product):
            shape += [Product, len(operand.numerator), len(operand.denominator)]
            stack.extend(operand.denominator[::-1])
            stack.extend(operand.numerator[::-1])
        elif isinstance(operand, FunctionCall):
            shape += [operand.function, len(operand.arguments)]
            stack.extend(operand.arguments[::-1])
        elif _is_counted(operand.value):
            shape.append(COUNTED)
            numbers.append(int(operand.value))
        else:
            shape += [Constant, operand.value]
    number = shapes.setdefault(tuple(shape), len(shapes))
    return _Run(number, (), tuple(numbers), statement)


def _is_counted(value: Coefficient) -> bool:
    """Tell whether a number may advance from statement to statement."""
    return 2 <= value <= _LARGEST_COUNTED and value == int(value)


def _resettled(runs: Sequence[_Run], key: Callable[[_Run], tuple[int, ...]]) -> list[_Run]:
    """Fold statements that are in no loop yet, in another order."""
    loops = [run for run in runs if run.steps]
    return _settled(loops + sorted((run for run in runs if not run.steps), key=key), True)


def _values_backwards(run: _Run) -> tuple[int, ...]:
    """The cells that a single statement reads from right to left, parameters left out."""
    names = (variable.name for variable in variables(run.first.operand))
    cells = [cell for cell in map(cell_named, names) if cell.array != "p"]
    return tuple(cell.number for cell in reversed(cells))


def _settled(runs: list[_Run], independent: bool) -> list[_Run]:
    """Fold runs until nothing changes."""
    while True:
        folded = _folded(_gathered(runs) if independent else runs)
        if len(folded) == len(runs):
            return folded
        runs = folded


def _gathered(runs: Sequence[_Run]) -> list[_Run]:
    """Group runs that could be one run, in the order of the first of each."""
    groups: dict[object, list[_Run]] = {}
    for run in runs:
        groups.setdefault((run.shape, run.steps), []).append(run)
    return [run for group in groups.values() for run in group]


def _folded(runs: Sequence[_Run]) -> list[_Run]:
    """Fold every longest series of runs that advance alike into one run."""
    result = []
    start = 0
    while start < len(runs):
        end = _end_of_series(runs, start)
        run = runs[start]
        if end - start >= _FEWEST:
            step = _step(run, runs[start + 1])
            run = _Run(run.shape, (*run.steps, step), (end - start, *run.numbers), run.first)
            start = end
        else:
            start += 1
        result.append(run)
    return result


def _end_of_series(runs: Sequence[_Run], start: int) -> int:
    first, end = runs[start], start + 1
    step: tuple[int, ...] | None = None
    while end < len(runs) and (runs[end].shape, runs[end].steps) == (first.shape, first.steps):
        advance = _step(runs[end - 1], runs[end])
        if step is not None and advance != step:
            break
        step = advance
        end += 1
    return end


def _step(run: _Run, following: _Run) -> tuple[int, ...]:
    return tuple(b - a for a, b in zip(run.numbers, following.numbers, strict=True))


def _finished(run: _Run, locate: Callable[[str], Cell | None]) -> Statement | LoopNest:
    depth = len(run.steps)
    if not depth:
        return run.first
    # Numbers within the k-th loop from outside are those from k + 1 on.
    affine = [
        AffineIndex(base, tuple(run.steps[depth - 1 - k][n - k - 1] for k in range(min(n, depth))))
        for n, base in enumerate(run.numbers)
    ]
    counting = _Counting(iter(affine[depth:]), locate)
    target = (run.first.target.array, next(counting.indices))
    operand = counting.placed(run.first.operand)
    return LoopNest(tuple(affine[:depth]), (LoopStatement((target, *counting.places), operand),))


@dataclass
class _Counting:
    """Finds the places of an operand within loops, and its numbers that advance.

    Attributes
    ----------
    indices
        Indices of the cells and numbers not met yet, from left to right.
    places
        Places of the variables met, and of numbers that became variables.
    """

    indices: Iterator[AffineIndex]
    locate: Callable[[str], Cell | None]
    places: list[ArrayAccess | None] = field(default_factory=list)

    def placed(self, operand: Operand) -> Operand:
        """Return an operand with variables in the place of numbers that advance."""
        if isinstance(operand, Variable):
            cell = self.locate(operand.name)
            self.places.append(None if cell is None else (cell.array, next(self.indices)))
            return operand
        if isinstance(operand, Constant):
            return self._number(operand)
        if isinstance(operand, Sum):
            return Sum(tuple([self._term(c, part) for c, part in operand.terms]))
        if isinstance(operand, Product):
            numerator = tuple([self.placed(factor) for factor in operand.numerator])
            return Product(numerator, tuple([self.placed(d) for d in operand.denominator]))
        arguments = tuple([self.placed(argument) for argument in operand.arguments])
        return FunctionCall(operand.function, arguments)

    def _number(self, constant: Constant) -> Constant | Variable:
        if not _is_counted(constant.value):
            return constant
        index = next(self.indices)
        if not any(index.steps):
            return constant
        self.places.append((COUNTED, index))
        return Variable(COUNTED)

    def _term(self, coefficient: Coefficient, part: Operand) -> tuple[Coefficient, Operand]:
        number, part = self._number(Constant(magnitude(coefficient))), self.placed(part)
        if isinstance(number, Constant):
            return coefficient, part
        sign = -1 if coefficient < 0 else 1
        if isinstance(part, Product):
            return sign, Product((number, *part.numerator), part.denominator)
        return sign, Product((number, part), ())


def _paired(items: Sequence[Statement | LoopNest]) -> list[Statement | LoopNest]:
    """One loop for the sines and the cosines of the same angles, if it follows at once."""
    result: list[Statement | LoopNest] = []
    for item in items:
        last = result[-1] if result else None
        if isinstance(last, LoopNest) and isinstance(item, LoopNest) and _same_calls(last, item):
            result[-1] = LoopNest(last.counts, last.body + item.body)
        else:
            result.append(item)
    return result


def _same_calls(first: LoopNest, second: LoopNest) -> bool:
    """Tell whether two loops call functions of the same values."""
    a, b = first.body[0], second.body[0]
    return (
        isinstance(a.operand, FunctionCall)
        and isinstance(b.operand, FunctionCall)
        and (first.counts, a.places[1:], a.operand.arguments)
        == (second.counts, b.places[1:], b.operand.arguments)
    )
