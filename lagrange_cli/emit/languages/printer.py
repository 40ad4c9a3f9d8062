"""The walk over lowered functions that all languages share.

A language is a subclass of :class:`Language` that says how a number, a statement, a loop and a
function are written. Indices count from ``first``; a line that is too long is broken where the
language allows it.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import accumulate
from math import prod
from textwrap import wrap
from typing import ClassVar

from lagrange_cli.emit.languages.interface import is_input
from lagrange_cli.emit.languages.values import Interface
from lagrange_cli.emit.routines.signatures import signature_of
from lagrange_cli.emit.routines.syntax import Syntax
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
    numbers_read,
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

#: Half the distance from 1 to the next number.
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
    inputs_last
        Functions take inputs behind the parameters.
    renamed
        Function of the scene in routines → its name in the module, where that is another one.
    """

    reserved: ClassVar[frozenset[str]]
    named = "puqvz"
    inputs_argument = ""
    inputs_last: ClassVar[bool] = False
    renamed: ClassVar[Mapping[str, str]] = {"step": "moved"}

    def __init__(self, interface: Interface) -> None:
        self.interface = interface
        flags = 0 if interface.contacts is None else 2 * interface.contacts.count
        names = {
            **interface.names,
            EPSILON: self.rounding(),
            **{
                f"p{len(interface.parameters) + k}": self.element_text("mode", str(k + self.first))
                for k in range(flags)
            },
        }
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

    def is_inner(self, function: Function) -> bool:
        """Tell whether a function is no part of the interface: only others call it."""
        return any(function is inner for inner, _ in self.interface.inner)

    def handed(self, kind: str) -> list[str]:
        if kind == "dynamics":
            return [*self.inputs_handed, "p"]
        mode = ["mode"] if kind == "closures" and self.interface.contacts else []
        return ["p"] if kind == "motion" else ["t", *self.inputs_handed, "p", *mode]

    @property
    def inputs_handed(self) -> list[str]:
        """The argument that functions take for inputs, if there are any."""
        return ["u"] if self.interface.inputs else []

    def passed(self, kind: str, function: str, arguments: Sequence[str]) -> tuple[str, list[str]]:
        """Return the function of the scene that a routine calls, and its arguments but the last."""
        if kind == "motion":
            *moments, mode = arguments
            return self.renamed.get(function, function), [*moments, "p", mode]
        time = "t"
        if kind == "dynamics":
            time, *arguments = arguments
        state, *modes = arguments
        if kind == "closures" and self.interface.contacts:
            function, modes = f"contact_{function}", ["mode"]
        last = ["p", *self.inputs_handed] if self.inputs_last else [*self.inputs_handed, "p"]
        return self.renamed.get(function, function), [time, state, *last, *modes]

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
        read = names_read(function.body) & self.interface.names.keys()
        return [
            self.let(self.interface.names[f"{letter}{k}"], self.argument(letter, k))
            for letter in self.named
            for k in sorted(int(name[1:]) for name in read if name[0] == letter)
        ]

    def reads_parameters(self, function: Function) -> bool:
        """Tell whether loops of a function read the array of the parameters."""
        numbers = numbers_read(function.body, "p") if "p" in names_read(function.body) else []
        return any(number < len(self.interface.parameters) for number in numbers)

    def arguments_read(self, function: Function) -> set[str]:
        """Return the arguments ``t``, ``y``, ``u``, ``p`` and ``mode`` that a function reads."""
        if function.given_functions:
            return {"t", "y", "u", "p"}
        read, parameters = names_read(function.body), len(self.interface.parameters)
        named = {name for name in read if is_input(name)}
        flags = {name for name in named if name[0] == "p" and int(name[1:]) >= parameters}
        arrays = {ARRAYS[name[0]] for name in named - flags} | (read & {"t", "y", "u"})
        arrays |= {"p"} if self.reads_parameters(function) else set()
        numbers = numbers_read(function.body, "p") if "p" in read else []
        has_flags = flags or any(number >= parameters for number in numbers)
        return arrays | ({"mode"} if has_flags else set())

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
        name, index = self._placed(element)
        if name == COUNTED:
            text = self._affine(index)
            return self.counted(text if text.isalnum() else f"({text})")
        base = index.base + self.first
        if element.table is None:
            return self.element_text(name, self._affine(AffineIndex(base, index.steps)))
        # Tables have no negative numbers, which are no indices everywhere.
        least = min(element.table)
        table = self.table(tuple(number - least for number in element.table))
        counter = self._affine(AffineIndex(self.first, (0,) * (self._level - 1) + (1,)))
        looked = self.element_text(table, counter)
        place = self._affine(AffineIndex(base + least, index.steps))
        return self.element_text(name, looked if place == "0" else f"{place}+{looked}")

    def _placed(self, element: Element) -> tuple[str, AffineIndex]:
        """Return array and index of an element: flags of contacts stand behind the parameters."""
        index, first = element.index, len(self.interface.parameters)
        if element.name != "p" or self.interface.contacts is None or index.base < first:
            return element.name, index
        return "mode", AffineIndex(index.base - first, index.steps)

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
    interface = language.interface
    functions = (function for function, _ in (*interface.functions, *interface.inner))
    operands = (operand for function in functions for operand in operands_in(function.body))
    called = functions_in(operands) | language.numeric
    return [name for name in PROGRAM_FUNCTIONS if name in called]


def module_functions(language: Language) -> list[str]:
    """Return the functions of a module, those of the interface first."""
    functions = (*language.interface.functions, *language.interface.inner)
    return ["\n".join(language.function_lines(function, text)) for function, text in functions]
