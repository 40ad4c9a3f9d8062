"""The values of a program as power series in time: recurrences for their coefficients.

Sums and constant factors act on coefficients one by one. For products, quotients and functions
there are recurrences, for which their operands are kept as rows of coefficients; what stands in
a sum needs no row of its own. Statements are text of C: ``c[i]`` is the first coefficient of row
i, ``now[i]`` the one that is being found, number ``k``, and ``part`` is 1/k. A sum of products of
coefficients j and k - j, without the ends, has a name: all of them can be found first, side by
side, since they need no coefficient number k.

References
----------
Moore, *Interval Analysis*, 1966, chapter 11; Jorba, Zou, *Experiment. Math.* 14 (2005) 99.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field

from lagrange_cli.program.graph.operands import (
    Coefficient,
    Constant,
    FunctionCall,
    Operand,
    Product,
    Sum,
    Variable,
)
from lagrange_cli.state_layout import StateLayout

#: Functions of constants and of the first coefficient.
_EACH = {name: f"lagrange_each_{name}" for name in ("sin", "cos", "sqrt", "exp")}

#: Texts of constants that differ from motion to motion.
_OF_LANES = re.compile(r"\b(?:p\[|k\d|zero\b)")

#: Array of the first coefficients of all rows.
FIRST = "c"

#: Array of the coefficients that are being found.
NOW = "now"


class NoSeriesError(Exception):
    """Something has no recurrence here."""


@dataclass(frozen=True)
class SeriesTerm:
    """``scale`` (text; "" is 1) times a row, or times the product of two rows."""

    scale: str
    rows: tuple[int, ...]


@dataclass(frozen=True)
class SeriesSum:
    """A sum of terms and of a ``constant`` (text; "" is 0)."""

    constant: str
    terms: tuple[SeriesTerm, ...] = ()


@dataclass(frozen=True)
class Recurrence:
    """Statements that find coefficients of rows.

    Attributes
    ----------
    rows
        The rows whose coefficients they find.
    first, further
        Statements for the first coefficient, and for each further one.
    needs
        Rows that ``further`` reads.
    """

    rows: tuple[int, ...]
    first: tuple[str, ...]
    further: tuple[str, ...]
    needs: tuple[int, ...]


@dataclass
class Recurrences:
    """Rows and constants as they are found to be needed; the first rows are the state.

    Attributes
    ----------
    literal
        Prints an exact number as a constant of the language.
    layout
        Layout of the state.
    rows
        Number of rows so far.
    constants
        Texts of constants that have a name.
    sums
        Pairs of rows whose sum of products has a name.
    steps
        Recurrences in the order in which they are to be evaluated.
    known
        Variable of the program → its series.
    made
        Key of an operation → row that holds its result.
    """

    literal: Callable[[Coefficient], str]
    layout: StateLayout
    rows: int
    constants: list[str] = field(default_factory=list)
    sums: list[tuple[int, int]] = field(default_factory=list)
    steps: list[Recurrence] = field(default_factory=list)
    known: dict[str, SeriesSum] = field(default_factory=dict)
    made: dict[object, int] = field(default_factory=dict)

    # Constants.

    def constant(self, text: str) -> str:
        """Name the value of a text that holds no series."""
        if not _OF_LANES.search(text):
            return f"({text})"
        if text not in self.constants:
            self.constants.append(text)
        return f"k{self.constants.index(text)}"

    def scaled(self, series: SeriesSum, scale: str) -> SeriesSum:
        """Multiply a series by a constant."""
        if not scale:
            return series
        constant = self._times(series.constant, scale) if series.constant else ""
        terms = (SeriesTerm(self._times(term.scale, scale), term.rows) for term in series.terms)
        return SeriesSum(constant, tuple(terms))

    def _times(self, left: str, right: str) -> str:
        return self.constant(f"{left}*{right}") if left and right else left or right

    def number(self, value: Coefficient) -> str:
        """Write a number as a constant, "" for 1."""
        return "" if value == 1 else f"({self.literal(value)})"

    # Series of operands.

    def series_of(self, operand: Operand) -> SeriesSum:
        if isinstance(operand, Constant):
            return SeriesSum(self.number(operand.value) or "1.0")
        if isinstance(operand, Variable):
            return self._of_variable(operand)
        if isinstance(operand, Sum):
            return self._of_sum(operand)
        if isinstance(operand, Product):
            return self._of_product(operand)
        return self._of_call(operand)

    def _of_variable(self, variable: Variable) -> SeriesSum:
        if variable.name in self.known:
            return self.known[variable.name]
        array, number = variable.cell
        if array == "p":
            return SeriesSum(f"p[{number}]")
        if array not in "qvzt":
            raise NoSeriesError(variable.name)
        place = self.layout.size if array == "t" else self.layout.place(array, number)
        return SeriesSum("", (SeriesTerm("", (place,)),))

    def _of_sum(self, operand: Sum) -> SeriesSum:
        constants: list[str] = []
        terms: dict[tuple[int, ...], str] = {}
        for coefficient, part in operand.terms:
            series = self.scaled(self.series_of(part), self.number(coefficient))
            constants += [series.constant] if series.constant else []
            for term in series.terms:
                scale = term.scale or "1.0"
                both = f"{terms[term.rows]} + {scale}" if term.rows in terms else scale
                terms[term.rows] = both
        total = tuple(
            SeriesTerm("" if scale == "1.0" else self._grouped(scale), rows)
            for rows, scale in terms.items()
        )
        return SeriesSum(self._grouped(" + ".join(constants)) if constants else "", total)

    def _grouped(self, text: str) -> str:
        return self.constant(f"({text})") if " + " in text else text

    def _of_product(self, operand: Product) -> SeriesSum:
        scale, rows = self._factors(operand.numerator)
        below, divisors = self._factors(operand.denominator)
        if below:
            scale = self.constant(f"{scale or '1.0'}/{below}")
        if divisors:
            return self.scaled(self._quotient(rows, divisors), scale)
        if not rows:
            return SeriesSum(scale or "1.0")
        return SeriesSum("", (SeriesTerm(scale, self._two(rows)),))

    def _factors(self, operands: tuple[Operand, ...]) -> tuple[str, list[int]]:
        """Return the constant factor of a product ("" is 1), and its rows."""
        scale, rows = "", list[int]()
        for operand in operands:
            series = self.series_of(operand)
            if not series.terms:
                scale = self._times(scale, series.constant)
                continue
            if not series.constant and len(series.terms) == 1 and series.terms[0].scale:
                scale = self._times(scale, series.terms[0].scale)
                series = SeriesSum("", (SeriesTerm("", series.terms[0].rows),))
            rows.append(self.row(series))
        return scale, rows

    def _two(self, rows: list[int]) -> tuple[int, ...]:
        """Reduce a product of rows to one or two of them."""
        rows = sorted(rows)
        while len(rows) > 2:
            rows = [self.row(SeriesSum("", (SeriesTerm("", (rows[0], rows[1])),))), *rows[2:]]
        return tuple(sorted(rows))

    def _quotient(self, rows: list[int], divisors: list[int]) -> SeriesSum:
        above = SeriesSum("", (SeriesTerm("", self._two(rows)),)) if rows else SeriesSum("1.0")
        below = self.row(SeriesSum("", (SeriesTerm("", self._two(divisors)),)))
        number = self._new(("quotient", above, below))
        if number is None:
            return SeriesSum("", (SeriesTerm("", (self.made["quotient", above, below],)),))
        above_at_0, above_now = (self.text(above, at) for at in (FIRST, NOW))
        first = (f"c[{number}] = ({above_at_0})/c[{below}];", f"i{number} = 1.0/c[{below}];")
        taken = f"({self.inner(below, number)} + now[{below}]*c[{number}])"
        further = (f"now[{number}] = ({above_now and above_now + ' '}- {taken})*i{number};",)
        self._add(Recurrence((number,), first, further, (below, *series_rows(above))))
        return SeriesSum("", (SeriesTerm("", (number,)),))

    def _of_call(self, operand: FunctionCall) -> SeriesSum:
        if operand.function not in _EACH:
            raise NoSeriesError(operand.function)
        series = self.series_of(operand.arguments[0])
        if not series.terms:
            argument_text = series.constant or "0.0"
            return SeriesSum(self.constant(f"{_EACH[operand.function]}(zero + {argument_text})"))
        argument = self.row(series)
        make = {"sin": self._turn, "cos": self._turn, "sqrt": self._root, "exp": self._growth}
        row = make[operand.function](argument) + (operand.function == "cos")
        return SeriesSum("", (SeriesTerm("", (row,)),))

    def _turn(self, a: int) -> int:
        """Return the row of the sine; that of the cosine is the next."""
        s = self._new(("turn", a))
        if s is None:
            return self.made["turn", a]
        c, rates = s + 1, s + 2
        self.rows += 2
        first = (f"c[{s}] = lagrange_each_sin(c[{a}]);", f"c[{c}] = lagrange_each_cos(c[{a}]);")
        sine, cosine = self.inner(rates, c), self.inner(rates, s)
        further = (
            f"now[{rates}] = now[{a}]*(double)k;",
            f"now[{s}] = ({sine} + now[{rates}]*c[{c}])*part;",
            f"now[{c}] = ({cosine} + now[{rates}]*c[{s}])*-part;",
        )
        self._add(Recurrence((s, s + 1, s + 2), first, further, (a,)))
        return s

    def _root(self, a: int) -> int:
        s = self._new(("root", a))
        if s is None:
            return self.made["root", a]
        first = (f"c[{s}] = lagrange_each_sqrt(c[{a}]);", f"i{s} = 0.5/c[{s}];")
        further = (f"now[{s}] = (now[{a}] - {self.inner(s, s)})*i{s};",)
        self._add(Recurrence((s,), first, further, (a,)))
        return s

    def _growth(self, a: int) -> int:
        """Write the recurrence of e' = a' e."""
        e = self._new(("growth", a))
        if e is None:
            return self.made["growth", a]
        rates, self.rows = e + 1, self.rows + 1
        first = (f"c[{e}] = lagrange_each_exp(c[{a}]);",)
        further = (
            f"now[{rates}] = now[{a}]*(double)k;",
            f"now[{e}] = ({self.inner(rates, e)} + now[{rates}]*c[{e}])*part;",
        )
        self._add(Recurrence((e, e + 1), first, further, (a,)))
        return e

    # Rows.

    def row(self, series: SeriesSum) -> int:
        """Return the number of the row that holds a series, a new one if there is none."""
        if not series.constant and len(series.terms) == 1:
            (term,) = series.terms
            if not term.scale and len(term.rows) == 1:
                return term.rows[0]
        number = self._new(series)
        if number is None:
            return self.made[series]
        first, further = (f"{at}[{number}] = {self.text(series, at)};" for at in (FIRST, NOW))
        self._add(Recurrence((number,), (first,), (further,), series_rows(series)))
        return number

    def _new(self, key: object) -> int | None:
        """Add a row for a key; None if there is one."""
        if key in self.made:
            return None
        self.made[key] = self.rows
        self.rows += 1
        return self.rows - 1

    def _add(self, step: Recurrence) -> None:
        self.steps.append(step)

    def text(self, series: SeriesSum, at: str) -> str:
        """Write the coefficient of a series in an array, :data:`FIRST` or :data:`NOW`."""
        parts = [series.constant] if series.constant and at == FIRST else []
        for term in series.terms:
            value = self._coefficient(term.rows, at)
            parts.append(f"{term.scale}*{value}" if term.scale else value)
        return " + ".join(parts)

    def _coefficient(self, rows: tuple[int, ...], at: str) -> str:
        if len(rows) == 1:
            return f"{at}[{rows[0]}]"
        left, right = rows
        if at == FIRST:
            return f"c[{left}]*c[{right}]"
        if left == right:
            return f"({self.inner(left, left)} + 2.0*c[{left}]*now[{left}])"
        return f"({self.inner(left, right)} + c[{left}]*now[{right}] + now[{left}]*c[{right}])"

    def inner(self, left: int, right: int) -> str:
        """Name the sum of products of coefficients j and k - j, without the ends."""
        pair = left, right
        if pair not in self.sums:
            self.sums.append(pair)
        return f"s{self.sums.index(pair)}"


def series_rows(series: SeriesSum) -> tuple[int, ...]:
    return tuple(row for term in series.terms for row in term.rows)
