"""Octave and MATLAB: a function that returns functions, in one file.

Functions take t, the state, a structure of parameters, and inputs where there are any; they return
a number, a column or a matrix, of NaN where there is no result. Systems are solved by ``chol`` and
``\\``. A mode is 1 for each closed contact and 0 for each open one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite, prod
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.printer import (
    SCRIPT_TOKENS,
    FunctionCalled,
    Language,
    contact_tokens,
    module_functions,
)
from lagrange_cli.emit.languages.values import Contacts, Interface, Projection, takes_mode
from lagrange_cli.emit.naming import OCTAVE_RESERVED, comment_text, file_stem
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
reshape nargin mode recorded reset events step falls follow found succeeded
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
    motion: ClassVar = {}
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


def _names(names: Sequence[str]) -> str:
    quoted = (comment_text(name).replace("'", "''") for name in names)
    return "{" + ", ".join(f"'{name}'" for name in quoted) + "}"


def _entry(language: Octave) -> Iterator[str]:
    """Yield the lines of the function that the file is named after."""
    interface, contacts = language.interface, language.interface.contacts
    states = interface.layout.size
    initial = interface.initial or ["NaN"] * states
    yield f"function varargout = {interface.name}(varargin)"
    yield from language.commented(interface.heading)
    fields = {
        "coordinates": _names([c.name for c in interface.coordinates]),
        **({"states": _names([s.name for s in interface.states])} if interface.states else {}),
        "parameters": _names([p.name for p in interface.parameters]),
        "input_names": _names([u.name for u in interface.inputs]),
        "defaults": "defaults()",
        "initial": f"{_row(map(str, initial))}.'",
        "start": repr(interface.start),
        "until": repr(interface.until),
        **{function.name: f"@{function.name}" for function, _ in interface.functions},
        "integrate": "@integrate",
        **({} if interface.projection is None else {"project": "@project"}),
        **({"recorded": "@recorded"} if interface.recorded else {}),
        **({} if contacts is None else {"contacts": _names(contacts.names)}),
        **({} if contacts is None else {n: f"@{n}" for n in (*contacts.public, "events", "reset")}),
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


def _taken(interface: Interface) -> dict[str, str]:
    """Return the tokens of arguments for inputs and mode, and of their defaults."""
    contacts, driven = interface.contacts, bool(interface.inputs)
    count = 0 if contacts is None else contacts.count
    defaults = ["  if nargin < 3, p = defaults(); end"]
    defaults += ["  if nargin < 4, u = inputs(t, y, p); end"] if driven else []
    moded = f"  if nargin < {4 + driven}, mode = zeros({count}, 1); end"
    return {
        "@U@": ", u" if driven else "",
        "@IN@": ", mode" if contacts else "",
        "@DEFAULTS@": "\n".join([*defaults, *([moded] if contacts else [])]),
        "@NOW@": ", inputs(t, y, p)" if driven else "",
    }


def _project(interface: Interface, projection: Projection) -> str:
    """Return the function that leads a state back to the closures."""
    tokens = {
        "@POSITIONS@": template("octave", "positions.m") if projection.positions else "",
        "@HALF@": str(len(interface.coordinates)) if interface.states else "numel(y)/2",
        "@END@": "2*n" if interface.states else "end",
        "@OF@": "contact_" if interface.contacts else "",
        **_taken(interface),
    }
    return filled(template("octave", "project.m"), tokens).rstrip("\n")


def _moving(interface: Interface) -> dict[str, str]:
    """Return texts of the positions and velocities in a state."""
    n = len(interface.coordinates)
    if not interface.states:
        return {"@MOVING@": "", "@LED@": "y", "@PLACES@": "n/2"}
    moving = f"  stated = stated(1:{2 * n});\n"
    return {"@MOVING@": moving, "@LED@": f"y(1:{2 * n})", "@PLACES@": str(n)}


def _recorded(language: Octave) -> str:
    """Return the function that evaluates recorded inputs."""
    interface, lines = language.interface, []
    language.routines.add("interpolated")
    for r in interface.recorded:
        test = f"t >= {r.first!r}{f' && t <= {r.last!r}' if isfinite(r.last) else ''}"
        rows = [
            ", ".join(map(repr, r.table[k : k + r.width])) for k in range(0, len(r.table), r.width)
        ]
        lines += [
            f"% {r.text}: starts, each with coefficients behind it.",
            f"if {test}",
            "  table = [",
        ]
        lines += [*(f"    {row}, ..." for row in rows), "  ];"]
        call = f"interpolated({r.rows}, {r.width}, table, t, at)"
        lines += [f"  u({r.number + 1}) = {call};", "end"]
    tokens = {"@INPUTS@": str(len(interface.inputs)), "@TESTS@": "\n".join(f"  {x}" for x in lines)}
    return filled(template("octave", "recorded.m"), tokens).rstrip("\n")


def _contacts(language: Octave, contacts: Contacts) -> str:
    """Return the functions of the interface that take a mode."""
    language.routines.add("advance")
    arrays = language.interface.reset_arrays.values()
    tokens = {
        **contact_tokens(language),
        "@ARRAYS@": "\n    ".join(language.broken(", ".join(f"zeros({k},1)" for k in arrays))),
        **_taken(language.interface),
    }
    return filled(template("octave", "contacts.m"), tokens).rstrip("\n")


def emit_octave(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
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
    functions += [_recorded(language)] if interface.recorded else []
    functions += [] if contacts is None else [_contacts(language, contacts)]
    functions += [] if projection is None else [_project(interface, projection)]
    values = "inputs(s, x, p, recorded(s, t + h/2))" if interface.recorded else ""
    values = values or ("inputs(s, x, p)" if interface.inputs else "")
    led = "inputs(t + h, y, p), " if contacts and interface.inputs else ""
    begun = template("octave", "begin.m") if interface.closed else ""
    begun = filled(begun, _moving(interface))
    begun += template("octave", "begin_contacts.m") if contacts else ""
    integrate = "integrate_contacts" if contacts else "integrate"
    tokens = {
        "@INTEGRATE@": template("octave", f"{integrate}.m").rstrip("\n"),
        "@BEGUN@": begun,
        "@GIVEN@": f", {values}" if values else "",
        "@STEPS@": str(interface.steps),
        "@ROWS@": str(interface.rows),
        "@PROJECTED@": f"  y = project(t + h, y, p{f', {led}'.rstrip(', ') if led else ''}@IN@);\n"
        if projection
        else "",
        "@Y@": "[y, mode, largest]" if contacts else "y",
        "@MORE@": ", mode, largest" if contacts else "",
        "@STATES@": ", f.states" if interface.states else "",
        "@SIZE@": str(interface.layout.size),
        "@N@": str(len(interface.coordinates)),
        "@C@": str(contacts.count if contacts else 0),
        "@TWICE@": str(2 * contacts.count if contacts else 0),
        **SCRIPT_TOKENS,
        "@CONTACTS@": _names(contacts.names) if contacts else "",
        **_taken(interface),
    }
    script = filled(template("octave", "script.m"), tokens).rstrip("\n")
    functions += routine_texts(language)
    parts = ["\n".join(_entry(language)), *functions, script, *_helpers("\n".join(functions))]
    stem = file_stem(equations.presentation.name, OCTAVE_RESERVED)
    return {f"{stem}.m": "\n\n".join(parts) + "\n"}
