"""Parts of a Rust module around its functions: projection, contacts, recordings, ``main``."""

from __future__ import annotations

from itertools import compress
from math import isfinite

from lagrange_cli.emit.fixed_steps import FixedStep
from lagrange_cli.emit.languages.module_parts import (
    SCRIPT_TOKENS,
    Steps,
    contact_tokens,
    projection_text,
    step_texts,
    switch_tokens,
)
from lagrange_cli.emit.languages.printer import (
    Language,
)
from lagrange_cli.emit.languages.values import Interface
from lagrange_cli.emit.template_files import event_lines, filled, template


def string_literal(text: str) -> str:
    """Return a literal of a text, in ASCII."""
    plain = "".join(c if " " <= c <= "~" and c not in '"\\' else f"\\u{{{ord(c):x}}}" for c in text)
    return f'"{plain}"'


def size_text(interface: Interface) -> str:
    """Return the number of numbers of a state, over the constants of the module."""
    return "2 * N + M" if interface.states else "2 * N"


def failure_tokens(interface: Interface) -> dict[str, str]:
    """Return the tokens of what events alone fail by."""
    reasons = ["contacts leave no motion, or a restitution is not in 0 to 1"]
    reasons = reasons if interface.contacts else []
    reasons += ["a state with two values has neither"] if interface.switches.names else []
    reason = ", or ".join(reasons)
    texts = (
        f"    /// {reason[:1].upper()}{reason[1:]}.\n    NoMotion,\n",
        f'            Failure::NoMotion => "{reason}",\n',
    )
    shown = texts if reasons else ("", "")
    return dict(zip(("@NO_MOTION@", "@NO_MOTION_TEXT@"), shown, strict=True))


def recorded_text(language: Language) -> str:
    """Return the tables of recorded inputs, and the function that evaluates them."""
    interface = language.interface
    if not interface.recorded:
        return ""
    language.routines.add("interpolated")
    lines, tests = [], []
    for r in interface.recorded:
        table = f"RECORDING_{r.number}"
        numbers = ", ".join(map(repr, r.table))
        lines.append(f"// {r.text}: starts, each with coefficients behind it.")
        lines += language.broken(f"static {table}: [f64; {len(r.table)}] = [{numbers}];")
        ends = f" && t <= {r.last!r}" if isfinite(r.last) else ""
        tests += [f"    if t >= {r.first!r}{ends} {{"]
        call = f"interpolated({r.rows}, {r.width}, &{table}, t, at)"
        tests += [f"        u[{r.number}] = {call};", "    }"]
    tokens = {"@INPUTS@": str(len(interface.inputs)), "@TESTS@": "\n".join(tests)}
    return "\n".join([*lines, "", filled(template("rust", "recorded.rs"), tokens).rstrip()])


def _taken(interface: Interface) -> dict[str, str]:
    """Return the tokens of arguments for inputs and mode."""
    driven, moded = len(interface.inputs), interface.contacts is not None
    return {
        "@INPUTS@": f"u: &[f64; {driven}], " if driven else "",
        "@U@": "u, " if driven else "",
        "@MODE@": ", mode: &[usize; CONTACTS]" if moded else "",
        "@IN@": ", mode" if moded else "",
    }


def project_text(language: Language) -> str:
    flags = "    let mode = &flags(mode);\n" if language.interface.contacts else ""
    tokens = {"@FLAGS@": flags, **_taken(language.interface)}
    return projection_text(language, "rust", "project.rs", "positions.rs", tokens).rstrip()


def contacts_text(language: Language) -> str:
    """Return the functions of the interface that take a mode."""
    interface, contacts = language.interface, language.interface.contacts
    if contacts is None:
        return ""
    language.numeric.add("abs")
    arrays = [f"&mut [0.0; {size}]" for size in interface.reset_arrays.values()]
    tokens = {
        **contact_tokens(language),
        "@STATES@": size_text(interface),
        "@NAMES@": "\n".join(f"    {string_literal(name)}," for name in contacts.names),
        "@ARRAYS@": "".join(f"        {array},\n" for array in arrays),
        **_taken(interface),
    }
    return filled(template("rust", "contacts.rs"), tokens).rstrip()


def switches_text(language: Language) -> str:
    """Return the functions that change states with two values, and their names."""
    interface, switches = language.interface, language.interface.switches
    if not switches.names:
        return ""
    language.numeric.add("abs")
    tokens = {
        **switch_tokens(language),
        "@NAMES@": "\n".join(f"    {string_literal(name)}," for name in switches.names),
        "@STATES@": size_text(interface),
        **_taken(interface),
    }
    return filled(template("rust", "switches.rs"), tokens).rstrip()


_NOW = """\
        let mut now = [0; @C@];
@MODED@        for (k, place) in SWITCH_PLACES.iter().enumerate() {
            now[@FIRST@k] = if y[*place] > 0.0 { 1 } else { 0 };
        }
"""


def _follow_text(interface: Interface) -> str:
    """Return the functions of a run that stops at events; nothing without any."""
    contacts, switches = interface.contacts, interface.switches.names
    if not interface.events:
        return ""
    count = contacts.count if contacts else 0
    calls = ["events(t, y, @HAND@p, mode, @OUT@)"] if contacts else []
    calls += ["switches(t, y, @HAND@p, @OUT@)"] if switches else []
    outs = ["out.try_into().unwrap()"]
    if len(calls) > 1:
        outs = ["(&mut out[..CONTACTS]).try_into().unwrap()"]
        outs += ["(&mut out[CONTACTS..]).try_into().unwrap()"]
    lines = [call.replace("@OUT@", out) for call, out in zip(calls, outs, strict=True)]
    mode_line = "    let mode = (&mode[..CONTACTS]).try_into().unwrap();\n"
    number = f"if event < {count} {{ {len(switches)} }} else {{ event - {count} }}"
    tokens = {
        "@HELD@": mode_line if contacts else "    let _ = mode;\n",
        "@IN@": ", mode" if contacts else "",
        "@FALLS@": "?;\n".join(f"    {line}" for line in lines) + "\n",
        "@VALUES@": _NOW if switches else "",
        "@MODED@": "        now[..CONTACTS].copy_from_slice(mode);\n" if contacts else "",
        "@FIRST@": "CONTACTS + " if contacts else "",
        "@VALUES_NOW@": "&now" if switches else "mode",
        "@MODE_CHANGED@": "mode: &mut [usize; CONTACTS], " if contacts else "",
        "@HAPPENS@": event_lines(
            lambda name: template("rust", f"{name}.rs"),
            interface.event_kinds,
            ("if event < CONTACTS {", "}"),
            *("        ", "    "),
        ),
        "@NUMBER@": number if contacts else "event",
        "@COUNT@": "count" if contacts else "_",
    }
    return filled(template("rust", "follow.rs"), tokens) + "\n"


def fixed_step_texts(language: Language, steps: Steps) -> list[str]:
    """Return the functions of fixed steps that are asked for, with what they call."""
    taken = _taken(language.interface)
    language.numeric |= {"abs"} if "midpoint" in steps.names else set()

    def further(method: FixedStep) -> dict[str, str]:
        names = ("stage", "slope", "change")[: method.arrays]
        return {
            "@NAMES@": ", ".join(names),
            "@ARRAYS@": str(method.arrays),
            "@STATES@": size_text(language.interface),
            **taken,
        }

    text = template("rust", "fixed_step.rs")
    texts = step_texts(language, steps, text, "`NotFinite`", "/// ", further)
    return [filled(template("rust", "dynamics.rs"), taken).rstrip(), *texts] if texts else []


def main_text(language: Language) -> str:
    interface = language.interface
    contacts, driven = interface.contacts, len(interface.inputs)
    language.routines |= {"advance"} if interface.events else set()
    initial = interface.initial or (None,) * interface.layout.size
    fields = [
        (string_literal(field.name), f"p.{field.identifier}") for field in interface.parameters
    ]
    missing = [field.value is None for field in interface.parameters]

    def input_line(
        t: str, at: str, y: str, p: str = "p", *, fails: str = "", tab: str = "    "
    ) -> str:
        """Return the line that evaluates the scene's inputs at a time."""
        return f"{tab}let u = given({t}, {at}, {y}, {p}){fails}?;\n" if driven else ""

    begun = template("rust", "begin.rs") if interface.closed else ""
    begun += template("rust", "begin_contacts.rs") if contacts else ""
    begun += template("rust", "begin_switches.rs") if interface.switches.names else ""
    begun += template("rust", "begin_events.rs") if interface.events else ""
    mode = "&mut mode, " if contacts else ""
    recorded = "&recorded(t, at), " if interface.recorded else ""
    tokens = {
        "@GIVEN@": template("rust", "given.rs") + "\n" if driven else "",
        "@FOLLOW@": _follow_text(interface),
        "@BEGUN@": begun,
        "@STAGE@": input_line("t + part * h", "t + h / 2.0", "&s", tab=8 * " "),
        "@PROJECTED@": input_line("t + h", "t + h", "y") + "    project(t + h, y, @HAND@p@IN@)?;\n"
        if interface.projection
        else "",
        "@NOW@": input_line("t", "t", "y"),
        "@EVENT@": input_line("t", "t", "y", tab=""),
        "@BEGIN@": input_line("@START@", "@START@", "&y", "&p", fails=".map_err(failed)"),
        "@HAND@": "&u, " if driven else "",
        "@FREE@": ", &[0; CONTACTS]" if contacts else "",
        "@RECORDED@": recorded,
        "@STEP@": f"follow(t + k as f64 * h, h, &mut y, &p, {mode}&mut largest)"
        if interface.events
        else "stepped(t + k as f64 * h, h, &mut y, &p)",
        "@DRIVEN@": str(driven),
        "@C@": str(interface.events),
        "@S@": str(len(interface.switches.names)),
        "@TWICE@": str(2 * interface.events),
        **SCRIPT_TOKENS,
        **_taken(interface),
        "@STATE@": ", ".join(map(string_literal, interface.state)),
        "@STATES@": size_text(interface),
        "@INITIAL@": ", ".join("None" if x is None else f"Some({x!r})" for x in initial),
        "@MUT@": "mut " if fields else "",
        "@SET@": "".join(f"            {name} => {to} = value,\n" for name, to in fields),
        "@REQUIRED@": ", ".join(f"({name}, {to})" for name, to in compress(fields, missing)),
        "@START@": repr(interface.start),
        "@UNTIL@": repr(interface.until),
        "@STEPS@": str(interface.steps),
        "@ROWS@": str(interface.rows),
    }
    return filled(template("rust", "main.rs"), tokens)
