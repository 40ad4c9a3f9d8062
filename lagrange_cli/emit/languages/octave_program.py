"""Parts of an Octave file around its functions: projection, contacts, recordings, events."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite

from lagrange_cli.emit.fixed_steps import FixedStep
from lagrange_cli.emit.languages.module_parts import (
    Steps,
    contact_tokens,
    step_texts,
    switch_tokens,
)
from lagrange_cli.emit.languages.printer import (
    Language,
)
from lagrange_cli.emit.languages.values import Contacts, Interface, Projection
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import event_lines, filled, template


def quoted_names(names: Sequence[str]) -> str:
    quoted = (comment_text(name).replace("'", "''") for name in names)
    return "{" + ", ".join(f"'{name}'" for name in quoted) + "}"


def taken_tokens(interface: Interface) -> dict[str, str]:
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
        "@UNMODED@": "\n".join(defaults),
        "@NOW@": ", inputs(t, y, p)" if driven else "",
    }


def project_text(interface: Interface, projection: Projection) -> str:
    """Return the function that leads a state back to the closures."""
    tokens = {
        "@POSITIONS@": template("octave", "positions.m") if projection.positions else "",
        "@HALF@": str(len(interface.coordinates)) if interface.states else "numel(y)/2",
        "@END@": "2*n" if interface.states else "end",
        "@OF@": "contact_" if interface.contacts else "",
        **taken_tokens(interface),
    }
    return filled(template("octave", "project.m"), tokens).rstrip("\n")


def moving_tokens(interface: Interface) -> dict[str, str]:
    """Return texts of the positions and velocities in a state."""
    n = len(interface.coordinates)
    if not interface.states:
        return {"@MOVING@": "", "@LED@": "y", "@PLACES@": "n/2"}
    moving = f"  stated = stated(1:{2 * n});\n"
    return {"@MOVING@": moving, "@LED@": f"y(1:{2 * n})", "@PLACES@": str(n)}


def recorded_text(language: Language) -> str:
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


def contacts_text(language: Language, contacts: Contacts) -> str:
    """Return the functions of the interface that take a mode."""
    arrays = language.interface.reset_arrays.values()
    tokens = {
        **contact_tokens(language),
        "@ARRAYS@": "\n    ".join(language.broken(", ".join(f"zeros({k},1)" for k in arrays))),
        **taken_tokens(language.interface),
    }
    return filled(template("octave", "contacts.m"), tokens).rstrip("\n")


def switches_text(language: Language) -> str:
    """Return the function that changes states with two values."""
    tokens = {
        "@LAST@": str(4 + bool(language.interface.inputs)),
        **switch_tokens(language),
        **taken_tokens(language.interface),
    }
    return filled(template("octave", "switches.m"), tokens).rstrip("\n")


_KINDS = "kinds = {'contact', 'release'};"


def event_tokens(interface: Interface) -> dict[str, str]:
    """Return the tokens of a run that stops at events."""
    contacts, switches = interface.contacts, interface.switches
    count = contacts.count if contacts else 0
    falls = ["events(t, y, p@NOW@, mode)"] if contacts else []
    falls += ["switches(t, y, p@NOW@)"] if switches.names else []
    places = f"[{', '.join(str(place + 1) for place in switches.places)}]"
    values = ["mode"] if contacts else []
    values += ["y(places)"] if switches.names else []
    named = [f"names = {quoted_names(contacts.names)};", _KINDS] if contacts else []
    named += [f"switch_names = {quoted_names(switches.names)};"] if switches.names else []
    named += ["values = {'off', 'on'};", f"places = {places};"] if switches.names else []
    return {
        "@FALLS@": falls[0] if len(falls) == 1 else f"[{'; '.join(falls)}]",
        "@VALUES@": values[0] if len(values) == 1 else f"[{'; '.join(values)}]",
        "@NAMES@": "".join(f"  {line}\n" for line in named),
        "@HAPPENS@": event_lines(
            lambda name: template("octave", f"{name}.m"),
            interface.event_kinds,
            (f"if event < {count}", "end"),
            *("    ", "  "),
        ),
        "@NUMBER@": f"max(event + 1 - {count}, 0)" if count else "event + 1",
        "@MODE@": ", mode" if contacts else "",
        "@MODED@": ", mode" if interface.events else "",
        "@STATE@": "State and mode" if contacts else "State",
        "@NO_MODE@": f"  if nargin < 6, mode = zeros({count}, 1); end\n" if contacts else "",
        "@COUNT@": "7" if contacts else "6",
        "@C@": str(interface.events),
        "@TWICE@": str(2 * interface.events),
    }


def fixed_step_texts(language: Language, steps: Steps) -> list[str]:
    """Return the functions of fixed steps that are asked for."""
    driven = "  if nargin < 5, u = inputs(t, y, p); end\n" if language.interface.inputs else ""

    def further(method: FixedStep) -> dict[str, str]:
        return {
            "@ARRAYS@": ", ".join(["zeros(@SIZE@, 1)"] * method.arrays),
            "@DRIVEN@": driven,
            **taken_tokens(language.interface),
        }

    return step_texts(language, steps, template("octave", "fixed_step.m"), "NaN", "% ", further)
