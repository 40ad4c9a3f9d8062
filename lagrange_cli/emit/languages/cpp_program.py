"""Parts of a C++ header around its functions: projection, contacts, recordings, ``main``."""

from __future__ import annotations

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
    """Return a literal of a text, in ASCII; octal digits end after three."""
    plain = "".join(
        c if " " <= c <= "~" and c not in '"\\?' else "".join(f"\\{b:03o}" for b in c.encode())
        for c in text
    )
    return f'"{plain}"'


def _taken(interface: Interface) -> dict[str, str]:
    """Return the tokens of arguments for inputs and mode."""
    driven, moded = len(interface.inputs), interface.contacts is not None
    return {
        "@INPUTS@": f"const std::array<T, {driven}>& u, " if driven else "",
        "@U@": "u, " if driven else "",
        "@MODE@": ", const Mode& mode" if moded else "",
        "@CLOSED@": ", const Mode& closed = {}" if moded else "",
        "@IN@": ", mode" if moded else "",
    }


def _given(interface: Interface, t: str, at: str, y: str) -> str:
    """Return the argument that is the scene's inputs at a time."""
    recorded = f"recorded<T>({t}, {at}), " if interface.recorded else ""
    return f"inputs({t}, {y}, {recorded}p), " if interface.inputs else ""


def recorded_text(language: Language) -> str:
    """Return the tables of recorded inputs, and the function that evaluates them."""
    interface = language.interface
    if not interface.recorded:
        return ""
    language.routines.add("interpolated")
    lines, tests = [], []
    for r in interface.recorded:
        table, size = f"recording_{r.number}", len(r.table)
        lines.append(f"// {r.text}: starts, each with coefficients behind it.")
        text = f"inline constexpr std::array<double, {size}> {table}{{"
        lines += language.broken(f"{text}{', '.join(map(repr, r.table))}}};")
        ends = f" && t <= T({r.last!r})" if isfinite(r.last) else ""
        tests += [
            f"    if (t >= T({r.first!r}){ends}) {{",
            f"        static const std::array<T, {size}> table = converted<T>({table});",
            f"        u[{r.number}] = interpolated({r.rows}, {r.width}, table.data(), t, at);",
            "    }",
        ]
    tokens = {"@INPUTS@": str(len(interface.inputs)), "@TESTS@": "\n".join(tests)}
    return "\n".join([*lines, "", filled(template("cpp", "recorded.hpp"), tokens).rstrip()])


def project_text(language: Language) -> str:
    flags = (
        "    const auto flags_held = flags<T>(closed);\n    const T* mode = flags_held.data();\n"
    )
    tokens = {
        "@FLAGS@": flags if language.interface.contacts else "",
        **_taken(language.interface),
    }
    return projection_text(language, "cpp", "project.hpp", "positions.hpp", tokens).rstrip()


def contacts_text(language: Language) -> str:
    """Return the functions of the interface that take a mode."""
    interface, contacts = language.interface, language.interface.contacts
    if contacts is None:
        return ""
    arrays = interface.reset_arrays
    tokens = {
        **contact_tokens(language),
        "@NAMES@": "\n".join(f"    {string_literal(name)}," for name in contacts.names),
        "@ARRAYS@": "".join(f"    std::array<T, {k}> {n}{{}};\n" for n, k in arrays.items()),
        "@PASSED@": ", ".join(f"{name}.data()" for name in arrays),
        **_taken(interface),
    }
    return filled(template("cpp", "contacts.hpp"), tokens).rstrip()


def switches_text(language: Language) -> str:
    """Return the functions that change states with two values, and their names."""
    interface, switches = language.interface, language.interface.switches
    if not switches.names:
        return ""
    tokens = {
        **switch_tokens(language),
        "@NAMES@": "\n".join(f"    {string_literal(name)}," for name in switches.names),
        **_taken(interface),
    }
    return filled(template("cpp", "switches.hpp"), tokens).rstrip()


#: Lines that copy a mode, and what a run that stops at events does with it.
_HELD = """\
    Mode held{};
    std::copy_n(mode, held.size(), held.begin());
"""
_CONTACT_NUMBERS = """\
    const auto numbers = events(t, y, @NOW@p, held);
    std::copy_n(numbers.begin(), numbers.size(), out);
"""
_SWITCH_NUMBERS = """\
    const auto values = switches(t, y, @NOW@p);
    std::copy_n(values.begin(), values.size(), out@BEHIND@);
"""
_VALUES = """\
        std::array<std::size_t, @C@> now{};
@MODED@        for (std::size_t k = 0; k < switch_names.size(); ++k) {
            now[@FIRST@k] = y[switch_places[k]] > T(0) ? 1 : 0;
        }
"""


def _follow_text(interface: Interface) -> str:
    """Return the functions of a run that stops at events; nothing without any."""
    contacts, switches = interface.contacts, interface.switches.names
    if not interface.events:
        return ""
    count = contacts.count if contacts else 0
    numbers = (_CONTACT_NUMBERS if contacts else "") + (_SWITCH_NUMBERS if switches else "")
    moded = "        std::copy_n(mode.begin(), mode.size(), now.begin());\n"
    tokens = {
        "@HELD@": _HELD if contacts else "    (void)mode;\n",
        "@IN@": ", held" if contacts else "",
        "@FALLS@": numbers,
        "@BEHIND@": f" + {count}" if count else "",
        "@VALUES@": _VALUES if switches else "",
        "@MODED@": moded if contacts else "",
        "@FIRST@": f"{count} + " if count else "",
        "@VALUES_NOW@": "now" if switches else "mode",
        "@MODE@": "Mode& mode, " if contacts else "",
        "@HAPPENS@": event_lines(
            lambda name: template("cpp", f"{name}.hpp"),
            interface.event_kinds,
            (f"if (event < {count}) {{", "}"),
            *("        ", "    "),
        ),
        "@NUMBER@": f", event < {count} ? {len(switches)} : event - {count}"
        if contacts
        else ", event",
    }
    return filled(template("cpp", "follow.hpp"), tokens) + "\n"


def fixed_step_texts(language: Language, steps: Steps) -> list[str]:
    """Return the functions of fixed steps that are asked for, with what they call."""
    taken = _taken(language.interface)

    def further(method: FixedStep) -> dict[str, str]:
        arrays = ", ".join(f"arrays[{k}].data()" for k in range(method.arrays))
        return {"@ARRAYS@": str(method.arrays), "@PASSED@": arrays, **taken}

    texts = step_texts(language, steps, template("cpp", "fixed_step.hpp"), "NaN", "/// ", further)
    return [filled(template("cpp", "dynamics.hpp"), taken).rstrip(), *texts] if texts else []


def main_text(language: Language, name: str) -> str:
    interface, contacts = language.interface, language.interface.contacts
    language.routines |= {"advance"} if interface.events else set()
    size, fields = interface.layout.size, interface.parameters
    names = [*interface.state, *(field.name for field in fields), "until", "steps"]
    values = [
        *(interface.initial or [None] * size),
        *(field.value for field in fields),
        interface.until,
        float(interface.steps),
    ]
    set_ = (f"    p.{f.identifier} = values[{size + k}];\n" for k, f in enumerate(fields))
    begun = template("cpp", "begin.hpp") if interface.closed else ""
    begun += template("cpp", "begin_contacts.hpp") if contacts else ""
    begun += template("cpp", "begin_switches.hpp") if interface.switches.names else ""
    begun += template("cpp", "begin_events.hpp") if interface.events else ""
    led = f"project(t + h, next, {_given(interface, 't + h', 't + h', 'next')}p@IN@)"
    step = "y = @NAME@::stepped(t + k*h, h, y, p);"
    if interface.events:
        mode = "mode, " if contacts else ""
        step = f"y = @NAME@::follow(t + k*h, h, y, p, {mode}largest);"
    return filled(
        template("cpp", "main.hpp"),
        {
            "@FOLLOW@": _follow_text(interface),
            "@BEGUN@": begun,
            "@C@": str(interface.events),
            "@TWICE@": str(2 * interface.events),
            "@STEP@": step,
            "@STEPPED@": led if interface.projection else "next",
            "@STAGE@": _given(interface, "at", "t + h/T(2)", "s"),
            "@NOW@": _given(interface, "t", "t", "y"),
            "@BEGIN@": _begin_inputs(interface),
            **SCRIPT_TOKENS,
            **_taken(interface),
            "@NAMES@": ", ".join(map(string_literal, names)),
            "@VALUES@": ", ".join("NAN" if x is None else repr(x) for x in values),
            "@SET@": "".join(set_),
            "@START@": repr(interface.start),
            "@ROWS@": str(interface.rows),
            "@STATE@": f"2*{name}::dof" + f" + {name}::states" * bool(interface.states),
            "@NAME@": name,
        },
    )


def _begin_inputs(interface: Interface) -> str:
    """Return the argument that is the inputs at the start, outside the namespace."""
    text = _given(interface, "start", "start", "y").replace("<T>", "<double>")
    return text.replace("inputs(", "@NAME@::inputs(").replace("recorded<", "@NAME@::recorded<")
