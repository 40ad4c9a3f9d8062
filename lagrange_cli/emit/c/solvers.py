"""Static helpers of emitted C: functions that ``<math.h>`` lacks, eliminations, tables of indices.

Indices of loops that do not advance evenly are looked up in static arrays of the source file, which
functions share.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from typing import ClassVar

from lagrange_cli.emit.c.target import EPSILON_NAME, CTarget, wrapped
from lagrange_cli.emit.routines.signatures import (
    SCENE_FUNCTIONS,
    Argument,
    Signature,
    routines_called,
)
from lagrange_cli.emit.routines.syntax import Syntax
from lagrange_cli.emit.routines.translation import routine_text
from lagrange_cli.emit.template_files import c_template
from lagrange_cli.program.graph.operands import Coefficient
from lagrange_cli.program.program import Program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.program.solvers.sparse_factorization import BandFactors
from lagrange_cli.program.systems.loops import SparseSolve, Total, table_name, tables_of

#: Functions that ``<math.h>`` lacks.
_HELPERS = ("sign", "min", "max")


def helper_text(used: Collection[str], target: CTarget) -> str:
    """Return definitions of the helpers among the functions that are used."""
    return "\n".join(target.fill(c_template(name)) for name in _HELPERS if name in used)


def solver_text(blocks: Sequence[MatrixBlock], programs: Iterable[Program], target: CTarget) -> str:
    """Write the bound for pivots and the routines that programs call.

    Parameters
    ----------
    blocks
        The systems that the right-hand sides solve.
    """
    parts = []
    if any((b.definite and b.size > 1 and not b.exact) or b.closures for b in blocks):
        parts.append(
            "/* A pivot below this multiple of its diagonal entry is rounding error. */\n"
            f"#define {target.prefix}_{EPSILON_NAME} {target.real.literal(target.real.epsilon)}\n"
        )
    names = sorted({*_of_blocks(blocks), *_of_programs(programs)})
    called = {called.name for routine in routines_called(names) for called in routine.called}
    parts += [target.fill(c_template(name)) for name in _BORROWED if name in called]
    return "\n".join([*parts, *routine_texts(names, target)])


def routine_texts(names: Iterable[str], target: CTarget) -> list[str]:
    """Write routines as static functions, those first that others call."""
    routines = [r for r in routines_called(names) if r.name not in _BORROWED]
    return [f"{routine_text(routine, _RoutineSyntax(target))}\n" for routine in routines]


#: Routines that ``<math.h>`` makes short.
_BORROWED = ("power_of_two", "root_scale_of", "scale_of")


def _of_blocks(blocks: Sequence[MatrixBlock]) -> Iterator[str]:
    for block in blocks:
        if block.band is not None:
            yield "banded"
        elif not block.unrolled:
            yield "definite" if block.definite else "saddle" if block.closures else "pivoted"


def _of_programs(programs: Iterable[Program]) -> Iterator[str]:
    for program in programs:
        if program.jacobian is not None and program.jacobian.blocks:
            yield "columns"
        for part in program.parts:
            if isinstance(part, SparseSolve):
                yield "banded" if isinstance(part.factors, BandFactors) else "sparse"


#: Constants of routines that are not below the rounding of a short type.
_TOLERANCES = ("RATE_TOLERANCE", "LEAST_PIVOT")

#: Constants of routines that are multiples of the rounding of the type.
_UNITS = ("NOISE", "LAST_PLACE", "SETTLED")

#: Functions of the scene that read no flags of contacts.
_WITHOUT_FLAGS = ("flight_rhs", "rhs")


class _RoutineSyntax(Syntax):
    """Routines as static functions of C, whose results 1 and 0 are those of tests."""

    words: ClassVar = {**Syntax.words, "True": "1", "False": "0"}

    def __init__(self, target: CTarget) -> None:
        self.target = target
        self.routines, self.numeric = set(), set()
        number = target.real.name
        self._types = {"int": "int", "bool": "int", "none": "void", "real": number}
        self._types |= {"reals": f"{number} *", "integers": "int *"}

    def number(self, value: Coefficient) -> str:
        return self.target.real.literal(value)

    def callee(self, function: str) -> str:
        return self.target.functions[function]

    def constant(self, name: str, value: float) -> str:
        """Return a constant; a tolerance is no less than the number type's rounding asks for."""
        if name == EPSILON_NAME:
            return f"{self.target.prefix}_{EPSILON_NAME}"
        real, epsilon = self.target.real, float(self.target.real.epsilon)
        if name in _UNITS:
            return real.value(value / 2.0**-53 * epsilon)
        return real.value(max(value, 64.0 * epsilon) if name in _TOLERANCES else value)

    def counted(self, index: str) -> str:
        return f"({self.target.real.name}){index}"

    def remark(self, text: str) -> str:
        return f"/* {text} */"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text};"

    def routine_head(self, routine: Signature) -> list[str]:
        result = self._types[routine.result]
        arguments = ", ".join(
            self.target.handed(argument.kind)
            if argument.kind in SCENE_FUNCTIONS
            else self._argument(argument)
            for argument in routine.arguments
        )
        head = f"static {result} {self.target.prefix}_{routine.name}({arguments})"
        documentation = (f" * {line}".rstrip() for line in routine.documentation)
        return ["/*", *documentation, " */", *wrapped(head, 0, 2), "{"]

    def _argument(self, argument: Argument) -> str:
        text = self._types[argument.kind]
        if not text.endswith("*"):
            return f"{text} {argument.name}"
        return f"{'' if argument.changed else 'const '}{text}{argument.name}"

    def handed(self, kind: str) -> list[str]:
        if kind == "dynamics":
            return ["u", "p", "work", "status"]
        return ["p", "status"] if kind == "motion" else ["t", "u", "p", "work"]

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        names, flags = self.target.names, ""
        if kind == "motion":
            *moments, mode, results = arguments
            named = {"step": "moved"}.get(function, function)
            call = f"{names.prefix}_{named}({', '.join(moments)}, p, {mode}, {results})"
            return [], f"((*status = {call}) == 0)"
        if kind == "dynamics":
            time, state, results = arguments
            call = f"{names.prefix}_{function}({time}, {state}, u, p, work, {results})"
            return [], f"((*status = {call}) == 0)"
        state, *_, results = arguments
        if names.contact_from is None:
            function = function.removeprefix("flight_")
        elif function not in _WITHOUT_FLAGS:
            flags = "mode, "
        passed = f"t, {state}, u, p, {flags}work, {results}"
        return [], f"({names.prefix}_{function}({passed}) == 0)"

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return f"{'const ' if fixed else ''}{self._types[kind]} {name} = {text};"

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        first, test, change = f"int {counter} = {start}", f"{counter} < {stop}", f"++{counter}"
        if down:
            first, test = f"int {counter} = {stop} - 1", f"{counter} >= {start}"
            change = f"--{counter}"
        elif step > 1:
            change = f"{counter} += {step}"
        return f"for ({first}; {test}; {change}) {{", self.ended

    def called(self, routine: Signature, arguments: Sequence[str]) -> tuple[list[str], str]:
        return [], f"{self.target.prefix}_{routine.name}({', '.join(arguments)})"


def loop_helpers(programs: Mapping[str, Program], target: CTarget) -> str:
    """Write what the loops of a source file need beside solvers: sums and tables."""
    parts = [part for program in programs.values() for part in program.parts]
    texts = []
    if any(isinstance(part, Total) for part in parts):
        texts.append(target.fill(c_template("total")))
    tables = dict.fromkeys(t for program in programs.values() for t in tables_of(program.parts))
    texts += [_table_text(target.prefix, table) for table in tables]
    return "\n".join(filter(None, texts))


def _table_text(prefix: str, table: tuple[int, ...]) -> str:
    rows = wrapped(", ".join(map(str, table)), 1, 0)
    name = table_name(prefix, table)
    return "\n".join([f"static const int {name}[] = {{", *rows, "};", ""])
