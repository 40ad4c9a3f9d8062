"""Octave and MATLAB: a function that returns functions, in one file.

Functions take t, the state, a structure of parameters, and inputs where there are any; they return
a number, a column or a matrix, of NaN where there is no result. Systems are solved by ``chol`` and
``\\``.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import prod
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.languages.interface import Interface, Projection, interface_of
from lagrange_cli.emit.languages.printer import FunctionCalled, Language
from lagrange_cli.emit.naming import OCTAVE_RESERVED, comment_text, file_stem
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.lowered.functions import Function, Solve, names_read

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = f"""
{" ".join(PROGRAM_FUNCTIONS)} t y u p p_values out i j k l given matrix vector columns scales band
multipliers work w main integrate project residual f varargin NaN eps zeros all isfinite isreal
reshape nargin
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
    continued = " ..."

    def __init__(self, interface: Interface) -> None:
        super().__init__(interface)
        fields = {f"p{k}": f"p.{p.identifier}" for k, p in enumerate(interface.parameters)}
        self.dialect = replace(self.dialect, names={**self.dialect.names, **fields})

    def function_lines(self, function: Function, documentation: str) -> list[str]:
        self.tables = {}
        return super().function_lines(function, documentation)

    def head(self, function: Function, documentation: str) -> list[str]:
        driven = bool(function.driven) and function.name != "inputs"
        lines = ["if nargin < 3, p = defaults(); end"]
        lines += ["if nargin < 4, u = inputs(t, y, p); end"] if driven else []
        for name, table in self.tables.items():
            lines += self.broken(f"{name} = {_row(map(str, table))};")
        lines.append(f"out = zeros({prod(function.shape)}, 1);")
        return [
            f"function out = {function.name}(t, y, p{', u' * driven})",
            f"% {documentation}",
            *(f"{self.tab}{line}" for line in lines),
        ]

    def inputs_of(self, function: Function) -> list[str]:
        lines = super().inputs_of(function)
        if "p" in names_read(function.body):
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
    interface = language.interface
    states = interface.layout.size
    initial = interface.initial or ["NaN"] * states
    yield f"function f = {interface.name}(varargin)"
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
    }
    for name, text in fields.items():
        for line in language.broken(f"f.{name} = {text};"):
            yield f"{language.tab}{line}"
    yield from ("  if nargout == 0", "    main(f, varargin);", "    clear f", "  end", "end", "")
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


def _project(interface: Interface, projection: Projection) -> str:
    """Return the function that leads a state back to the closures."""
    default = "  if nargin < 4, u = inputs(t, y, p); end\n"
    tokens = {
        "@POSITIONS@": template("octave", "positions.m") if projection.positions else "",
        "@INPUTS@": default if projection.driven else "",
        "@U@": ", u" if projection.driven else "",
        "@HALF@": str(len(interface.coordinates)) if interface.states else "numel(y)/2",
        "@END@": "2*n" if interface.states else "end",
    }
    return filled(template("octave", "project.m"), tokens).rstrip("\n")


def _moving(interface: Interface) -> dict[str, str]:
    """Return texts of the positions and velocities in a state."""
    n = len(interface.coordinates)
    if not interface.states:
        return {"@MOVING@": "", "@LED@": "y", "@PLACES@": "n/2"}
    moving = f"  stated = stated(1:{2 * n});\n"
    return {"@MOVING@": moving, "@LED@": f"y(1:{2 * n})", "@PLACES@": str(n)}


def emit_octave(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
    """``NAME.m``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in Octave.
    InputError
        A constant is outside the range of a double, or the scene has contacts or recordings.
    """
    interface = interface_of(
        equations,
        "octave",
        Octave.reserved,
        jacobian=bool(options["jacobian"]),
        longest=_LONGEST,
    )
    language = Octave(interface)
    projection = interface.projection
    inner = () if projection is None else projection.functions
    functions = [
        "\n".join(language.function_lines(*pair)) for pair in (*interface.functions, *inner)
    ]
    functions += [] if projection is None else [_project(interface, projection)]
    tokens = {
        "@STEPS@": str(interface.steps),
        "@ROWS@": str(interface.rows),
        "@PROJECTED@": "    y = project(s + h, y, p);\n" if projection else "",
        "@BEGUN@": filled(template("octave", "begin.m"), _moving(interface)) if projection else "",
        "@STATES@": ", f.states" if interface.states else "",
    }
    script = filled(template("octave", "script.m"), tokens).rstrip("\n")
    parts = ["\n".join(_entry(language)), *functions, script, *_helpers("\n".join(functions))]
    stem = file_stem(equations.presentation.name, OCTAVE_RESERVED)
    return {f"{stem}.m": "\n\n".join(parts) + "\n"}
