"""Parts of emitted Fortran from templates, and the main program, which prints a table.

Arguments ``NAME=VALUE`` set parameters and initial values. Where there are closures the start is
led to them, and refused where it is not near them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from lagrange_cli.emit.languages.interface import Interface, Projection
from lagrange_cli.emit.naming import comment_text
from lagrange_cli.emit.template_files import filled, template

#: Constants of one statement.
_A_STATEMENT = 200

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
        "names": [*map(_quoted, names)],
        "values": [f"{x or 0.0!r}_wp" for x in values],
        "known": [f".{x is not None}.".lower() for x in values],
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


def projected_lines(u: Sequence[str], t: str, y: str) -> str:
    """Return the lines that lead a state back to the closures, by inputs u at its time, if any."""
    lines = [f"call inputs({t}, {y}, p, u, status)"] if u else []
    lines += [f"call project({', '.join([t, y, *u, 'p', 'status'])})", "if (status /= 0) return"]
    return "".join(f"      {line}\n" for line in lines)


def projection_subroutine(interface: Interface, projection: Projection, u: Sequence[str]) -> str:
    """Return the subroutine ``project``, of functions that take inputs u, if any."""
    positions, m = projection.positions, projection.closures
    n = len(interface.coordinates)
    first = ""
    if positions:
        passed = ", ".join([str(n), str(positions), "t", *u, "p", "y", "error", "square", "change"])
        lines = [f"call lead_positions({passed}, found)", "status = merge(0, 1, found)"]
        first = "".join(f"    {line}\n" for line in [*lines, "if (.not. found) return"])
    replacements = {
        "@U@": "u, " if u else "",
        "@STATES@": str(interface.layout.size),
        "@DECLARED@": f"    real(wp), intent(in) :: u({len(interface.inputs)})\n" * len(u),
        "@TWICE@": str(2 * m),
        "@SQUARE@": f", square({positions})" if positions else "",
        "@POSITIONS@": first,
        "@M@": str(m),
        "@N@": str(n),
    }
    return filled(template("fortran", "project.f90"), replacements).rstrip("\n")


def helper_functions(text: str) -> Iterator[str]:
    """Yield the functions that Fortran has not, of those that a text calls."""
    for helper in template("fortran", "functions.f90").split("\n\n"):
        if f"{helper.split()[-1]}(" in text:
            yield helper.rstrip("\n")
