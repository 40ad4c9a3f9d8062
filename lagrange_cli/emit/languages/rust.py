"""Rust: a module that needs only ``core``, and the crate libm where there is no std.

Functions write their results into arrays of the caller and return a ``Result``. Nothing is
allocated; scratch space stands on the stack. Everything is of Rust 1.63 and edition 2021.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from math import prod
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.fixed_steps import require_steps
from lagrange_cli.emit.initial_state import require_a_program
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.module_parts import Steps
from lagrange_cli.emit.languages.printer import (
    FunctionCalled,
    Language,
    functions_called,
    local_arrays,
    module_functions,
)
from lagrange_cli.emit.languages.rust_program import (
    contacts_text,
    failure_tokens,
    fixed_step_texts,
    main_text,
    project_text,
    recorded_text,
    string_literal,
    switches_text,
)
from lagrange_cli.emit.languages.values import Quantity, takes_mode
from lagrange_cli.emit.naming import file_stem
from lagrange_cli.emit.routines.signatures import SCENE_FUNCTIONS, Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.lowered.functions import Function, Solve

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = """
abstract as async await become box break const continue crate do dyn else enum extern false final fn
for gen if impl in let loop macro match mod move mut override priv pub raw ref return safe self Self
static struct super trait true try type typeof union unsafe unsized use virtual where while yield
given_rhs given_multipliers
Some None Ok Err Params Failure COORDINATES PARAMETERS INPUTS DEFAULTS INITIAL START UNTIL N M
STATES CONTACTS CONTACT_NAMES SWITCH_NAMES SWITCH_PLACES math
f64 usize core std main run step t y p u out i j k l given matrix vector columns scales band
multipliers work w
"""

#: Kinds of numbers in routines, as types.
_KINDS = {"int": "usize", "real": "f64", "bool": "bool"}

#: Functions of which the text of the module has its own, since NaN has to pass through them.
_OWN = ("min", "max", "sign")

#: Function of a program → its name in libm, and the method of ``f64`` where they differ.
_LIBM = {"abs": "fabs"}
_METHODS = {"log": "ln", "pow": "powf"}

#: Lints that the module is not judged by: it has names of the scene, and is no one's handwriting.
_LINTS = "dead_code, non_snake_case, unused_mut, clippy::all"

_NOTES = (
    "Functions return Err where there is no result. Nothing is allocated@BYTES@.",
    "",
    "A crate without std has sin and the like from libm. In its Cargo.toml:",
    "  [features]",
    '  libm = ["dep:libm"]',
    "  [dependencies]",
    '  libm = { version = "0.2", optional = true }',
    "With the feature libm this file needs nothing but core and that crate, else std.",
)


class Rust(Language):
    """Rust 1.63, edition 2021."""

    functions: ClassVar = {
        name: name if name in _OWN else f"math::{_LIBM.get(name, name)}"
        for name in PROGRAM_FUNCTIONS
    }
    whole: ClassVar = {"max": "core::cmp::max", "min": "core::cmp::min"}
    reserved: ClassVar = frozenset(_WORDS.split()) | frozenset(PROGRAM_FUNCTIONS)
    renamed: ClassVar = {**Language.renamed, "switches": "switches_of", "rhs": "rhs_of"}

    def head(self, function: Function, documentation: str) -> list[str]:
        size = prod(function.shape)
        is_inner = self.is_inner(function)
        state = "y: &[f64]" if is_inner else f"y: &[f64; {function.layout.size}]"
        arguments = ["t: f64", state]
        if self.interface.takes_inputs(function):
            arguments.append(f"u: &[f64; {function.driven}]")
        arguments += ["p: &Params", *(["mode: &[f64]"] if takes_mode(function) else [])]
        result = "f64"
        if function.shape:
            arguments.append("out: &mut [f64]" if is_inner else f"out: &mut [f64; {size}]")
            result = "()"
        public = "" if is_inner else "pub "
        begins, ends = f"{public}fn {function.name}(", f") -> Result<{result}, Failure> {{"
        declared = [begins + ", ".join(arguments) + ends]
        if len(declared[0]) > self.width:
            declared = [begins, *(f"{self.tab}{argument}," for argument in arguments), ends]
        lines = [f"/// {documentation}", *declared]
        if not function.shape:
            lines.append(f"{self.tab}let mut out = [0.0_f64; 1];")
        read = self.arguments_read(function) | ({"out"} if function.body else set())
        unread = [name for name in (a.split(":")[0] for a in arguments) if name not in read]
        return [*lines, *(f"{self.tab}let _ = {name};" for name in unread)]

    def foot(self, function: Function) -> list[str]:
        return [f"{self.tab}Ok({'()' if function.shape else 'out[0]'})", "}"]

    def inputs_of(self, function: Function) -> list[str]:
        lines = super().inputs_of(function)
        whole = self.reads_parameters(function)
        return [*lines, "let p = p.to_array();"] if whole else lines

    def argument(self, letter: str, number: int) -> str:
        if letter == "p":
            return f"p.{self.interface.parameters[number].identifier}"
        return super().argument(letter, number)

    def let(self, name: str, text: str) -> str:
        return f"let {name} = {text};"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text};"

    def loop(self, counter: str, count: str) -> tuple[str, str]:
        return f"for {counter} in 0..{count} {{", "}"

    def array(self, name: str, size: int) -> list[str]:
        return [f"let mut {name} = [0.0_f64; {size}];"]

    def require(self, test: str) -> list[str]:
        return [f"if !({test}) {{", f"{self.tab}return Err(Failure::Singular);", "}"]

    def finite(self, count: int) -> list[str]:
        return [
            "if !out.iter().all(|x| x.is_finite()) {",
            f"{self.tab}return Err(Failure::NotFinite);",
            "}",
        ]

    def table(self, table: tuple[int, ...]) -> str:
        return super().table(table).upper()

    def counted(self, index: str) -> str:
        return f"f64::from({index} as u32)"

    def solve(self, step: Solve) -> list[str]:
        """Call a routine; arrays that are parts of one array are split off from each other."""
        split, arrays = _separate(step)
        call = self.require(self.call_of(step, arrays, "&{}"))
        return ["{", *(f"{self.tab}{line}" for line in (*split, *call)), "}"] if split else call

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        size = sum(call.size for call in calls)
        driven = ["u, " if call.function.driven else "" for call in calls]
        lines = [f"let mut given = [0.0_f64; {size}];"]
        if len(calls) == 1:
            return [*lines, f"{calls[0].function.name}(t, y, {driven[0]}p, &mut given)?;"]
        for call, u in zip(calls, driven, strict=True):
            name, end = f"given_{call.function.name}", call.start + call.size
            lines += [
                f"let mut {name} = [0.0_f64; {call.size}];",
                f"{call.function.name}(t, y, {u}p, &mut {name})?;",
                f"given[{call.start}..{end}].copy_from_slice(&{name});",
            ]
        return lines

    def routine_head(self, routine: Signature) -> list[str]:
        kinds = _KINDS | {"reals": "&[f64]", "integers": "&[usize]"}
        handed = {"t": "f64", "p": "&Params", "mode": "&[f64]"}
        handed["u"] = f"&[f64; {len(self.interface.inputs)}]"
        arguments = ", ".join(
            ", ".join(f"{name}: {handed[name]}" for name in self.handed(a.kind))
            if a.kind in SCENE_FUNCTIONS
            else f"{a.name}: {'&mut [f64]' if a.changed else kinds[a.kind]}"
            for a in routine.arguments
        )
        result = "" if routine.result == "none" else f" -> {_KINDS[routine.result]}"
        documentation = (f"/// {line}".rstrip() for line in routine.documentation)
        return [*documentation, *self.broken_head(f"fn {routine.name}({arguments}){result} {{")]

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        name, passed = self.passed(kind, function, arguments[:-1])
        return [], f"{name}({', '.join([*passed, arguments[-1]])}).is_ok()"

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return f"let {'' if fixed else 'mut '}{name}: {_KINDS[kind]} = {text};"

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        numbers = f"{start}..{stop}"
        if down:
            numbers = f"({numbers}).rev()"
        elif step > 1:
            numbers = f"({numbers}).step_by({step})"
        return f"for {counter} in {numbers} {{", self.ended

    def repeated(self, test: str) -> tuple[str, str]:
        return f"while {test} {{", self.ended

    def branch(self, test: str) -> str:
        return f"if {test} {{"

    def other_branch(self, test: str) -> str:
        return f"}} else if {test} {{"


def _separate(step: Solve) -> tuple[list[str], Iterator[str]]:
    """Return lines that split an array of which a routine takes several parts, and its arrays."""
    first, *more = step.arrays
    if all(array.name != first.name for array in more):
        places = ((a.name, a.index.base) for a in step.arrays)
        return [], (f"&mut {name}[{base}..]" if base else f"&mut {name}" for name, base in places)
    bases = [array.index.base for array in step.arrays]
    ends = [end - base for base, end in pairwise(bases)]
    lines = [f"let (_, part) = {first.name}.split_at_mut({bases[0]});"]
    lines += [f"let (part{k}, part) = part.split_at_mut({size});" for k, size in enumerate(ends)]
    return lines, iter([*(f"part{k}" for k in range(len(ends))), "part"])


def emit_rust(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.rs``.

    Parameters
    ----------
    options
        ``main``: whether the module ends with a ``main`` that integrates and prints CSV.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Rust.
    InputError
        A constant is outside the range of a double, a recording is too long, or ``main`` is asked
        for where nothing can move.
    """
    if options["main"]:
        require_a_program(equations)
    interface = interface_of(equations, Rust.reserved, jacobian=bool(options["jacobian"]))
    language = Rust(interface)
    functions = module_functions(language)
    around = [recorded_text(language), project_text(language), contacts_text(language)]
    around.append(switches_text(language))
    steps = Steps(equations, require_steps(equations, options), step_errors)
    around += fixed_step_texts(language, steps)
    main = [main_text(language).rstrip()] if options["main"] else []
    routines = routine_texts(language)
    parts = [
        "\n".join([*_heading(language), f"#![allow({_LINTS})]"]),
        *_mathematics(functions_called(language)),
        "\n".join(_constants(language)),
        "\n".join(_parameters(language)),
        filled(template("rust", "common.rs"), failure_tokens(interface)).rstrip(),
        *routines,
        *functions,
        *filter(None, around),
        *main,
    ]
    return {f"{file_stem(equations.presentation.name)}.rs": "\n\n".join(parts) + "\n"}


def _heading(language: Rust) -> list[str]:
    interface = language.interface
    functions = (*interface.functions, *interface.inner)
    sizes = (sum(local_arrays(f).values()) for f, _ in functions)
    taken = 8 * max(sizes, default=0)
    stack = f"; local arrays take up to {taken} bytes of the stack" if taken else ""
    notes = [line.replace("@BYTES@", stack) for line in _NOTES]
    return language.commented([*language.interface.heading, "", *notes])


def _mathematics(called: list[str]) -> Iterator[str]:
    """Yield the functions that are called: those of libm or std, then those of the module."""
    methods = "".join(f"    {_method(name)}\n" for name in called if name not in _OWN)
    if methods:
        yield template("rust", "math.rs").replace("@METHODS@", methods).rstrip()
    yield from (template("rust", f"{name}.rs").rstrip() for name in called if name in _OWN)


def _method(name: str) -> str:
    """Return the function of libm by the method of ``f64``."""
    more = PROGRAM_FUNCTIONS[name] > 1
    argument, passed = (", y: f64", "y") if more else ("", "")
    method = f"x.{_METHODS.get(name, name)}({passed})"
    return f"pub fn {_LIBM.get(name, name)}(x: f64{argument}) -> f64 {{ {method} }}"


def _constants(language: Rust) -> Iterator[str]:
    interface = language.interface
    n = len(interface.coordinates)
    yield "/// Number of coordinates; the state y holds them, then their velocities."
    yield f"pub const N: usize = {n};"
    if interface.states:
        yield "/// Number of states of first order, which stand behind the velocities in y."
        yield f"pub const M: usize = {len(interface.states)};"
    yield from _names("COORDINATES", "Coordinates, in their order.", interface.coordinates)
    yield from _names("STATES", "States of first order, in their order.", interface.states)
    yield from _names("PARAMETERS", "Parameters, in their order.", interface.parameters)
    yield from _names("INPUTS", "Inputs, in their order.", interface.inputs)
    if interface.initial is not None:
        yield "/// Initial state of the scene."
        numbers = ", ".join(map(repr, interface.initial))
        size = interface.layout.size
        yield from language.broken(f"pub const INITIAL: [f64; {size}] = [{numbers}];")
    for name, table in language.tables.items():
        numbers = ", ".join(map(str, table))
        yield from language.broken(f"static {name.upper()}: [usize; {len(table)}] = [{numbers}];")


def _names(constant: str, documentation: str, quantities: tuple[Quantity, ...]) -> Iterator[str]:
    if quantities:
        yield f"/// {documentation}"
        yield f"pub const {constant}: [&str; {len(quantities)}] = ["
        yield from (f"    {string_literal(quantity.name)}," for quantity in quantities)
        yield "];"


def _number(value: float | None) -> str:
    return "f64::NAN" if value is None else repr(value)


def _parameters(language: Rust) -> Iterator[str]:
    """Yield the structure of the parameters, and their values in the scene."""
    interface = language.interface
    fields = interface.parameters
    yield "/// Parameters of the system."
    yield "#[derive(Clone, Copy, Debug, PartialEq)]"
    yield "pub struct Params {"
    for field in fields:
        # A code span, in which nothing of the scene is markup.
        yield f"    /// `{field.note.replace('`', chr(39))}`"
        yield f"    pub {field.identifier}: f64,"
    yield "}"
    yield ""
    yield "/// Parameters as the scene has them; NaN stands for values that must be given."
    yield "pub const DEFAULTS: Params = Params {"
    yield from (f"    {field.identifier}: {_number(field.value)}," for field in fields)
    yield "};"
    if any(
        map(language.reads_parameters, (f for f, _ in (*interface.functions, *interface.inner)))
    ):
        yield ""
        yield "impl Params {"
        yield f"    fn to_array(&self) -> [f64; {len(fields)}] {{"
        yield "        ["
        yield from (f"            self.{field.identifier}," for field in fields)
        yield from ("        ]", "    }", "}")
