"""The main program of emitted Fortran, which integrates and prints a table.

Arguments ``NAME=VALUE`` set parameters and initial values. Where there are closures the start is
led to them, and refused where it is not near them.
"""

from __future__ import annotations

from textwrap import wrap

from lagrange_cli.emit.languages.interface import Interface
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import filled, template


def main_program(interface: Interface) -> str:
    """Return the program that integrates and prints a table."""
    names = [*interface.state, *(p.name for p in interface.parameters), "until", "steps"]
    states = len(interface.state)
    values = [*(interface.initial or [None] * states), *(p.value for p in interface.parameters)]
    values += [interface.until, float(interface.steps)]
    width = max(map(len, map(comment_text, names)))
    fields = ", ".join(f"values({states + 1 + k})" for k, _ in enumerate(interface.parameters))
    lists = {
        "@VALUES@": [f"{x or 0.0!r}_wp" for x in values],
        "@KNOWN@": [f".{x is not None}.".lower() for x in values],
    }
    projection = interface.projection
    replacements = {
        "@USED@": ", project, is_near" if projection else "",
        "@BEGUN@": _begun(interface) if projection else "",
        "@STATED@": f", stated({states})" if projection else "",
        "@NAME@": interface.name,
        "@STATES@": str(states),
        "@ROWS@": str(interface.rows),
        "@TOTAL@": str(len(names)),
        "@START@": f"{interface.start!r}_wp",
        "@PARAMETERS@": f"p = parameters({fields})",
        "@NAMES@": f"[character(len={width}) :: " + ", &\n    ".join(map(_quoted, names)) + "]",
        **{
            token: "[" + " &\n    ".join(wrap(", ".join(texts), 90)) + "]"
            for token, texts in lists.items()
        },
    }
    return filled(template("fortran", "main.f90"), replacements)


def _begun(interface: Interface) -> str:
    """Return the lines that lead the start to the closures, and stop where it is not near them."""
    inputs = len(interface.inputs)
    assert interface.projection is not None
    driven = "u, " if interface.projection.driven else ""
    text = template("fortran", "begin.f90")
    input_lines = "    call inputs(start, y, p, u, status)\n" * bool(driven)
    declared = f"    real(wp) :: u({inputs})\n" * bool(driven)
    tokens = {"@U@": driven, "@INPUTS@": input_lines, "@DECLARED@": declared}
    return filled(text, {**tokens, "@N@": str(len(interface.coordinates))})


def _quoted(text: str) -> str:
    return "'" + comment_text(text).replace("'", "''") + "'"
