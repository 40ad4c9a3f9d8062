"""The walk over lowered functions that all languages share.

A language is a subclass of :class:`Language` that says how a number, a statement, a loop and a
function are written. Indices count from ``first``; a line that is too long is broken where the
language allows it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from math import prod
from textwrap import wrap
from typing import ClassVar

from lagrange_cli.emit.languages.interface import Interface, is_input
from lagrange_cli.emit.languages.signatures import Signature, signature_of
from lagrange_cli.program.graph.operands import (
    COUNTED,
    PROGRAM_FUNCTIONS,
    AffineIndex,
    Coefficient,
    Element,
    Operand,
)
from lagrange_cli.program.lowered.functions import (
    EPSILON,
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
    names_read,
    operands_in,
    steps_in,
)
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from lagrange_cli.program.printing import Dialect, double_literal, expression_text, functions_in
from lagrange_cli.program.systems.loops import table_name

#: Counters of nested loops, outermost first.
COUNTERS = "ijkl"

#: Letters of inputs → the array that holds them.
ARRAYS = {"p": "p", "u": "u", "q": "y", "v": "y"}


#: Half the distance from 1 to the next number of double precision.
_ROUNDING = Fraction(1, 2**53)


def local_arrays(function: Function) -> dict[str, int]:
    """Return the numbers of each array that a function makes, for the largest of its name."""
    sizes: dict[str, int] = {}
    for step in steps_in(function.body):
        if isinstance(step, LocalArray):
            sizes[step.name] = max(sizes.get(step.name, 0), prod(step.shape))
    return sizes


class Language(ABC):
    """A language that prints lowered functions.

    Attributes
    ----------
    functions
        Function of a program → text of the callee.
    reserved
        Words that identifiers must not be: keywords, and names that the module uses.
    comment
        Text that begins a comment, which the end of a line ends.
    first
        Index of the first number of an array.
    tab
        Indentation of a level.
    width
        Column before which lines are broken.
    inputs_argument
        The argument of so many inputs, with what stands between it and the next one.
    named
        Letters of the inputs of programs that functions name at their beginning.
    continued
        Text at the end of a line that goes on; None where lines may be broken anywhere.
    words
        Words of tests in routines → those of the language.
    whole
        Function of integers → its callee, where that of other numbers is another one.
    augments
        The language has ``x += 1``; else routines say ``x = x + 1``.
    leaving, otherwise, ended
        Lines of routines: the end of a loop, what an ``if`` has else, and the end of either.
    """

    functions: ClassVar[Mapping[str, str]]
    reserved: ClassVar[frozenset[str]]
    comment = "// "
    first = 0
    tab = "    "
    width = 100
    named = "puqv"
    inputs_argument = ""
    continued = ""
    words: ClassVar[Mapping[str, str]] = {
        "and": "&&",
        "or": "||",
        "not": "!",
        "True": "true",
        "False": "false",
    }
    whole: ClassVar[Mapping[str, str]] = {}
    augments = True
    leaving = "break;"
    otherwise = "} else {"
    ended = "}"

    def __init__(self, interface: Interface) -> None:
        self.interface = interface
        names = {**interface.names, EPSILON: self.rounding()}
        self.dialect = Dialect(self.number, self.functions, names, self.element)
        self._level = 0
        #: Arrays that the function has not made yet.
        self._arrays: dict[str, int] = {}
        #: Tables of indices that the functions printed so far look into.
        self.tables: dict[str, tuple[int, ...]] = {}
        #: Routines that they call, and functions of numbers that these call.
        self.routines: set[str] = set()
        self.numeric: set[str] = set()

    # -- what a language says --------------------------------------------------------

    def number(self, value: Coefficient) -> str:
        """Return a literal of double precision."""
        return double_literal(value)

    def rounding(self) -> str:
        """Return half the distance from 1 to the next number."""
        return self.number(_ROUNDING)

    @abstractmethod
    def head(self, function: Function, documentation: str) -> list[str]:
        """Return the lines that begin a function, with its documentation."""

    @abstractmethod
    def foot(self, function: Function) -> list[str]:
        """Return the lines that end a function with its results."""

    @abstractmethod
    def let(self, name: str, text: str) -> str:
        """Return the statement that names a number."""

    @abstractmethod
    def store(self, target: str, text: str) -> str:
        """Return the statement that stores a number."""

    @abstractmethod
    def loop(self, counter: str, count: str) -> tuple[str, str]:
        """Return the lines around the body of a loop over ``counter`` from 0 to below ``count``."""

    @abstractmethod
    def array(self, name: str, size: int) -> list[str]:
        """Return the lines that make a local array of so many numbers."""

    @abstractmethod
    def require(self, test: str) -> list[str]:
        """Return the lines that end a function as singular unless a test holds."""

    @abstractmethod
    def finite(self, count: int) -> list[str]:
        """Return the lines that end a function unless all results are finite."""

    @abstractmethod
    def solve(self, step: Solve) -> list[str]:
        """Return the lines that solve equations, or end the function as singular."""

    def total(self, step: Total) -> list[str]:
        """Return the lines that replace the first of some numbers by their sum."""
        target = Element(step.start.name, step.start.index)
        term = Element(step.start.name, AffineIndex(step.start.index.base + 1, (1,)))
        begins, ends = self.loop(COUNTERS[0], str(step.count - 1))
        self._level += 1
        added = self.store(self.element(target), f"{self.element(target)} + {self.element(term)}")
        self._level -= 1
        return [begins, f"{self.tab}{added}", ends]

    def scope(self) -> tuple[str, str] | None:
        """Return the lines around statements whose names are their own; None if there are none."""
        return "{", "}"

    def counted(self, index: str) -> str:
        """Return an integer as a number."""
        return index

    def element_text(self, name: str, index: str) -> str:
        """Return a number of an array, by an index from ``first`` on."""
        return f"{name}[{index}]"

    # -- what a language says of routines, unless it has solvers of its own -----------

    def routine_head(self, routine: Signature) -> list[str]:
        """Return the lines that begin a routine, with its documentation."""
        raise NotImplementedError

    def routine_foot(self, routine: Signature) -> list[str]:
        """Return the lines that end a routine."""
        return [self.ended]

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        """Return the first assignment of a variable in its block; ``fixed``: the only one."""
        raise NotImplementedError

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        """Return the lines around a loop from ``start`` on to below ``stop``, or the same down."""
        raise NotImplementedError

    def augmented(self, target: str, operator: str, text: str) -> str:
        """Return the statement that changes a number."""
        return f"{target} {operator}= {text};"

    def compared(self, left: str, operator: str, right: str, *, real: bool) -> str:
        """Return a test of two numbers."""
        return f"{left} {self.words.get(operator, operator)} {right}"

    def repeated(self, test: str) -> tuple[str, str]:
        """Return the lines around a loop as long as a test holds."""
        return f"while ({test}) {{", self.ended

    def branch(self, test: str) -> str:
        """Return the line that begins what is done if a test holds."""
        return f"if ({test}) {{"

    def other_branch(self, test: str) -> str:
        """Return the line that begins what is done if no test before and this one holds."""
        return f"}} else if ({test}) {{"

    def returned(self, text: str | None) -> list[str]:
        """Return the lines that end a routine with its result, if it has one."""
        return ["return;" if text is None else f"return {text};"]

    def called(self, routine: Signature, arguments: Sequence[str]) -> tuple[list[str], str]:
        """Return lines that call a routine, if it takes some, and the expression of its result."""
        return [], f"{routine.name}({', '.join(arguments)})"

    def evaluated(self, function: str, y: str, results: str) -> tuple[list[str], str]:
        """Return lines that store a function of closures, and the test that it has results.

        The time, parameters and inputs are arguments of the routine: those of its argument of the
        kind ``closures``.
        """
        return [], f"{function}(t, {y}, p, {results})"

    @property
    def closures_driven(self) -> bool:
        """Tell whether functions of closures read inputs."""
        projection = self.interface.projection
        return projection is not None and projection.driven

    def called_alone(self, text: str) -> list[str]:
        """Return the lines of a call without a result."""
        return [f"{text};"]

    def call_of(self, step: Solve, arrays: Iterable[str], table: str) -> str:
        """Return the call of a routine by its arrays, and by tables as a format writes them."""
        routine = signature_of(ROUTINES[step.routine])
        passed = {
            "int": map(str, step.sizes),
            "reals": iter(arrays),
            "integers": (table.format(self.table(numbers)) for numbers in step.tables),
        }
        arguments = ", ".join(next(passed[argument.kind]) for argument in routine.arguments)
        return f"{routine.name}({arguments})"

    # -- the walk --------------------------------------------------------------------

    def function_lines(self, function: Function, documentation: str) -> list[str]:
        """Return the lines of a function."""
        self._arrays = local_arrays(function)
        lines = [*self.inputs_of(function), *self._all(function.body)]
        return [
            *self.head(function, documentation),
            *(f"{self.tab}{line}".rstrip() for line in lines),
            *self.foot(function),
        ]

    def inputs_of(self, function: Function) -> list[str]:
        """Name the numbers of the state, of the parameters and of the inputs that are read."""
        read = {name for name in names_read(function.body) if is_input(name)}
        return [
            self.let(self.interface.names[f"{letter}{k}"], self.argument(letter, k))
            for letter in self.named
            for k in sorted(int(name[1:]) for name in read if name[0] == letter)
        ]

    def argument(self, letter: str, number: int) -> str:
        """Return the number of the arguments that an input of a program is."""
        before = len(self.interface.coordinates) if letter == "v" else 0
        return self.element_text(ARRAYS[letter], str(number + before + self.first))

    def _all(self, body: Sequence[Step]) -> Iterator[str]:
        for step in body:
            yield from self._lines(step)

    def _lines(self, step: Step) -> list[str]:
        if isinstance(step, Let):
            return self.broken(self.let(step.name, self.text(step.operand)))
        if isinstance(step, Store):
            return self.broken(self.store(self.element(step.target), self.text(step.operand)))
        if isinstance(step, For):
            return self._loop(step)
        if isinstance(step, Scope):
            return self._scope(step)
        if isinstance(step, Remark):
            return [f"{self.comment}{step.text}"]
        if isinstance(step, LocalArray):
            size = self._arrays.pop(step.name, None)
            return [] if size is None else self.array(step.name, size)
        if isinstance(step, Solve):
            self.routines.add(step.routine)
            return self.solve(step)
        if isinstance(step, Total):
            return self.total(step)
        if isinstance(step, Require):
            return self.require(f"{self.text(step.value)} > {self.text(step.bound)}")
        assert isinstance(step, RequireFinite)
        return self.finite(step.count)

    def _loop(self, loop: For) -> list[str]:
        begins, ends = self.loop(COUNTERS[self._level], self._affine(loop.count))
        self._level += 1
        body = [f"{self.tab}{line}" for line in self._all(loop.body)]
        self._level -= 1
        return [begins, *body, ends]

    def _scope(self, step: Scope) -> list[str]:
        around = self.scope()
        body = [*self._all(step.body)]
        return body if around is None else [around[0], *(f"{self.tab}{b}" for b in body), around[1]]

    def text(self, operand: Operand) -> str:
        """Return an expression."""
        return expression_text(operand, self.dialect)

    def element(self, element: Element) -> str:
        """Return a number of an array."""
        index = element.index
        if element.name == COUNTED:
            return self.counted(self._affine(index))
        base = index.base + self.first
        if element.table is None:
            return self.element_text(element.name, self._affine(AffineIndex(base, index.steps)))
        # Tables have no negative numbers, which are no indices everywhere.
        least = min(element.table)
        table = self.table(tuple(number - least for number in element.table))
        counter = self._affine(AffineIndex(self.first, (0,) * (self._level - 1) + (1,)))
        looked = self.element_text(table, counter)
        place = self._affine(AffineIndex(base + least, index.steps))
        return self.element_text(element.name, looked if place == "0" else f"{place}+{looked}")

    def table(self, table: tuple[int, ...]) -> str:
        """Return the name of a table of indices, which the module is to hold."""
        name = table_name("at", table)
        self.tables[name] = table
        return name

    def _affine(self, index: AffineIndex) -> str:
        """base+step*counter+…, without what is zero; what is subtracted stands last, so that no
        part of it is negative."""
        terms = [(index.base, str(abs(index.base)))] if index.base else []
        for step, counter in zip(index.steps, COUNTERS, strict=False):
            if step:
                terms.append((step, counter if abs(step) == 1 else f"{abs(step)}*{counter}"))
        added = "+".join(term for factor, term in terms if factor > 0)
        subtracted = "".join(f"-{term}" for factor, term in terms if factor < 0)
        return added + subtracted or "0"

    def broken(self, line: str) -> list[str]:
        """Return a statement over several lines where it is long."""
        width = self.width - 3 * len(self.tab)
        lines = wrap(line, width, break_long_words=False, break_on_hyphens=False)
        return [
            ("" if k == 0 else self.tab) + text + (self.continued if k < len(lines) - 1 else "")
            for k, text in enumerate(lines)
        ]

    def commented(self, lines: Sequence[str]) -> list[str]:
        """Return lines as comments, wrapped."""
        width = self.width - len(self.comment)
        pieces = [piece for line in lines for piece in (wrap(line, width) or [""])]
        return [f"{self.comment}{piece}".rstrip() for piece in pieces]


def functions_called(language: Language) -> list[str]:
    """Return the functions of numbers that functions and routines printed so far call."""
    projection = language.interface.projection
    inner = () if projection is None else projection.functions
    functions = (function for function, _ in (*language.interface.functions, *inner))
    operands = (operand for function in functions for operand in operands_in(function.body))
    called = functions_in(operands) | language.numeric
    return [name for name in PROGRAM_FUNCTIONS if name in called]


def arguments_read(function: Function) -> set[str]:
    """Return the arguments ``t``, ``y``, ``u`` and ``p`` that a function reads."""
    read = names_read(function.body)
    named = {ARRAYS[name[0]] for name in read if is_input(name)}
    return named | (read & {"t", "y", "u", "p"})
