"""The walk over lowered functions that all languages share.

A language is a subclass of :class:`Language` that says how a number, a statement, a loop and a
function are written. Indices count from ``first``; a line that is too long is broken where the
language allows it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate
from math import prod
from textwrap import wrap
from typing import ClassVar

from lagrange_cli.emit.languages.interface import Interface, is_input
from lagrange_cli.emit.routines.signatures import signature_of
from lagrange_cli.emit.routines.syntax import Syntax
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.graph.operands import (
    COUNTED,
    PROGRAM_FUNCTIONS,
    AffineIndex,
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
from lagrange_cli.program.printing import Dialect, expression_text, functions_in
from lagrange_cli.program.systems.loops import table_name

#: Counters of nested loops, outermost first.
COUNTERS = "ijkl"

#: Letters of inputs → the array that holds them.
ARRAYS = {"p": "p", "u": "u", "q": "y", "v": "y", "z": "y"}


#: Half the distance from 1 to the next number of double precision.
_ROUNDING = Fraction(1, 2**53)


@dataclass(frozen=True)
class FunctionCalled:
    """A function whose results stand in an array, from ``start`` on, ``size`` of them."""

    function: Function
    start: int
    size: int


def local_arrays(function: Function) -> dict[str, int]:
    """Return the numbers of each array that a function makes, for the largest of its name."""
    sizes: dict[str, int] = {}
    for step in steps_in(function.body):
        if isinstance(step, LocalArray):
            sizes[step.name] = max(sizes.get(step.name, 0), prod(step.shape))
    return sizes


class Language(Syntax):
    """A language that prints lowered functions.

    Attributes
    ----------
    reserved
        Words that identifiers must not be: keywords, and names that the module uses.
    inputs_argument
        The argument of so many inputs, with what stands between it and the next one.
    named
        Letters of the inputs of programs that functions name at their beginning.
    """

    reserved: ClassVar[frozenset[str]]
    named = "puqvz"
    inputs_argument = ""

    def __init__(self, interface: Interface) -> None:
        self.interface = interface
        names = {**interface.names, EPSILON: self.rounding()}
        self.dialect = Dialect(self.number, self.functions, names, self.element)
        self._level = 0
        #: Arrays that the function has not made yet.
        self._arrays: dict[str, int] = {}
        #: Tables of indices that the functions printed so far look into.
        self.tables: dict[str, tuple[int, ...]] = {}
        self.routines = set()
        self.numeric = set()

    # -- what a language says --------------------------------------------------------

    def constant(self, name: str, value: float) -> str:
        return self.rounding() if name == EPSILON.upper() else super().constant(name, value)

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

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        """Return the lines that make the array ``given`` of the results of functions."""
        raise NotImplementedError

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

    @property
    def closures_driven(self) -> bool:
        """Tell whether functions of closures read inputs."""
        projection = self.interface.projection
        return projection is not None and projection.driven

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
        lines = [*self._given(function), *self.inputs_of(function), *self._all(function.body)]
        return [
            *self.head(function, documentation),
            *(f"{self.tab}{line}".rstrip() for line in lines),
            *self.foot(function),
        ]

    def _given(self, function: Function) -> list[str]:
        """Evaluate the functions that give accelerations and multipliers, where these are read."""
        calls = self.functions_called_by(function)
        return self.call_results(calls) if calls else []

    def functions_called_by(self, function: Function) -> list[FunctionCalled]:
        """Return the functions that are evaluated first, with their places in ``given``."""
        listed = {each.name: each for each, _ in self.interface.functions}
        called = [listed[name] for name in function.given_functions]
        sizes = [prod(each.shape) for each in called]
        return list(map(FunctionCalled, called, accumulate(sizes, initial=0), sizes))

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
        array = ARRAYS[letter]
        place = self.interface.layout.place(letter, number) if array == "y" else number
        return self.element_text(array, str(place + self.first))

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
            return [self.remark(step.text)]
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
            text = self._affine(index)
            return self.counted(text if text.isalnum() else f"({text})")
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
    if function.given_functions:
        return {"t", "y", "u", "p"}
    read = names_read(function.body)
    named = {ARRAYS[name[0]] for name in read if is_input(name)}
    return named | (read & {"t", "y", "u", "p"})


def module_functions(language: Language) -> list[str]:
    """Return the functions of a module, those that the projection onto closures calls last."""
    projection = language.interface.projection
    inner = () if projection is None else projection.functions
    functions = (*language.interface.functions, *inner)
    return ["\n".join(language.function_lines(function, text)) for function, text in functions]


def projection_text(language: Language, folder: str, name: str, positions: str) -> str:
    """Return the function ``project`` from its templates; nothing of scenes without closures."""
    projection = language.interface.projection
    if projection is None:
        return ""
    language.routines |= {"lead_velocities", "is_near"}
    if projection.positions:
        language.routines.add("lead_positions")
    size, driven = len(language.interface.inputs), projection.driven
    leading = template(folder, positions).rstrip() if projection.positions else ""
    replacements = {
        "@POSITIONS@": leading,
        "@M@": str(projection.positions),
        "@CLOSURES@": str(projection.closures),
        "@INPUTS@": language.inputs_argument.format(size) if driven else "",
        "@U@": "u, " if driven else "",
        "@STATES@": "2 * N + M" if language.interface.states else "2 * N",
    }
    return filled(template(folder, name), replacements)
