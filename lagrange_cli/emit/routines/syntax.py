"""The syntax of a language, as far as functions and routines share it.

Statements of routines (:mod:`.translation`) are written by these methods alone. Those that are not
abstract are C's, which many languages follow.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from fractions import Fraction
from textwrap import wrap
from typing import ClassVar

from lagrange_cli.emit.routines.signatures import Signature
from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.printing import double_literal


class Syntax(ABC):
    """The syntax of a language.

    Attributes
    ----------
    functions
        Function of a program → text of the callee.
    comment
        Text that begins a comment, which the end of a line ends.
    first
        Index of the first number of an array.
    tab
        Indentation of a level.
    width
        Column before which lines are broken.
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
    #: Routines that functions call, and functions of numbers that routines call.
    routines: set[str]
    numeric: set[str]
    comment = "// "
    first = 0
    tab = "    "
    width = 100
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

    def number(self, value: Coefficient) -> str:
        """Return a literal of double precision."""
        return double_literal(value)

    def callee(self, function: str) -> str:
        """Return the name of a function of numbers."""
        return self.functions.get(function, function)

    def constant(self, name: str, value: float) -> str:
        """Return a constant of routines, which has a name."""
        return self.number(Fraction(value))

    def counted(self, index: str) -> str:
        """Return an integer, which is not negative, as a number; a sum stands in parentheses."""
        return index

    def whole_quotient(self, left: str, right: str) -> str:
        """Return the quotient of two integers without its fraction."""
        return f"{left}/{right}"

    def element_text(self, name: str, index: str) -> str:
        """Return a number of an array, by an index from ``first`` on."""
        return f"{name}[{index}]"

    @abstractmethod
    def store(self, target: str, text: str) -> str:
        """Return the statement that stores a number."""

    def remark(self, text: str) -> str:
        """Return a comment of one line."""
        return f"{self.comment}{text}"

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

    def handed(self, kind: str) -> list[str]:
        """Return the arguments of routines by which they call functions of the scene."""
        raise NotImplementedError

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        """Return lines that store a function of the scene, and the test that it has results.

        The last argument takes them. The time, parameters and inputs are arguments of the routine:
        those of :meth:`handed` for this kind, ``closures``, ``contacts`` or ``motion``.
        """
        raise NotImplementedError

    def called_alone(self, text: str) -> list[str]:
        """Return the lines of a call without a result."""
        return [f"{text};"]

    def broken_head(self, line: str) -> list[str]:
        """Return a head over several lines, of whole arguments, where it is long."""
        whole = line.replace(" ", "\0").replace(",\0", ", ")
        return [text.replace("\0", " ") for text in self.broken(whole)]

    def broken(self, line: str) -> list[str]:
        """Return a statement over several lines where it is long."""
        width = self.width - 3 * len(self.tab)
        lines = wrap(line, width, break_long_words=False, break_on_hyphens=False)
        return [
            ("" if k == 0 else self.tab) + text + (self.continued if k < len(lines) - 1 else "")
            for k, text in enumerate(lines)
        ]
