"""C++17: a header of function templates over the number type.

``T`` may be any type with the four operations and the functions that are called, which are found
by the types of their arguments: numbers of any precision, dual numbers, intervals. Numbers are
compared only where a pivot is tested, and by ``abs``, ``min``, ``max`` and ``sign``.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from math import prod
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.fixed_steps import require_steps
from lagrange_cli.emit.initial_state import require_a_program
from lagrange_cli.emit.languages.cpp_program import (
    contacts_text,
    fixed_step_texts,
    main_text,
    project_text,
    recorded_text,
    string_literal,
    switches_text,
)
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.module_parts import Steps
from lagrange_cli.emit.languages.printer import (
    FunctionCalled,
    Language,
    functions_called,
    module_functions,
)
from lagrange_cli.emit.languages.values import Quantity, takes_mode
from lagrange_cli.emit.naming import C_HEADERS, C_RESERVED, file_stem, unique_identifiers
from lagrange_cli.emit.routines.signatures import SCENE_FUNCTIONS, Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.emit.template_files import template
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS, Coefficient
from lagrange_cli.program.lowered.functions import Function, Solve, operands_in
from lagrange_cli.program.printing import functions_in

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = """
T N Params State dof coordinate_names parameter_names input_names initial_state std size_t detail
given_rhs given_multipliers values step main t y p u out i j k l given matrix vector columns scales
band multipliers work w
"""

#: Functions of C and POSIX, beside which no namespace of their name can stand.
_GLOBAL = """
abort abs access alarm alloca atexit atof brk bsearch calloc cbrt ceil chain clock close copysign
ctime daemon difftime div drem dup ecvt erf erfc exit exp10 exp2 expm1 fabs fdim finite floor fma
fmax fmin fmod fork free frexp gamma getenv gmtime hypot ilogb index j0 j1 jn kill ldexp ldiv
lgamma link log10 log1p log2 logb lrint lround malloc mktime modf nan nearbyint nextafter nice open
pause pipe pow10 printf putenv puts qsort raise rand random read realloc remainder remove remquo
rename rewind rindex rint round roundeven scalb scalbn select setstate signal significand sincos
sleep srand srandom swab sync system tgamma time times trunc truncate unlink valloc wait write y0
y1 yn
"""

_HEADERS = ("algorithm", "array", "cmath", "cstddef", "limits")

#: Kinds of numbers in routines, as types.
_KINDS = {"int": "std::size_t", "real": "T", "bool": "bool"}

#: Functions of which the header has its own, since NaN has to pass through them.
_OWN = ("min", "max", "sign")

#: Integers that every number type of 53 bits holds.
_LARGEST_INTEGER = 2**53

_NOTES = (
    "C++17. Functions are templates over the number type T: float, double, long double, or any",
    "type with arithmetic and functions of its own, such as dual numbers that differentiate. They",
    "return NaN where the mass matrix is singular. They allocate nothing and throw nothing.",
)


class Cpp(Language):
    """C++17, as templates over a number type ``T``."""

    functions: ClassVar = {name: name for name in PROGRAM_FUNCTIONS} | {
        name: f"detail::{name}<T>" for name in _OWN
    }
    whole: ClassVar = {"max": "std::max", "min": "std::min"}
    reserved: ClassVar = C_RESERVED | frozenset(_WORDS.split()) | frozenset(PROGRAM_FUNCTIONS)

    #: Index of the result of a function that returns a number, and what is returned of none.
    _number, _undefined = "", ""

    def number(self, value: Coefficient) -> str:
        """Return a number that is correctly rounded in every binary type, where it is short."""
        value = Fraction(value)
        top, bottom = abs(value.numerator), value.denominator
        if bottom & (bottom - 1) and max(top, bottom) <= _LARGEST_INTEGER:
            text = f"detail::ratio<T>({float(top)!r}, {float(bottom)!r})"
            return text if value > 0 else f"-{text}"
        return f"T({super().number(value)})"

    def rounding(self) -> str:
        return "detail::rounding<T>()"

    def head(self, function: Function, documentation: str) -> list[str]:
        is_inner = self.is_inner(function)
        state = f"const std::array<T, {function.layout.size}>& y"
        arguments = ["T t", "const T* y" if is_inner else state]
        if self.interface.takes_inputs(function):
            arguments.append(f"const std::array<T, {function.driven}>& u")
        arguments.append("const Params<T>& p" + ("" if is_inner else " = {}"))
        taken = ["t", "y", *(["u"] if len(arguments) > 3 else []), "p"]
        if takes_mode(function):
            arguments.append("const T* mode")
            taken.append("mode")
        size = prod(function.shape)
        result = f"std::array<T, {size}>" if function.shape else "T"
        if is_inner:
            arguments.append("T* out")
            result = "bool"
        begins = f"{result} {function.name}("
        declared = [f"{begins}{', '.join(arguments)})"]
        if len(declared[0]) > self.width:
            commas = [","] * (len(arguments) - 1) + [")"]
            lines = [f"{self.tab}{a}{c}" for a, c in zip(arguments, commas, strict=True)]
            declared = [begins, *lines]
        called = functions_in(operands_in(function.body)).difference(_OWN)
        read = self.arguments_read(function)
        return [
            f"/// {documentation}",
            "template <class T>",
            *declared,
            "{",
            *(f"{self.tab}using std::{name};" for name in PROGRAM_FUNCTIONS if name in called),
            *(f"{self.tab}(void){name};" for name in taken if name not in read),
            *([] if is_inner else [f"{self.tab}std::array<T, {size}> out{{}};"]),
        ]

    def foot(self, function: Function) -> list[str]:
        is_inner = self.is_inner(function)
        return [f"{self.tab}return {'true' if is_inner else f'out{self._number}'};", "}"]

    def inputs_of(self, function: Function) -> list[str]:
        self._number = "" if function.shape else "[0]"
        self._undefined = f"detail::undefined(out){self._number}"
        if self.is_inner(function):
            self._undefined = "false"
        lines = super().inputs_of(function)
        whole = self.reads_parameters(function)
        return [*lines, "const auto values = to_array(p);"] if whole else lines

    def argument(self, letter: str, number: int) -> str:
        if letter == "p":
            return f"p.{self.interface.parameters[number].identifier}"
        return super().argument(letter, number)

    def element_text(self, name: str, index: str) -> str:
        return super().element_text("values" if name == "p" else name, index)

    def let(self, name: str, text: str) -> str:
        return f"const T {name} = {text};"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text};"

    def loop(self, counter: str, count: str) -> tuple[str, str]:
        return f"for (std::size_t {counter} = 0; {counter} < {count}; ++{counter}) {{", "}"

    def array(self, name: str, size: int) -> list[str]:
        return [f"std::array<T, {size}> {name}{{}};"]

    def require(self, test: str) -> list[str]:
        return [f"if (!({test})) {{", f"{self.tab}return {self._undefined};", "}"]

    def finite(self, count: int) -> list[str]:
        return []  # No comparison: what is not finite stands as it is.

    def counted(self, index: str) -> str:
        return f"T(static_cast<double>({index}))"

    def solve(self, step: Solve) -> list[str]:
        places = ((array.name, array.index.base) for array in step.arrays)
        arrays = [f"{name}.data()" + (f" + {base}" if base else "") for name, base in places]
        return self.require(self.call_of(step, arrays, "{}.data()"))

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        size = sum(call.size for call in calls)
        driven = ["u, " if call.function.driven else "" for call in calls]
        texts = [f"{c.function.name}(t, y, {u}p)" for c, u in zip(calls, driven, strict=True)]
        if len(calls) == 1:
            return [f"const auto given = {texts[0]};"]
        lines = [f"std::array<T, {size}> given{{}};"]
        for call, text in zip(calls, texts, strict=True):
            name = f"given_{call.function.name}"
            behind = f" + {call.start}" if call.start else ""
            copied = f"std::copy({name}.begin(), {name}.end(), given.begin(){behind});"
            lines += [f"const auto {name} = {text};", copied]
        return lines

    def routine_head(self, routine: Signature) -> list[str]:
        kinds = _KINDS | {"reals": "const T*", "integers": "const std::size_t*", "none": "void"}
        handed = {"t": "T t", "p": "const Params<T>& p", "mode": "const T* mode"}
        handed["u"] = f"const std::array<T, {len(self.interface.inputs)}>& u"
        arguments = ", ".join(
            ", ".join(handed[name] for name in self.handed(a.kind))
            if a.kind in SCENE_FUNCTIONS
            else f"{'T*' if a.changed else kinds[a.kind]} {a.name}"
            for a in routine.arguments
        )
        return [
            *(f"/// {line}".rstrip() for line in routine.documentation),
            "template <class T>",
            *self.broken_head(f"{kinds[routine.result]} {routine.name}({arguments})"),
            "{",
            f"{self.tab}using std::abs;",
            f"{self.tab}using std::sqrt;",
        ]

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        name, passed = self.passed(kind, function, arguments[:-1])
        return [], f"{name}({', '.join([*passed, arguments[-1]])})"

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return f"{'const ' if fixed else ''}{_KINDS[kind]} {name} = {text};"

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        if down:
            return f"for (std::size_t {counter} = {stop}; {counter}-- > {start};) {{", self.ended
        advance = f"++{counter}" if step == 1 else f"{counter} += {step}"
        bounds = f"std::size_t {counter} = {start}; {counter} < {stop}; {advance}"
        return f"for ({bounds}) {{", self.ended


def emit_cpp(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.hpp``.

    Parameters
    ----------
    options
        ``main``: whether the header ends with a ``main`` that integrates and prints CSV.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in C++.
    InputError
        A constant is outside the range of a double, a recording is too long, or ``main`` is asked
        for where nothing can move.
    """
    if options["main"]:
        require_a_program(equations)
    interface = interface_of(equations, Cpp.reserved, jacobian=bool(options["jacobian"]))
    language = Cpp(interface)
    functions = module_functions(language)
    around = [recorded_text(language), contacts_text(language), project_text(language)]
    around.append(switches_text(language))
    steps = Steps(equations, require_steps(equations, options), step_errors)
    around += fixed_step_texts(language, steps)
    (name,) = unique_identifiers([interface.name], frozenset(_GLOBAL.split()))
    main = [main_text(language, name).strip()] if options["main"] else []
    routines = routine_texts(language)
    guard = f"LAGRANGE_{name}_HPP"
    parts = [
        "\n".join(language.commented([*interface.heading, "", *_NOTES])),
        f"#ifndef {guard}\n#define {guard}",
        "\n".join(f"#include <{header}>" for header in _HEADERS),
        f"namespace {name} {{",
        template("cpp", "detail.hpp").replace("@OWN@", _own(language)).rstrip(),
        "\n".join(_constants(language)),
        "\n".join(_parameters(language)),
        *routines,
        *functions,
        *filter(None, around),
        f"}} // namespace {name}",
        *main,
        "#endif",
    ]
    return {f"{file_stem(equations.presentation.name, C_HEADERS)}.hpp": "\n\n".join(parts) + "\n"}


def _own(language: Cpp) -> str:
    called = functions_called(language)
    return "".join(template("cpp", f"{name}.hpp") + "\n" for name in _OWN if name in called)


def _constants(language: Cpp) -> Iterator[str]:
    interface, n = language.interface, len(language.interface.coordinates)
    size = interface.layout.size
    yield "/// Number of coordinates; the state y holds them, then their velocities."
    yield f"inline constexpr std::size_t dof = {n};"
    if interface.states:
        yield "/// Number of states of first order, which stand behind the velocities in y."
        yield f"inline constexpr std::size_t states = {len(interface.states)};"
    yield "template <class T>"
    yield f"using State = std::array<T, 2*dof{' + states' * bool(interface.states)}>;"
    yield from _names("coordinate", interface.coordinates)
    yield from _names("state", interface.states)
    yield from _names("parameter", interface.parameters)
    yield from _names("input", interface.inputs)
    if interface.initial is not None:
        yield "/// Initial state of the scene."
        numbers = ", ".join(map(repr, interface.initial))
        text = f"inline constexpr std::array<double, {size}> initial_state{{{numbers}}};"
        yield from language.broken(text)
    for name, table in language.tables.items():
        numbers = ", ".join(map(str, table))
        text = f"inline constexpr std::array<std::size_t, {len(table)}> {name}{{{numbers}}};"
        yield from language.broken(text)


def _names(kind: str, quantities: tuple[Quantity, ...]) -> Iterator[str]:
    if quantities:
        yield f"/// {kind.capitalize()}s, in their order."
        size = len(quantities)
        yield f"inline constexpr std::array<const char*, {size}> {kind}_names{{"
        yield from (f"    {string_literal(quantity.name)}," for quantity in quantities)
        yield "};"


def _parameters(language: Cpp) -> Iterator[str]:
    """Yield the structure of the parameters with their values in the scene."""
    interface = language.interface
    fields = interface.parameters
    missing = "T(std::numeric_limits<double>::quiet_NaN())"
    yield "/// Parameters as the scene has them; NaN stands for values that must be given."
    yield "template <class T>"
    yield "struct Params {"
    for field in fields:
        value = missing if field.value is None else f"T({field.value!r})"
        yield f"    T {field.identifier} = {value}; // {field.note}"
    yield "};"
    functions = (function for function, _ in (*interface.functions, *interface.inner))
    if any(map(language.reads_parameters, functions)):
        yield ""
        yield "template <class T>"
        yield f"std::array<T, {len(fields)}> to_array(const Params<T>& p)"
        yield "{"
        yield "    return {"
        yield from (f"        p.{field.identifier}," for field in fields)
        yield from ("    };", "}")
