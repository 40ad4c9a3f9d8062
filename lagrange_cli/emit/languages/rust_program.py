"""Parts of a Rust module around its functions: projection, contacts, recordings, ``main``."""

from __future__ import annotations

from itertools import compress
from math import isfinite

from lagrange_cli.emit.languages.printer import (
    SCRIPT_TOKENS,
    Language,
    contact_tokens,
    projection_text,
)
from lagrange_cli.emit.languages.values import Interface
from lagrange_cli.emit.template_files import filled, template


def string_literal(text: str) -> str:
    """Return a literal of a text, in ASCII."""
    plain = "".join(c if " " <= c <= "~" and c not in '"\\' else f"\\u{{{ord(c):x}}}" for c in text)
    return f'"{plain}"'


def size_text(interface: Interface) -> str:
    """Return the number of numbers of a state, over the constants of the module."""
    return "2 * N + M" if interface.states else "2 * N"


def failure_tokens(interface: Interface) -> dict[str, str]:
    """Return the tokens of what contacts alone fail by."""
    texts = (
        "    /// Contacts leave no motion, or a restitution is not in 0 to 1.\n    NoMotion,\n",
        '            Failure::NoMotion => "the contacts leave no motion",\n',
    )
    shown = texts if interface.contacts else ("", "")
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


def main_text(language: Language) -> str:
    interface = language.interface
    contacts, driven = interface.contacts, len(interface.inputs)
    language.routines |= {"advance"} if contacts else set()
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

    follows = template("rust", "follow.rs") + "\n" if contacts else ""
    begun = template("rust", "begin.rs") if interface.closed else ""
    begun += template("rust", "begin_contacts.rs") if contacts else ""
    recorded = "&recorded(t, at), " if interface.recorded else ""
    tokens = {
        "@GIVEN@": template("rust", "given.rs") + "\n" if driven else "",
        "@FOLLOW@": follows,
        "@BEGUN@": begun,
        "@STAGE@": input_line("t + part * h", "t + h / 2.0", "&s", tab=8 * " "),
        "@PROJECTED@": input_line("t + h", "t + h", "y") + "    project(t + h, y, @HAND@p@IN@)?;\n"
        if interface.projection
        else "",
        "@NOW@": input_line("t", "t", "y"),
        "@EVENT@": input_line("t", "t", "y", tab=8 * " "),
        "@BEGIN@": input_line("@START@", "@START@", "&y", "&p", fails=".map_err(failed)"),
        "@HAND@": "&u, " if driven else "",
        "@FREE@": ", &[0; CONTACTS]" if contacts else "",
        "@RECORDED@": recorded,
        "@STEP@": "follow(t + k as f64 * h, h, &mut y, &p, &mut mode, &mut largest)"
        if contacts
        else "step(t + k as f64 * h, h, &mut y, &p)",
        "@DRIVEN@": str(driven),
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
