"""Fortran 2018: a module of pure subroutines, which need nothing but the language.

Subroutines fill ``out`` and set ``status``: 0, or 1 where a matrix is singular and 2 where a result
is not finite. Arrays count from 1. Capitals do not tell names apart, of which all are declared.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from math import prod
from textwrap import indent
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.fixed_steps import require_steps
from lagrange_cli.emit.initial_state import require_a_program
from lagrange_cli.emit.languages.fortran_procedures import (
    contacts_text,
    fixed_step_texts,
    integrate_text,
    project_text,
    recorded_text,
    recording_lines,
    switches_text,
)
from lagrange_cli.emit.languages.fortran_program import (
    event_constants,
    helper_functions,
    main_program,
    split_line,
)
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.module_parts import Steps
from lagrange_cli.emit.languages.printer import (
    COUNTERS,
    FunctionCalled,
    Language,
    local_arrays,
    module_functions,
)
from lagrange_cli.emit.languages.values import Interface, takes_mode
from lagrange_cli.emit.naming import file_stem
from lagrange_cli.emit.routines.signatures import SCENE_FUNCTIONS, Argument, Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS, Coefficient
from lagrange_cli.program.lowered.functions import (
    RESULTS,
    Function,
    Let,
    Solve,
    Step,
    Total,
    loop_depth,
    names_read,
    steps_in,
)
from lagrange_cli.program.printing import double_literal

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = f"""
{" ".join(PROGRAM_FUNCTIONS)} all merge ieee_is_finite ieee_is_nan real64 wp real integer type
sign_of smaller larger power parameters integrate initial project error change square
t y u p p_values found out status i j k l given matrix vector columns scales band multipliers work w
allocate associate backspace block call case class close contains cycle data deallocate do else
elseif elsewhere end enddo endfile endif entry error exit external flush forall format function go
goto if implicit import in inquire interface intent intrinsic kind module namelist none nullify only
open optional parameter pause pointer print private procedure program public pure read result return
rewind save select sequence stop subroutine target then to type use wait where while write
character complex double logical precision
"""

#: Functions that Fortran has under another name.
_OTHERS = {"sign": "sign_of", "min": "smaller", "max": "larger", "pow": "power"}

#: Kind of a number in a routine → how it is declared.
_TYPES = {
    "int": "integer :: ",
    "real": "real(wp) :: ",
    "bool": "logical :: ",
    "reals": "real(wp) :: ",
    "integers": "integer :: ",
}

#: Result of a routine.
_RESULT = "found"

#: Kind of the result of a routine that another one calls → the variable that takes it.
_TAKEN = {"bool": "succeeded", "real": "measured", "int": "counted"}

#: Numbers of an array from which on it is allocated instead of standing on the stack.
_LARGE = 4096

#: Letters of a name, of which the main program adds five.
_LONGEST = 58


class Fortran(Language):
    """Fortran, as the standard of 2018 has it."""

    functions: ClassVar = {name: name for name in PROGRAM_FUNCTIONS} | _OTHERS
    reserved: ClassVar = frozenset(_WORDS.split())
    comment = "! "
    first = 1
    tab = "  "
    named = "uqvz"
    words: ClassVar = {"and": ".and.", "or": ".or.", "not": ".not. "} | {
        text: f".{text.lower()}." for text in ("True", "False")
    }
    whole: ClassVar = {"min": "min", "max": "max"}
    augments = False
    leaving = "exit"
    otherwise = "else"
    ended = "end if"
    continued = " &"

    def __init__(self, interface: Interface) -> None:
        super().__init__(interface)
        fields = {f"p{k}": f"p%{p.identifier}" for k, p in enumerate(interface.parameters)}
        self.dialect = replace(self.dialect, names={**self.dialect.names, **fields})
        self._scalar = False

    def number(self, value: Coefficient) -> str:
        return f"{double_literal(value)}_wp"

    def function_lines(self, function: Function, documentation: str) -> list[str]:
        self._scalar = not function.shape
        lines = super().function_lines(function, documentation)
        return [f"{self.tab}{line}" for line in lines]

    def head(self, function: Function, documentation: str) -> list[str]:
        further = ", u" if self.interface.takes_inputs(function) else ""
        further += ", p, mode" if takes_mode(function) else ", p"
        out = "out" if not function.shape else f"out({prod(function.shape)})"
        return [
            f"!> {documentation}",
            f"pure subroutine {function.name}(t, y{further}, out, status)",
            *(f"{self.tab}{line}" for line in self._arguments(function, out)),
            *(f"{self.tab}{line}" for line in self._declared(function)),
            f"{self.tab}status = 0",
            *([] if prod(function.shape) else [f"{self.tab}out = 0.0_wp"]),
        ]

    def _arguments(self, function: Function, out: str) -> Iterator[str]:
        yield f"real(wp), intent(in) :: t, y({function.layout.size})"
        if self.interface.takes_inputs(function):
            yield f"real(wp), intent(in) :: u({function.driven})"
        yield "type(parameters), intent(in) :: p"
        if self.interface.contacts is not None and takes_mode(function):
            yield f"real(wp), intent(in) :: mode({2 * self.interface.contacts.count})"
        yield f"real(wp), intent(out) :: {out}"
        yield "integer, intent(out) :: status"

    def _declared(self, function: Function) -> Iterator[str]:
        """Declare what a function names, and mark the arguments that it does not read."""
        body, read = function.body, names_read(function.body)
        used = self.arguments_read(function)
        names = [name for name in self.interface.names if name[0] != "p" and name in read]
        local = {self.interface.names[name]: None for name in names}
        local |= {step.name: None for step in steps_in(body) if isinstance(step, Let)}
        if local:
            yield from self.broken(f"real(wp) :: {', '.join(local)}")
        for array, size in local_arrays(function).items():
            large = size > _LARGE
            yield f"real(wp){', allocatable' * large} :: {array}({':' if large else size})"
        if calls := self.functions_called_by(function):
            yield f"real(wp) :: given({sum(call.size for call in calls)})"
        if self.reads_parameters(function):
            yield f"real(wp) :: p_values({len(self.interface.parameters)})"
        if any(isinstance(step, Solve) for step in steps_in(body)):
            yield f"{_TYPES['bool']}found"
        totals = any(isinstance(step, Total) for step in steps_in(body))
        counters = COUNTERS[: max(loop_depth(_without_check(function)), int(totals))]
        if counters:
            yield f"integer :: {', '.join(counters)}"
        unused = [name for name in ("t", "y", "p") if name not in used]
        unused += ["u"] if self.interface.takes_inputs(function) and "u" not in used else []
        unused += ["mode"] if takes_mode(function) and "mode" not in used else []
        if unused:
            yield f"associate ({', '.join(f'unused_{name} => {name}' for name in unused)})"
            yield "end associate"

    def inputs_of(self, function: Function) -> list[str]:
        lines = super().inputs_of(function)
        if self.reads_parameters(function):
            fields = ", ".join(f"p%{p.identifier}" for p in self.interface.parameters)
            lines += self.broken(f"p_values = [{fields}]")
        return lines

    def foot(self, function: Function) -> list[str]:
        return [f"end subroutine {function.name}"]

    def let(self, name: str, text: str) -> str:
        return f"{name} = {text}"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text}"

    def loop(self, counter: str, count: str) -> tuple[str, str]:
        last = str(int(count) - 1) if count.isdigit() else f"{count} - 1"
        return f"do {counter} = 0, {last}", "end do"

    def array(self, name: str, size: int) -> list[str]:
        return [f"allocate ({name}({size}))"] if size > _LARGE else []

    def require(self, test: str) -> list[str]:
        begins = self.broken(f"if (.not. ({test})) then")
        return [*begins, f"{self.tab}status = 1", f"{self.tab}return", self.ended]

    def finite(self, count: int) -> list[str]:
        finite = "ieee_is_finite(out)" if self._scalar else "all(ieee_is_finite(out))"
        return [f"if (.not. {finite}) status = 2"]

    def solve(self, step: Solve) -> list[str]:
        first = [self.element_text(a.name, str(a.index.base + 1)) for a in step.arrays]
        sizes_and_tables = [*map(str, step.sizes), *map(self.table, step.tables)]
        arguments = ", ".join([*sizes_and_tables, *first, "found"])
        return [*self.broken(f"call solve_{step.routine}({arguments})"), *self.require("found")]

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        lines: list[str] = []
        for call in calls:
            driven = ", u" if self.interface.takes_inputs(call.function) else ""
            place = f"given({call.start + 1}:{call.start + call.size})"
            called = f"call {call.function.name}(t, y{driven}, p, {place}, status)"
            lines += [called, "if (status /= 0) return"]
        return lines

    def scope(self) -> None:
        return None

    def counted(self, index: str) -> str:
        return f"real({index}, wp)"

    def element_text(self, name: str, index: str) -> str:
        if name == RESULTS and self._scalar:
            return name
        return f"{'p_values' if name == 'p' else name}({index})"

    # -- routines --------------------------------------------------------------------

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        name, passed = self.passed(kind, function, arguments[:-1])
        call = f"call {name}({', '.join([*passed, arguments[-1], 'status'])})"
        return self.broken(call), "status == 0"

    def routine_head(self, routine: Signature) -> list[str]:
        names = []
        for argument in routine.arguments:
            is_scene = argument.kind in SCENE_FUNCTIONS
            names += self.handed(argument.kind) if is_scene else [argument.name]
        begins = f"pure function {routine.name}({', '.join(names)}) result({_RESULT})"
        if _changes(routine):
            passed = ", ".join([*names, *([] if routine.result == "none" else [_RESULT])])
            begins = f"pure subroutine {routine.name}({passed})"
        documentation = (f"!> {line}".rstrip() for line in routine.documentation)
        lines = (f"{self.tab}{line}" for line in self._of_routine(routine))
        return [*documentation, *self.broken(begins), *lines]

    def _of_routine(self, routine: Signature) -> Iterator[str]:
        """Declare what a routine returns, takes and names."""
        if routine.result != "none":
            declared = f"{_TYPES[routine.result]}{_RESULT}"
            intent = ", intent(out) ::" if _changes(routine) else " ::"
            yield declared.replace(" ::", intent)
        for argument in routine.arguments:
            yield from self._of_argument(argument)
        for name, kind in routine.names.items():
            yield f"{_TYPES[kind]}{name}"
        for kind in dict.fromkeys(r.result for r in routine.called if _changes(r)):
            if kind != "none":
                yield f"{_TYPES[kind]}{_TAKEN[kind]}"
        if routine.evaluates:
            yield "integer :: status"

    def _of_argument(self, argument: Argument) -> list[str]:
        """Declare an argument of a routine, or those by which functions of the scene are called."""
        if argument.kind in SCENE_FUNCTIONS:
            declared = {
                "t": "real(wp), intent(in) :: t",
                "u": f"real(wp), intent(in) :: u({len(self.interface.inputs)})",
                "p": "type(parameters), intent(in) :: p",
                "mode": "real(wp), intent(in) :: mode(*)",
            }
            return [declared[name] for name in self.handed(argument.kind)]
        intent = f", intent({'inout' if argument.changed else 'in'}) ::"
        size = "(*)" if argument.kind in ("reals", "integers") else ""
        return [f"{_TYPES[argument.kind].replace(' ::', intent)}{argument.name}{size}"]

    def routine_foot(self, routine: Signature) -> list[str]:
        return [f"end {'subroutine' if _changes(routine) else 'function'} {routine.name}"]

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return self.store(name, text)

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        last = str(int(stop) - 1) if stop.isdigit() else f"{stop} - 1"
        if down:
            return f"do {counter} = {last}, {start}, -1", "end do"
        return f"do {counter} = {start}, {last}{'' if step == 1 else f', {step}'}", "end do"

    def repeated(self, test: str) -> tuple[str, str]:
        return f"do while ({test})", "end do"

    def branch(self, test: str) -> str:
        return f"if ({test}) then"

    def other_branch(self, test: str) -> str:
        return f"else if ({test}) then"

    def returned(self, text: str | None) -> list[str]:
        return ["return"] if text is None else [f"{_RESULT} = {text}", "return"]

    def called(self, routine: Signature, arguments: Sequence[str]) -> tuple[list[str], str]:
        if not _changes(routine):
            return super().called(routine, arguments)
        if routine.result == "none":
            return [], f"call {routine.name}({', '.join(arguments)})"
        result = _TAKEN[routine.result]
        return [f"call {routine.name}({', '.join([*arguments, result])})"], result

    def called_alone(self, text: str) -> list[str]:
        return [text]

    def compared(self, left: str, operator: str, right: str, *, real: bool) -> str:
        """Compare numbers; compilers warn of two real ones that are to be equal."""
        if real and operator in ("==", "!="):
            size = left if right == self.number(Fraction(0)) else f"{left} - ({right})"
            equal = f"abs({size}) <= 0.0_wp"
            return equal if operator == "==" else f".not. ({equal})"
        return super().compared(left, "/=" if operator == "!=" else operator, right, real=real)


def _changes(routine: Signature) -> bool:
    """Tell whether a routine stores numbers of its arguments, which no pure function may."""
    return any(argument.changed for argument in routine.arguments)


def _without_check(function: Function) -> tuple[Step, ...]:
    """The statements before the check of the results, which needs no loop here."""
    return function.body[:-1] if prod(function.shape) else function.body


def _parameters(language: Fortran) -> Iterator[str]:
    yield "!> Parameters, with their values in the scene."
    yield "type :: parameters"
    for p in language.interface.parameters:
        value = "" if p.value is None else f" = {p.value!r}_wp"
        yield from (f"  {line}" for line in language.commented([p.note]))
        yield f"  real(wp) :: {p.identifier}{value}"
    yield "end type parameters"


def _constants(language: Fortran) -> Iterator[str]:
    """Yield the type of the parameters, the initial state and the tables of indices."""
    yield "integer, parameter :: wp = real64"
    yield ""
    yield from _parameters(language)
    initial = language.interface.initial
    if initial is not None:
        values = ", ".join(f"{x!r}_wp" for x in initial)
        yield ""
        yield "!> Initial state."
        yield from language.broken(f"real(wp), parameter :: initial({len(initial)}) = [{values}]")
    yield from recording_lines(language)
    yield from event_constants(language.interface)
    for name, table in language.tables.items():
        values = ", ".join(map(str, table))
        yield from language.broken(f"integer, parameter :: {name}({len(table)}) = [{values}]")


def _module(language: Fortran, steps: Steps) -> str:
    interface = language.interface
    projection, contacts = interface.projection, interface.contacts
    functions = module_functions(language)
    functions += [recorded_text(language)] if interface.recorded else []
    functions += [] if contacts is None else [contacts_text(language, contacts)]
    functions += [] if projection is None else [project_text(language, projection)]
    functions += [switches_text(language)] if interface.switches.names else []
    functions += fixed_step_texts(language, steps)
    integrate = integrate_text(language)
    functions += [indent(text, language.tab) for text in routine_texts(language)]
    names = ["parameters", "integrate", *(f.name for f, _ in interface.functions)]
    names += [*steps.names, *([] if interface.initial is None else ["initial"])]
    names += ["recorded"] if interface.recorded else []
    names += [] if projection is None else ["project"]
    names += ["is_near"] if interface.closed else []
    names += [] if contacts is None else [*contacts.public, "events", "reset", "contact_names"]
    names += ["change", "switch_names"] if interface.switches.names else []
    parts = [
        "\n".join(language.commented(interface.heading)),
        f"module {interface.name}\n"
        "  use, intrinsic :: iso_fortran_env, only: real64"
        f"{', error_unit' if interface.events else ''}\n"
        "  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan"
        f"{', ieee_value, ieee_quiet_nan' if interface.recorded else ''}\n"
        "  implicit none\n  private\n"
        + "\n".join(f"  {x}" for x in language.broken(f"public :: {', '.join(names)}")),
        "\n".join(f"  {line}".rstrip() for line in _constants(language)),
        "contains",
        *functions,
        integrate,
        *helper_functions("".join(functions)),
        f"end module {interface.name}\n",
    ]
    return "\n\n".join(parts)


def emit_fortran(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.f90``; option: ``main``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Fortran.
    InputError
        A constant is outside the range of a double, a recording is too long, or ``main`` is asked
        for where nothing can move.
    """
    if options["main"]:
        require_a_program(equations)
    interface = interface_of(
        equations,
        Fortran.reserved,
        jacobian=bool(options["jacobian"]),
        caseless=True,
        longest=_LONGEST,
    )
    steps = Steps(equations, require_steps(equations, options), step_errors)
    text = _module(Fortran(interface), steps)
    text += f"\n{main_program(interface)}" if options["main"] else ""
    lines = [part for line in text.split("\n") for part in split_line(line)]
    return {f"{file_stem(equations.presentation.name)}.f90": "\n".join(lines)}
