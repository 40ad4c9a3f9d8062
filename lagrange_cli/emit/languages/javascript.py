"""JavaScript: an ES module for browsers and Node.js, without dependencies.

Functions return new arrays of 64-bit numbers, NaN where there is no result.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import TYPE_CHECKING, ClassVar

from lagrange_cli.emit.fixed_steps import FixedStep, require_steps
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.emit.languages.module_parts import (
    SCRIPT_TOKENS,
    Steps,
    contact_tokens,
    step_texts,
    switch_tokens,
)
from lagrange_cli.emit.languages.printer import (
    FunctionCalled,
    Language,
    module_functions,
)
from lagrange_cli.emit.languages.values import Interface, takes_mode
from lagrange_cli.emit.naming import file_stem
from lagrange_cli.emit.routines.signatures import SCENE_FUNCTIONS, Signature
from lagrange_cli.emit.routines.translation import routine_texts
from lagrange_cli.emit.template_files import event_lines, filled, template
from lagrange_cli.program.graph.operands import PROGRAM_FUNCTIONS
from lagrange_cli.program.lowered.functions import Function, Solve

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

_WORDS = """
arguments await break case catch class const continue debugger default delete do else enum eval
export extends false finally for function if implements import in instanceof interface let new null
package private protected public return static super switch this throw true try typeof undefined var
void while with yield NaN Infinity Math Number Float64Array Object Array console process globalThis
t y p u mode out i j k l given project violation led change RESIDUALS CONTACTS FLIGHT RECORDINGS
matrix vector columns scales band multipliers work w
COORDINATES PARAMETERS INPUTS DEFAULTS INITIAL START UNTIL ROWS STEPS main name async of
integrate recorded events switches change step midpoint stepped falls follow PLACES SWITCHES
get set
"""


class JavaScript(Language):
    """JavaScript, as ECMAScript 2015 has it."""

    functions: ClassVar = {name: f"Math.{name}" for name in PROGRAM_FUNCTIONS}
    reserved: ClassVar = frozenset(_WORDS.split())
    tab = "  "
    inputs_last = True
    renamed: ClassVar = {"step": "stepped"}

    def head(self, function: Function, documentation: str) -> list[str]:
        further = ""
        if self.interface.takes_inputs(function):
            values = "recorded(t)" if function.name == "inputs" else "inputs(t, y, p)"
            further = f", u = {values}"
        further += ", mode" if takes_mode(function) else ""
        size = 1
        for length in function.shape:
            size *= length
        exported = "" if self.is_inner(function) else "export "
        return [
            f"/** {documentation} */",
            f"{exported}function {function.name}(t, y, p = DEFAULTS{further}) {{",
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

    def evaluated(
        self, kind: str, function: str, arguments: Sequence[str]
    ) -> tuple[list[str], str]:
        name, passed = self.passed(kind, function, arguments[:-1])
        results = arguments[-1]
        stored = f"{results}.set({name}({', '.join(passed)}));"
        return [stored], f"{results}.every(Number.isFinite)"

    def whole_quotient(self, left: str, right: str) -> str:
        return f"Math.floor({left} / {right})"

    def routine_head(self, routine: Signature) -> list[str]:
        names = [
            name
            for a in routine.arguments
            for name in (self.handed(a.kind) if a.kind in SCENE_FUNCTIONS else [a.name])
        ]
        documentation = (f" * {line}".rstrip() for line in routine.documentation)
        head = self.broken(f"function {routine.name}({', '.join(names)}) {{")
        return ["/**", *documentation, " */", *head]

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


def emit_javascript(
    equations: Equations,
    options: Mapping[str, str | bool],
    step_errors: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """``NAME.mjs``.

    Raises
    ------
    InternalError
        An expression holds something without counterpart in JavaScript.
    InputError
        A constant is outside the range of a double, or a recording is too long.
    """
    interface = interface_of(equations, JavaScript.reserved, jacobian=bool(options["jacobian"]))
    language = JavaScript(interface)
    functions = module_functions(language)
    around = [_recorded(language), _projection(language), _contacts(language)]
    around.append(_switches(language))
    steps = Steps(equations, require_steps(equations, options), step_errors)
    around += _fixed_steps(language, steps)
    script = _script(language)
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
        *filter(None, around),
        script,
    ]
    return {f"{file_stem(equations.presentation.name)}.mjs": "\n\n".join(parts)}


def _recorded(language: JavaScript) -> str:
    """Return the tables of recorded inputs, and the function that evaluates them."""
    interface = language.interface
    if not interface.recorded:
        return ""
    language.routines.add("interpolated")
    lines = [
        "/** Recorded inputs: rows of a time and the coefficients of a polynomial since then. */"
    ]
    lines.append("const RECORDINGS = [")
    for recorded in interface.recorded:
        values: dict[str, float] = {"number": recorded.number, "width": recorded.width}
        values |= {"first": recorded.first, "last": recorded.last}
        stated = ", ".join(f"{name}: {json.dumps(value)}" for name, value in values.items())
        numbers = language.broken(f"[{', '.join(map(repr, recorded.table))}],")
        lines += [f"  // {recorded.text}", f"  {{ {stated}, table:"]
        lines += [*(f"    {line}" for line in numbers), "  },"]
    text = template("javascript", "recorded.mjs").replace("@INPUTS@", str(len(interface.inputs)))
    return "\n".join([*lines, "];", "", text.rstrip()])


def _projection(language: JavaScript) -> str:
    """Return ``project`` and, where there are closures, the check of a start."""
    interface = language.interface
    projection = interface.projection
    if projection is None:
        return ""
    language.routines |= {"lead_velocities"} | ({"is_near"} if interface.closed else set())
    language.routines |= {"lead_positions"} if projection.positions else set()
    first = f"{template('javascript', 'positions.mjs').rstrip()} " if projection.positions else ""
    replacements = {
        "@POSITIONS@": first,
        "@HANDED@": ", ".join(language.handed("closures")),
        "@M@": str(projection.positions),
        "@N@": str(len(interface.coordinates)),
        "@CLOSURES@": str(projection.closures),
        "@RESIDUALS@": json.dumps(projection.residuals),
        "@STATES@": _STATES if interface.states else "",
        **_arguments(interface),
    }
    text = filled(template("javascript", "project.mjs"), replacements)
    checked = filled(template("javascript", "violation.mjs"), replacements)
    return "\n\n".join([text.rstrip(), *([checked] if interface.closed else [])])


def _arguments(interface: Interface) -> dict[str, str]:
    """Return the tokens of arguments behind the parameters, and of the inputs at a time."""
    driven = bool(interface.inputs)
    return {
        "@U@": ", u" if driven else "",
        "@INPUTS@": ", u = inputs(t, y, p)" if driven else "",
        "@NOW@": ", inputs(t, y, p)" if driven else "",
        "@MODE@": ", mode = FLIGHT" if interface.contacts else "",
        "@IN@": ", mode" if interface.contacts else "",
    }


def _contacts(language: JavaScript) -> str:
    """Return the functions of the interface that take a mode."""
    interface, contacts = language.interface, language.interface.contacts
    if contacts is None:
        return ""
    replacements = {
        **contact_tokens(language),
        "@CONTACTS@": json.dumps(contacts.names),
        "@FLIGHT@": json.dumps([0] * contacts.count),
        "@SIZES@": json.dumps([*language.interface.reset_arrays.values()]),
        **_arguments(interface),
    }
    return filled(template("javascript", "contacts.mjs"), replacements).rstrip()


def _switches(language: JavaScript) -> str:
    """Return the function that changes states with two values, and their names."""
    if not language.interface.switches.names:
        return ""
    replacements = {
        "@NAMES@": json.dumps(language.interface.switches.names),
        **switch_tokens(language),
        **_arguments(language.interface),
    }
    return filled(template("javascript", "switches.mjs"), replacements).rstrip()


def _fixed_steps(language: JavaScript, steps: Steps) -> list[str]:
    """Return the functions of fixed steps that are asked for."""
    size = language.interface.layout.size

    def further(method: FixedStep) -> dict[str, str]:
        return {
            "@ARRAYS@": ", ".join([str(size)] * method.arrays),
            **_arguments(language.interface),
        }

    text = template("javascript", "fixed_step.mjs")
    return step_texts(language, steps, text, "NaN", " * ", further)


def _event_tokens(interface: Interface) -> dict[str, str]:
    """Return the tokens of a run that stops at events."""
    contacts, switches = interface.contacts, interface.switches.names
    falls = ["events(t, y, p@NOW@, mode)"] if contacts else []
    falls += ["switches(t, y, p@NOW@)"] if switches else []
    values = ["mode"] if contacts else []
    values += ["PLACES.map((place) => y[place])"] if switches else []
    spread = ", ".join(f"...{text}" for text in values)
    return {
        "@FALLS@": falls[0] if len(falls) == 1 else f"[{', '.join(f'...{f}' for f in falls)}]",
        "@VALUES@": values[0] if len(values) == 1 else f"[{spread}]",
        "@HAPPENS@": event_lines(
            lambda name: template("javascript", f"{name}.mjs"),
            interface.event_kinds,
            ("if (event < @CONTACTS@) {", "}"),
            *("    ", "  "),
        ),
        "@NUMBER@": f"event < {contacts.count} ? -1 : event - {contacts.count}"
        if contacts
        else "event",
        "@CONTACTS@": str(contacts.count if contacts else 0),
        "@STATE@": "State and mode" if contacts else "State",
        "@RESULT@": "{ y, mode }" if contacts else "y",
        "@NOTHING@": "{ y: y.fill(NaN), mode }" if contacts else "y.fill(NaN)",
        "@TAKEN@": "({ y, mode }" if contacts else "y",
        "@ENDED@": ")" if contacts else "",
    }


def _script(language: JavaScript) -> str:
    """Return ``integrate`` and the run of the module as a script."""
    interface, contacts = language.interface, language.interface.contacts
    begin = template("javascript", "begin.mjs") if interface.closed else ""
    integrate = "integrate"
    begin += template("javascript", "begin_contacts.mjs") if contacts else ""
    begin += template("javascript", "begin_switches.mjs") if interface.switches.names else ""
    if interface.events:
        language.routines.add("advance")
        begin += template("javascript", "begin_events.mjs")
        integrate = "integrate_events"
    values = "inputs(s, state, p, recorded(s, t + h / 2))" if interface.recorded else ""
    values = values or ("inputs(s, state, p)" if interface.inputs else "")
    tokens = {
        "@INTEGRATE@": template("javascript", f"{integrate}.mjs").rstrip(),
        "@STEPPED@": "project(t + h, next, p@AT@@IN@)" if interface.projection else "next",
        "@AT@": ", inputs(t + h, next, p)" if contacts is not None and interface.inputs else "",
        "@GIVEN@": f", {values}" if values else "",
        "@BEGUN@": begin,
        "@Y@": "y" if contacts is None else "({ y, mode }",
        "@MORE@": (", mode" * bool(contacts) + ", largest, report") * bool(interface.events)
        + ")" * bool(contacts),
        "@SIZE@": str(interface.layout.size),
        "@N@": str(len(interface.coordinates)),
        "@STATES@": _STATES if interface.states else "",
        **_event_tokens(interface),
        "@C@": str(interface.events),
        "@TWICE@": str(2 * interface.events),
        **SCRIPT_TOKENS,
        **_arguments(interface),
    }
    return filled(template("javascript", "script.mjs"), tokens)
