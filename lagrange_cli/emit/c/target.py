"""The target of emitted C: identifiers, number type, argument lists, and templates filled in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from math import isfinite
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.naming import C_RESERVED, unique_identifiers
from lagrange_cli.emit.template_files import filled
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS, Coefficient, magnitude
from lagrange_cli.program.printing import Dialect, decimal_literal, double_literal, out_of_range

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


@dataclass(frozen=True)
class Real:
    """A floating-point type of C.

    Attributes
    ----------
    name
        Name of the type in C.
    suffix
        Suffix of functions of ``<math.h>``.
    constant_suffix
        Suffix of constants.
    epsilon
        Half the distance from 1 to the next number.
    largest_exponent
        Largest power of ten of constants.
    parse
        Function that reads a text.
    digits
        Digits with which a number reads back the same.
    """

    name: str
    suffix: str
    constant_suffix: str
    epsilon: Fraction
    largest_exponent: int
    parse: str
    digits: int

    def print_format(self, digits: int) -> str:
        """Return the format of ``printf`` that prints so many digits."""
        return f"%.{digits}{self.constant_suffix.strip('f')}g"

    def literal(self, value: Coefficient) -> str:
        """Return a constant that reads as the number nearest to ``value``."""
        if not value:
            return f"0.0{self.constant_suffix}"
        if self.name == "double":
            return double_literal(value)
        limit = Fraction(10) ** self.largest_exponent
        if not 1 / limit <= magnitude(value) <= limit:
            raise out_of_range(value)
        return decimal_literal(value) + self.constant_suffix

    def value(self, number: float) -> str:
        """Return a constant for a double."""
        if not isfinite(number):
            return "NAN"
        return self.literal(Fraction(repr(number)))


_REALS = {
    "float": Real("float", "f", "f", Fraction(1, 2**24), 37, "(float)strtod", 9),
    "double": Real("double", "", "", Fraction(1, 2**53), 307, "strtod", 17),
    "long-double": Real("long double", "l", "L", Fraction(1, 2**64), 4931, "strtold", 21),
}


def real_type(option: str) -> Real:
    """Return the type that the option ``real`` names."""
    return _REALS[option]


@dataclass(frozen=True)
class CNames:
    """Identifiers of one system in C.

    Attributes
    ----------
    prefix
        Beginning of all its symbols.
    fields
        Those of its struct of parameters.
    inputs
        Dummy name → text for every input of a program.
    empty_field
        The field of a struct without parameters.
    parameter_array
        Array that holds the parameters; None if fields do.
    further
        Arguments that functions take behind the parameters.
    contact_from
        Index from which on parameters come in an array ``contact`` of their own; None if all
        come together.
    """

    prefix: str
    fields: tuple[str, ...]
    inputs: Mapping[str, str]
    empty_field: str = "none"
    parameter_array: str | None = None
    further: str = ""
    contact_from: int | None = None

    @classmethod
    def of(cls, equations: Equations) -> CNames:
        (prefix,) = unique_identifiers([equations.presentation.name], frozenset())
        fields = unique_identifiers((p.name for p in equations.system.parameters), C_RESERVED)
        coordinates = unique_identifiers(
            (c.name for c in equations.system.coordinates), frozenset()
        )
        inputs = {f"p{i}": f"p->{field}" for i, field in enumerate(fields)}
        inputs |= {f"u{i}": f"u[{i}]" for i in range(len(equations.system.inputs))}
        for kind in "qv":
            inputs |= {f"{kind}{i}": f"{kind}_{name}" for i, name in enumerate(coordinates)}
        states = unique_identifiers((s.name for s in equations.system.states), frozenset())
        inputs |= {f"z{i}": f"x_{name}" for i, name in enumerate(states)}
        return cls(prefix, tuple(fields), inputs)

    @property
    def passed(self) -> str:
        """Return the arguments that functions pass on to others, before ``work``."""
        return "t, y, u, p" if self.contact_from is None else "t, y, u, p, contact"


def c_string(text: str) -> str:
    """Return a string literal of C; all but plain ASCII becomes octal escapes."""
    return '"' + "".join(_character(byte) for byte in text.encode("utf-8")) + '"'


def _character(byte: int) -> str:
    plain = 32 <= byte < 127 and chr(byte) not in '"\\?%@'
    return chr(byte) if plain else f"\\{byte:03o}"


#: Tail of the macro that tells a pivot from rounding error.
EPSILON_NAME = "EPSILON"

#: Lines are broken before this column.
_WIDTH = 96


def wrapped(text: str, depth: int, deeper: int) -> list[str]:
    """Return lines of a statement at a depth; further ones stand deeper."""
    return wrap(
        text,
        _WIDTH,
        initial_indent="    " * depth,
        subsequent_indent="    " * (depth + deeper),
        break_long_words=False,
        break_on_hyphens=False,
    )


#: Functions that ``<math.h>`` lacks; the source file has its own.
_OWN = ("max", "min", "sign")


@dataclass(frozen=True)
class CTarget:
    """Names and number type that the functions of one source file of C share.

    Attributes
    ----------
    names
        Identifiers of the system.
    real
        The floating-point type of all numbers.
    """

    names: CNames
    real: Real

    @classmethod
    def of(cls, equations: Equations, real: Real) -> CTarget:
        """Return the target with the names of a scene."""
        return cls(CNames.of(equations), real)

    @property
    def prefix(self) -> str:
        """Return the beginning of all identifiers of the source file."""
        return self.names.prefix

    @property
    def functions(self) -> dict[str, str]:
        """Return function of a program → its name in C."""
        table = {name: name + self.real.suffix for name in PROGRAM_FUNCTIONS if name not in _OWN}
        table["abs"] = "fabs" + self.real.suffix
        return table | {name: f"{self.prefix}_{name}" for name in _OWN}

    @property
    def dialect(self) -> Dialect:
        """Return the dialect in which expressions are printed."""
        return Dialect(self.real.literal, self.functions, self.names.inputs)

    def arguments(self, result: str) -> str:
        """Return the parameter list that all functions of the interface share."""
        real, names = self.real.name, self.names
        return (
            f"{real} t, const {real} *y, const {real} *u, "
            f"const {names.prefix}_params *p, {names.further}"
            f"{real} *work, {real} *{result}"
        )

    def state_arguments(self) -> str:
        """Return the parameter list of functions that change a state."""
        real, names = self.real.name, self.names
        return (
            f"{real} t, {real} *y, const {real} *u, "
            f"const {names.prefix}_params *p, {names.further}{real} *work"
        )

    def handed(self, kind: str) -> str:
        """Return the parameters of routines by which they call functions of the scene."""
        real = self.real.name
        if kind == "motion":
            return f"const {self.prefix}_params *p, int *status"
        if kind == "dynamics":
            params = f"const {self.prefix}_params *p"
            return f"const {real} *u, {params}, {real} *work, int *status"
        return f"{real} t, const {real} *u, const {self.prefix}_params *p, {real} *work"

    def fill(self, template: str, others: Mapping[str, str] | None = None) -> str:
        """Put type, names and constants into a template; ``others``: further tokens, first."""
        real = self.real
        replacements = {
            **(others or {}),
            "@NAME@": self.prefix,
            "@REAL@": real.name,
            "@FABS@": "fabs" + real.suffix,
            "@SQRT@": "sqrt" + real.suffix,
            "@FREXP@": "frexp" + real.suffix,
            "@LDEXP@": "ldexp" + real.suffix,
            "@CEIL@": "ceil" + real.suffix,
            "@ZERO@": real.value(0.0),
            "@ONE@": real.value(1.0),
        }
        return filled(template, replacements)
