"""Parts of emitted Fortran from templates, and the main program, which prints a table.

Arguments ``NAME=VALUE`` set parameters and initial values. Where there are closures the start is
led to them, and refused where it is not near them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lagrange_cli.emit.languages.values import Interface
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.lowered.routines.projection import START_TOLERANCE

#: Constants of one statement.
_A_STATEMENT = 200

#: Columns of a line that Fortran reads.
_COLUMNS = 132

#: Letters of a line of constants.
_WIDTH = 90


def main_program(interface: Interface) -> str:
    """Return the program that integrates and prints a table."""
    names = [*interface.state, *(p.name for p in interface.parameters), "until", "steps"]
    states = len(interface.state)
    values = [*(interface.initial or [None] * states), *(p.value for p in interface.parameters)]
    values += [interface.until, float(interface.steps)]
    width = max(map(len, map(comment_text, names)))
    fields = ", ".join(f"values({states + 1 + k})" for k, _ in enumerate(interface.parameters))
    lists = {
        "names": [*map(quoted_text, names)],
        "values": [f"{x or 0.0!r}_wp" for x in values],
        "known": [f".{x is not None}.".lower() for x in values],
    }
    contacts = interface.contacts
    used = ["project", "is_near"] if interface.closed else []
    used += ["events", "reset", "contact_names"] if contacts else []
    used += ["change"] if interface.switches.names else []
    begins = interface.events > 0 or interface.closed
    used += ["inputs"] if interface.inputs and begins else []
    used += ["recorded"] if interface.recorded and begins else []
    begun = template("fortran", "begin.f90") if interface.closed else ""
    begun += template("fortran", "begin_contacts.f90") if contacts else ""
    begun += template("fortran", "begin_switches.f90") if interface.switches.names else ""
    count = contacts.count if contacts else 0
    declared = [f"real(wp) :: u({len(interface.inputs)})"] if "inputs" in used else []
    declared += [f"integer :: mode({count})", f"real(wp) :: gaps({count})"] if count else []
    declared += [f"real(wp) :: largest({2 * interface.events})"] if interface.events else []
    cleared = ["mode = 0"] if count else []
    cleared += ["largest = 0.0_wp"] if interface.events else []
    replacements = {
        "@USED@": "".join(f", {name}" for name in used),
        "@BEGUN@": begun,
        "@INPUTS@": _inputs(interface),
        "@U@": "u, " if interface.inputs else "",
        "@IN@": "mode, " if contacts else "",
        "@FREE@": "mode, " if contacts else "",
        "@LARGEST@": ("mode, " if contacts else "") + ("largest, " if interface.events else ""),
        "@DECLARED@": "".join(f"  {line}\n" for line in declared),
        "@CLEARED@": "".join(f"  {line}\n" for line in cleared),
        "@N@": str(len(interface.coordinates)),
        "@C@": str(count),
        "@TOLERANCE@": f"{START_TOLERANCE!r}_wp",
        "@STATED@": f", stated({states})" if interface.closed else "",
        "@NAME@": interface.name,
        "@STATES@": str(states),
        "@ROWS@": str(interface.rows),
        "@TOTAL@": str(len(names)),
        "@START@": f"{interface.start!r}_wp",
        "@PARAMETERS@": f"p = parameters({fields})",
        "@WIDTH@": str(width),
        "@DATA@": "".join(
            f"  data {array} / &\n    {_broken(part)} /\n"
            for name, texts in lists.items()
            for array, part in _parts(name, texts)
        ),
    }
    return filled(template("fortran", "main.f90"), replacements)


def _parts(name: str, texts: Sequence[str]) -> Iterator[tuple[str, Sequence[str]]]:
    """Yield parts of an array with their texts, since a statement has 255 further lines at most."""
    for start in range(0, len(texts), _A_STATEMENT):
        part = texts[start : start + _A_STATEMENT]
        yield f"{name}({start + 1}:{start + len(part)})", part


def _broken(texts: Sequence[str]) -> str:
    """Return constants over several lines, of which each is on one."""
    lines: list[list[str]] = [[]]
    for text in texts:
        if lines[-1] and len(", ".join([*lines[-1], text])) >= _WIDTH:
            lines.append([])
        lines[-1].append(text)
    return ", &\n    ".join(map(", ".join, lines))


def _inputs(interface: Interface) -> str:
    """Return the line that evaluates the inputs at the start."""
    recorded = "recorded(start, start), " if interface.recorded else ""
    line = f"  call inputs(start, y, {recorded}p, u, status)\n"
    return line if interface.inputs else ""


def event_constants(interface: Interface) -> Iterator[str]:
    """Yield the constants that tell what events are of."""
    if interface.contacts is not None:
        yield from ("", "!> Names of the contacts, in the order of a mode.")
        yield from _texts("contact_names", interface.contacts.names)
    if interface.switches.names:
        yield from ("", "!> Names of the states with two values, in the order of switches.")
        yield from _texts("switch_names", interface.switches.names)
        values = ", ".join(map(str, interface.switches.places))
        yield "!> Their places in a state, counted from 0."
        yield f"integer, parameter :: places({len(interface.switches.names)}) = [{values}]"


def _texts(constant: str, names: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a constant array of texts."""
    yield f"character(len=*), parameter :: {constant}({len(names)}) = &"
    width = max(map(len, map(comment_text, names)))
    quoted = ", &\n    ".join(map(quoted_text, names))
    yield f"  [character(len={width}) :: {quoted}]"


def quoted_text(text: str) -> str:
    """Return a literal of a text."""
    return "'" + comment_text(text).replace("'", "''") + "'"


def helper_functions(text: str) -> Iterator[str]:
    """Yield the functions that Fortran has not, of those that a text calls."""
    for helper in template("fortran", "functions.f90").split("\n\n"):
        if f"{helper.split()[-1]}(" in text:
            yield helper.rstrip("\n")


def split_line(line: str) -> Iterator[str]:
    """Yield the lines of a statement of which a word would not fit in a line."""
    while len(line) > _COLUMNS and not line.lstrip().startswith("!"):
        yield line[: _COLUMNS - 1] + "&"
        line = "&" + line[_COLUMNS - 1 :]
    yield line
