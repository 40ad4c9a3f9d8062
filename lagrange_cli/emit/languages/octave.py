"""Octave and MATLAB: a function that returns functions, in one file.

Functions take t, the state, a structure of parameters, and inputs where there are any; they return
a number, a column or a matrix, of NaN where there is no result. Systems are solved by ``chol`` and
``\\``. A mode is 1 for each closed contact and 0 for each open one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import prod
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.fixed_steps import require_steps
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.module_parts import SCRIPT_TOKENS, Steps
from lagrange_cli.emit.languages.octave_program import (
    contacts_text,
    event_tokens,
    fixed_step_texts,
    moving_tokens,
    project_text,
    quoted_names,
    recorded_text,
    switches_text,
    taken_tokens,
)
from lagrange_cli.emit.languages.printer import (
    FunctionCalled,
    Language,
    module_functions,
)
from lagrange_cli.emit.languages.values import Interface, takes_mode
from lagrange_cli.emit.naming import OCTAVE_RESERVED, file_stem
from lagrange_cli.emit.routines.signatures import SCENE_FUNCTIONS, Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.lowered.functions import Function, Solve

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = f"""
{" ".join(PROGRAM_FUNCTIONS)} t y u p p_values out i j k l given matrix vector columns scales band
multipliers work w main integrate project residual f varargin NaN eps zeros all isfinite isreal
reshape nargin mode recorded reset events switches change step midpoint stepped falls follow found
succeeded
"""

#: Functions of which Octave's own would return complex numbers, or pass over NaN.
_OTHERS = {
    **{name: f"real_{name}" for name in ("sqrt", "log", "asin", "acos", "acosh", "atanh")},
    "pow": "real_power",
    "min": "smaller",
    "max": "larger",
}

#: Arrays that only routines of other languages use.
_SCRATCH = frozenset({"scales", "copy", "defect", "pivots"})

#: Letters of a name that MATLAB tells apart.
_LONGEST = 63


class Octave(Language):
    """Octave, in what it shares with MATLAB."""

    functions: ClassVar = {name: name for name in PROGRAM_FUNCTIONS} | _OTHERS
    reserved: ClassVar = frozenset(_WORDS.split()) | OCTAVE_RESERVED
    comment = "% "
    first = 1
    tab = "  "
    named = "uqvz"
    inputs_last = True
    renamed: ClassVar = {"step": "stepped"}
    continued = " ..."
    words: ClassVar = {**Language.words, "not": "~", "!=": "~="}
    augments = False
    otherwise = "else"
    ended = "end"

    def __init__(self, interface: Interface) -> None:
        super().__init__(interface)
        fields = {f"p{k}": f"p.{p.identifier}" for k, p in enumerate(interface.parameters)}
        self.dialect = replace(self.dialect, names={**self.dialect.names, **fields})

    def function_lines(self, function: Function, documentation: str) -> list[str]:
        self.tables = {}
        return super().function_lines(function, documentation)

    def head(self, function: Function, documentation: str) -> list[str]:
        driven, moded = self.interface.takes_inputs(function), takes_mode(function)
        lines = ["if nargin < 3, p = defaults(); end"]
        values = "recorded(t, t)" if function.name == "inputs" else "inputs(t, y, p)"
        lines += [f"if nargin < 4, u = {values}; end"] if driven else []
        for name, table in self.tables.items():
            lines += self.broken(f"{name} = {_row(map(str, table))};")
        lines.append(f"out = zeros({prod(function.shape)}, 1);")
        return [
            f"function out = {function.name}(t, y, p{', u' * driven}{', mode' * moded})",
            f"% {documentation}",
            *(f"{self.tab}{line}" for line in lines),
        ]

    def inputs_of(self, function: Function) -> list[str]:
        lines = super().inputs_of(function)
        if self.reads_parameters(function):
            fields = [f"p.{p.identifier}" for p in self.interface.parameters]
            lines += self.broken(f"p_values = {_row(fields)};")
        return lines

    def foot(self, function: Function) -> list[str]:
        if len(function.shape) < 2:
            return ["end"]
        rows, columns = function.shape
        return [f"{self.tab}out = reshape(out, {columns}, {rows}).';", "end"]

    def let(self, name: str, text: str) -> str:
        return f"{name} = {text};"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text};"

    def loop(self, counter: str, count: str) -> tuple[str, str]:
        last = str(int(count) - 1) if count.isdigit() else f"{count} - 1"
        return f"for {counter} = 0:{last}", "end"

    def array(self, name: str, size: int) -> list[str]:
        return [] if name in _SCRATCH else [f"{name} = zeros({size}, 1);"]

    def require(self, test: str) -> list[str]:
        return [f"if ~({test}), out(:) = NaN; return; end"]

    def finite(self, count: int) -> list[str]:
        return ["if ~all(isfinite(out)), out(:) = NaN; end"]

    def solve(self, step: Solve) -> list[str]:
        arrays = [_from(a.name, a.index.base) for a in step.arrays[:2]]
        arguments = [*map(str, step.sizes), *(_row(map(str, x)) for x in step.tables[:2]), *arrays]
        solution = step.arrays[1]
        first = solution.index.base
        size = _unknowns(step)
        target = f"{solution.name}({first + 1}:{first + size})"
        lines = self.broken(f"{target} = solve_{step.routine}({', '.join(arguments)});")
        return [*lines, f"if any(isnan({target})), out(:) = NaN; return; end"]

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        driven = [", u" if call.function.driven else "" for call in calls]
        listed = [f"{c.function.name}(t, y, p{u})" for c, u in zip(calls, driven, strict=True)]
        return [f"given = [{'; '.join(listed)}];"]

    def scope(self) -> None:
        return None

    # -- routines: arrays that they change are results ---------------------------------

    def whole_quotient(self, left: str, right: str) -> str:
        return f"floor({left}/{right})"

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        name, passed = self.passed(kind, function, arguments[:-1])
        results = arguments[-1]
        return [f"{results} = {name}({', '.join(passed)});"], f"all(isfinite({results}))"

    def routine_head(self, routine: Signature) -> list[str]:
        names = [
            name
            for a in routine.arguments
            for name in (self.handed(a.kind) if a.kind in SCENE_FUNCTIONS else [a.name])
        ]
        results = [] if routine.result == "none" else ["found"]
        results += [a.name for a in routine.arguments if a.changed]
        head = f"function [{', '.join(results)}] = {routine.name}({', '.join(names)})"
        return [*self.broken(head), *(f"% {line}".rstrip() for line in routine.documentation)]

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return self.store(name, text)

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        last = str(int(stop) - 1) if stop.isdigit() else f"{stop} - 1"
        if down:
            return f"for {counter} = {last}:-1:{start}", "end"
        return f"for {counter} = {start}:{'' if step == 1 else f'{step}:'}{last}", "end"

    def repeated(self, test: str) -> tuple[str, str]:
        return f"while {test}", "end"

    def branch(self, test: str) -> str:
        return f"if {test}"

    def other_branch(self, test: str) -> str:
        return f"elseif {test}"

    def returned(self, text: str | None) -> list[str]:
        return ["return"] if text is None else [f"found = {text};", "return"]

    def called(self, routine: Signature, arguments: Sequence[str]) -> tuple[list[str], str]:
        if not any(argument.changed for argument in routine.arguments):
            return super().called(routine, arguments)
        texts = iter(arguments)
        results = [] if routine.result == "none" else ["succeeded"]
        for argument in routine.arguments:
            is_scene = argument.kind in SCENE_FUNCTIONS
            taken = [next(texts) for _ in (self.handed(argument.kind) if is_scene else [""])]
            results += taken if argument.changed else []
        call = f"[{', '.join(results)}] = {routine.name}({', '.join(arguments)});"
        return self.broken(call), "" if routine.result == "none" else "succeeded"

    def called_alone(self, text: str) -> list[str]:
        return []

    def element_text(self, name: str, index: str) -> str:
        return f"{'p_values' if name == 'p' else name}({index})"


def _unknowns(step: Solve) -> int:
    """Return how many numbers a solution has."""
    if step.routine == "columns":
        return step.sizes[1] * step.sizes[2]
    return step.sizes[0] + (step.sizes[1] if step.routine == "saddle" else 0)


def _from(name: str, first: int) -> str:
    return f"{name}({first + 1}:end)" if first else name


def _row(texts: Sequence[str] | map[str]) -> str:
    return f"[{', '.join(texts)}]"


def _entry(language: Octave, steps: Sequence[str]) -> Iterator[str]:
    """Yield the lines of the function that the file is named after."""
    interface, contacts = language.interface, language.interface.contacts
    switches = interface.switches.names
    states = interface.layout.size
    initial = interface.initial or ["NaN"] * states
    yield f"function varargout = {interface.name}(varargin)"
    yield from language.commented(interface.heading)
    fields = {
        "coordinates": quoted_names([c.name for c in interface.coordinates]),
        **(
            {"states": quoted_names([s.name for s in interface.states])} if interface.states else {}
        ),
        "parameters": quoted_names([p.name for p in interface.parameters]),
        "input_names": quoted_names([u.name for u in interface.inputs]),
        "defaults": "defaults()",
        "initial": f"{_row(map(str, initial))}.'",
        "start": repr(interface.start),
        "until": repr(interface.until),
        **{function.name: f"@{function.name}" for function, _ in interface.functions},
        "integrate": "@integrate",
        **{name: f"@{name}" for name in steps},
        **({} if interface.projection is None else {"project": "@project"}),
        **({"recorded": "@recorded"} if interface.recorded else {}),
        **({} if contacts is None else {"contacts": quoted_names(contacts.names)}),
        **({} if contacts is None else {n: f"@{n}" for n in (*contacts.public, "events", "reset")}),
        **({"change": "@change", "switch_names": quoted_names(switches)} if switches else {}),
    }
    for name, text in fields.items():
        for line in language.broken(f"f.{name} = {text};"):
            yield f"{language.tab}{line}"
    yield from ("  if nargout == 0", "    main(f, varargin);", "  else", "    varargout = {f};")
    yield from ("  end", "end", "")
    yield "function p = defaults()"
    yield "% Parameters, with their values in the scene; NaN where it gives none."
    yield "  p = struct();"
    for p in interface.parameters:
        yield f"  p.{p.identifier} = {'NaN' if p.value is None else repr(p.value)};"
    yield "end"


def _helpers(text: str) -> list[str]:
    """Return the functions that a text calls, with those that these call."""
    helpers = template("octave", "functions.m").rstrip("\n").split("\n\n")
    named = {helper.split("(")[0].split()[-1]: helper for helper in helpers}
    chosen: dict[str, str] = {}
    while more := [
        name for name in named if name not in chosen and re.search(rf"\b{name}\(", text)
    ]:
        chosen |= {name: named[name] for name in more}
        text = "\n".join(chosen.values())
    return [named[name] for name in named if name in chosen]


def emit_octave(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.m``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Octave.
    InputError
        A constant is outside the range of a double, or a recording is too long.
    """
    interface = interface_of(
        equations, Octave.reserved, jacobian=bool(options["jacobian"]), longest=_LONGEST
    )
    language = Octave(interface)
    projection, contacts = interface.projection, interface.contacts
    functions = module_functions(language)
    # Systems are solved by functions of the file, whatever routines there are.
    language.routines = set()
    functions += [recorded_text(language)] if interface.recorded else []
    functions += [] if contacts is None else [contacts_text(language, contacts)]
    functions += [switches_text(language)] if interface.switches.names else []
    functions += [] if projection is None else [project_text(interface, projection)]
    values = "inputs(s, x, p, recorded(s, t + h/2))" if interface.recorded else ""
    values = values or ("inputs(s, x, p)" if interface.inputs else "")
    led = "inputs(t + h, y, p), " if contacts and interface.inputs else ""
    begun = template("octave", "begin.m") if interface.closed else ""
    begun = filled(begun, moving_tokens(interface))
    begun += template("octave", "begin_contacts.m") if contacts else ""
    begun = begun.replace("@C@", str(contacts.count if contacts else 0))
    begun += template("octave", "begin_switches.m") if interface.switches.names else ""
    begun += template("octave", "begin_events.m") if interface.events else ""
    language.routines |= {"advance"} if interface.events else set()
    steps = Steps(equations, require_steps(equations, options), step_errors)
    functions += fixed_step_texts(language, steps)
    integrate = "integrate_events" if interface.events else "integrate"
    more = (", mode" if contacts else "") + (", largest" if interface.events else "")
    tokens = {
        "@INTEGRATE@": template("octave", f"{integrate}.m").rstrip("\n"),
        "@BEGUN@": begun,
        "@GIVEN@": f", {values}" if values else "",
        "@STEPS@": str(interface.steps),
        "@ROWS@": str(interface.rows),
        "@PROJECTED@": f"  y = project(t + h, y, p{f', {led}'.rstrip(', ') if led else ''}@IN@);\n"
        if projection
        else "",
        "@Y@": f"[y{more}]" if more else "y",
        "@MORE@": more,
        "@STATES@": ", f.states" if interface.states else "",
        "@SIZE@": str(interface.layout.size),
        "@N@": str(len(interface.coordinates)),
        **event_tokens(interface),
        **SCRIPT_TOKENS,
        **taken_tokens(interface),
    }
    script = filled(template("octave", "script.m"), tokens).rstrip("\n")
    functions += routine_texts(language)
    parts = [
        "\n".join(_entry(language, steps.names)),
        *functions,
        script,
        *_helpers("\n".join(functions)),
    ]
    stem = file_stem(equations.presentation.name, OCTAVE_RESERVED)
    return {f"{stem}.m": "\n\n".join(parts) + "\n"}
