"""Numbers of arrays as text of Python: indices, slices, looks into tables."""

from __future__ import annotations

from math import prod

from lagrange_cli.emit.python.layout import Tables
from lagrange_cli.emit.python.names import SceneNames
from lagrange_cli.emit.python.vocabulary import Vocabulary
from lagrange_cli.program.graph.operands import COUNTED, AffineIndex, Element, Operand
from lagrange_cli.program.lowered.functions import EPSILON, RESULTS
from lagrange_cli.program.printing import Dialect, double_literal, expression_text


class NumberPrinter:
    """Writes the numbers that the statements of one function read and store.

    Attributes
    ----------
    result
        Name of the array of the results.
    shapes
        Array → its shape, as far as statements have made it.
    flat
        Arrays whose numbers are counted by rows, since loops reach them.
    negative_from
        Index from which the numbers of a solution have the other sign.
    counters
        Counters of the loops around the statement.
    members
        Number of members over which slices reach; None outside of them.
    """

    def __init__(
        self, result: str, names: SceneNames, vocabulary: Vocabulary, tables: Tables
    ) -> None:
        self.result = result
        self.names = names
        self.tables = tables
        self.shapes: dict[str, tuple[int, ...]] = {}
        self.flat: set[str] = set()
        self.negative_from: int | None = None
        self.counters: tuple[str, ...] = ()
        self.members: int | None = None
        self.dialect = Dialect(
            double_literal, vocabulary.functions, LocalNames(names), self.element
        )

    def has_rows(self, array: str) -> bool:
        """Tell whether numbers of an array are counted by rows and columns."""
        return array not in self.flat and len(self.shapes.get(array, ())) > 1

    def length(self, array: str) -> int:
        """Count the numbers of an array."""
        return prod(self.shapes.get(array, ()))

    def is_negative(self, array: str, index: int) -> bool:
        """Tell whether a number of a solution has the other sign."""
        return array == "vector" and self.negative_from is not None and index >= self.negative_from

    def text(self, operand: Operand) -> str:
        """Write an operand."""
        return expression_text(operand, self.dialect)

    def local(self, name: str) -> str:
        """Return the name of a variable or an array in the function."""
        return self.result if name == RESULTS else self.names.free(name)

    def array(self, element: Element) -> tuple[str, int]:
        """Return the name of an array in Python, and what is added to its indices."""
        flags, first = len(self.names.flags), len(self.names.fields)
        if element.name != "p" or element.index.base < first:
            return (element.name if element.name in "ypu" else self.local(element.name)), 0
        is_flag = element.index.base < first + flags
        return ("mode", -first) if is_flag else ("targets", -first - flags)

    def element(self, element: Element) -> str:
        """Write a number of an array."""
        if element.name == COUNTED:
            return f"({self.index_sum(element.index)})"
        name, shift = self.array(element)
        index = AffineIndex(element.index.base + shift, element.index.steps)
        if self.has_rows(element.name):
            row, column = divmod(index.base, self.shapes[element.name][1])
            return f"{name}[{row}, {column}]"
        sign = "-" if self.is_negative(element.name, index.base) else ""
        return f"{sign}{name}[{self.index(index, element.table)}]"

    def index(self, index: AffineIndex, table: tuple[int, ...] | None) -> str:
        """Write an index, a slice, or a look into a table."""
        if table is not None:
            looked = self.tables.name(table)
            looked += "" if self.members is not None else f"[{self.counters[-1]}]"
            return f"{looked} + {index.base}" if index.base else looked
        if self.members is None:
            return self.index_sum(index)
        step = index.steps[0] if index.steps else 0
        start, end = index.base, index.base + step * (self.members - 1) + 1
        if step < 0:
            return f"np.arange({start}, {end - 2}, {step})"
        if not step:
            return str(start)
        return f"{start}:{end}" if step == 1 else f"{start}:{end}:{step}"

    def index_sum(self, index: AffineIndex) -> str:
        """base + step*counter + …, without zeros."""
        text = str(index.base) if index.base or not any(index.steps) else ""
        for step, counter in zip(index.steps, self.counters, strict=False):
            if step:
                term = counter if abs(step) == 1 else f"{abs(step)}*{counter}"
                sign = "-" if step < 0 else "+"
                text = f"{text} {sign} {term}" if text else term if step > 0 else f"-{term}"
        return text


class LocalNames(dict[str, str]):
    """Names of variables in a function, those that a program made up included."""

    def __init__(self, names: SceneNames) -> None:
        super().__init__(names.local)
        self.names = names

    def get(self, name: str, default: str | None = None) -> str:  # type: ignore[override]
        known = super().get(name)
        if known is not None:
            return known
        if name == EPSILON:
            return "2.0**-53"
        return name if name == "t" else self.names.free(name)
