"""JavaScript: an ES module for browsers and Node.js, without dependencies.

Functions return new arrays of 64-bit numbers, NaN where there is no result.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.languages.interface import Projection, interface_of
from lagrange_cli.emit.languages.printer import FunctionCalled, Language
from lagrange_cli.emit.naming import file_stem
from lagrange_cli.emit.routines.signatures import Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.emitted_functions import INTERNAL_FUNCTIONS
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.lowered.functions import Function, Solve

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = """
arguments await break case catch class const continue debugger default delete do else enum eval
export extends false finally for function if implements import in instanceof interface let new null
package private protected public return static super switch this throw true try typeof undefined var
void while with yield NaN Infinity Math Number Float64Array Object Array console process globalThis
t y p u out i j k l given project violation led change RESIDUALS
matrix vector columns scales band multipliers work w
COORDINATES PARAMETERS INPUTS DEFAULTS INITIAL START UNTIL ROWS STEPS integrate main name async of
get set
"""


class JavaScript(Language):
    """JavaScript, as ECMAScript 2015 has it."""

    functions: ClassVar = {name: f"Math.{name}" for name in PROGRAM_FUNCTIONS}
    reserved: ClassVar = frozenset(_WORDS.split())
    tab = "  "

    def head(self, function: Function, documentation: str) -> list[str]:
        driven = ", u = inputs(t, y, p)" if function.driven and function.name != "inputs" else ""
        size = 1
        for length in function.shape:
            size *= length
        exported = "" if function.name in INTERNAL_FUNCTIONS else "export "
        return [
            f"/** {documentation} */",
            f"{exported}function {function.name}(t, y, p = DEFAULTS{driven}) {{",
            f"{self.tab}const out = new Float64Array({size});",
        ]

    def foot(self, function: Function) -> list[str]:
        return [f"{self.tab}return out{'' if function.shape else '[0]'};", "}"]

    def let(self, name: str, text: str) -> str:
        return f"const {name} = {text};"

    def store(self, target: str, text: str) -> str:
        return f"{target} = {text};"

    def loop(self, counter: str, count: str) -> tuple[str, str]:
        return f"for (let {counter} = 0; {counter} < {count}; ++{counter}) {{", "}"

    def array(self, name: str, size: int) -> list[str]:
        return [f"const {name} = new Float64Array({size});"]

    def require(self, test: str) -> list[str]:
        return [f"if (!({test})) return out.fill(NaN);"]

    def finite(self, count: int) -> list[str]:
        return ["if (!out.every(Number.isFinite)) return out.fill(NaN);"]

    def solve(self, step: Solve) -> list[str]:
        arrays = [f"{a.name}.subarray({a.index.base})" for a in step.arrays]
        arguments = ", ".join([*map(str, step.sizes), *map(self.table, step.tables), *arrays])
        return [f"if (!solve_{step.routine}({arguments})) return out.fill(NaN);"]

    def call_results(self, calls: Sequence[FunctionCalled]) -> list[str]:
        driven = [", u" if call.function.driven else "" for call in calls]
        listed = [f"...{c.function.name}(t, y, p{u})" for c, u in zip(calls, driven, strict=True)]
        return [f"const given = [{', '.join(listed)}];"]

    @property
    def inputs_of_closures(self) -> str:
        """The last argument of functions of closures, if any of them reads inputs."""
        projection = self.interface.projection
        return ", u" if projection is not None and projection.driven else ""

    def evaluated(self, function: str, y: str, results: str) -> tuple[list[str], str]:
        stored = f"{results}.set({function}(t, {y}, p{self.inputs_of_closures}));"
        return [stored], f"{results}.every(Number.isFinite)"

    def routine_head(self, routine: Signature) -> list[str]:
        names = {argument.name: argument.name for argument in routine.arguments}
        if "closures" in names:
            names["closures"] = f"t, p{self.inputs_of_closures}"
        documentation = (f" * {line}".rstrip() for line in routine.documentation)
        return [
            "/**",
            *documentation,
            " */",
            f"function {routine.name}({', '.join(names.values())}) {{",
        ]

    def declared(self, name: str, kind: str, text: str, *, fixed: bool) -> str:
        return f"{'const' if fixed else 'let'} {self.store(name, text)}"

    def counting(
        self, counter: str, start: str, stop: str, *, step: int = 1, down: bool = False
    ) -> tuple[str, str]:
        if down:
            head = f"for (let {counter} = {stop} - 1; {counter} >= {start}; --{counter}) {{"
        else:
            advance = f"++{counter}" if step == 1 else f"{counter} += {step}"
            head = f"for (let {counter} = {start}; {counter} < {stop}; {advance}) {{"
        return head, self.ended


#: Names of the states of first order in those of a state.
_STATES = ", ...STATES"


def emit_javascript(equations: Equations, options: Mapping[str, str | bool]) -> dict[str, str]:
    """``NAME.mjs``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in JavaScript.
    InputError
        A constant is outside the range of a double, or the scene has contacts or recordings.
    """
    interface = interface_of(
        equations, "javascript", JavaScript.reserved, jacobian=bool(options["jacobian"])
    )
    language = JavaScript(interface)
    projection = interface.projection
    inner = () if projection is None else projection.functions
    functions = [
        "\n".join(language.function_lines(function, text))
        for function, text in (*interface.functions, *inner)
    ]
    projected = "" if projection is None else _projection(language, projection)
    constants = {
        "COORDINATES": [c.name for c in interface.coordinates],
        **({"STATES": [s.name for s in interface.states]} if interface.states else {}),
        "PARAMETERS": [p.name for p in interface.parameters],
        "INPUTS": [u.name for u in interface.inputs],
        "DEFAULTS": [p.value for p in interface.parameters],
        "INITIAL": interface.initial,
        "START": interface.start,
        "UNTIL": interface.until,
        "ROWS": interface.rows,
        "STEPS": interface.steps,
    }
    stated = [f"export const {name} = {json.dumps(value)};" for name, value in constants.items()]
    script = filled(
        template("javascript", "script.mjs"),
        {
            "@STEPPED@": "    y = project(s + h, y, p);\n" if projected else "",
            "@BEGUN@": template("javascript", "begin.mjs") if projected else "",
            "@STATES@": _STATES if interface.states else "",
        },
    )
    tables = [
        "\n".join(language.broken(f"const {name} = [{', '.join(map(str, table))}];"))
        for name, table in language.tables.items()
    ]
    parts = [
        "\n".join(language.commented(interface.heading)),
        "\n".join(stated),
        *tables,
        *routine_texts(language),
        *functions,
        *filter(None, [projected]),
        script,
    ]
    return {f"{file_stem(equations.presentation.name)}.mjs": "\n\n".join(parts)}


def _projection(language: JavaScript, projection: Projection) -> str:
    """Return ``project`` and the check of a start."""
    m, positions = projection.closures, projection.positions
    language.routines |= {"lead_velocities", "is_near"} | (
        {"lead_positions"} if positions else set()
    )
    driven = language.inputs_of_closures
    first = f"{template('javascript', 'positions.mjs').rstrip()} " if positions else ""
    replacements = {
        "@POSITIONS@": first,
        "@M@": str(positions),
        "@N@": str(len(language.interface.coordinates)),
        "@CLOSURES@": str(m),
        "@RESIDUALS@": json.dumps(projection.residuals),
        "@U@": driven,
        "@INPUTS@": f"{driven} = inputs(t, y, p)" if driven else "",
        "@STATES@": _STATES if language.interface.states else "",
    }
    return filled(template("javascript", "project.mjs"), replacements)
