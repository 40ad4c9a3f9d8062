"""One function that solves for accelerations and multipliers, and two that read them from it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import indent

from lagrange_cli.emit.python.functions import defined, load_inputs
from lagrange_cli.emit.python.statements import assigned, solution
from lagrange_cli.emit.python.styles import Style
from lagrange_cli.program.emitted_functions import multipliers_beside
from lagrange_cli.program.printing import Dialect, double_literal
from lagrange_cli.program.program import Program

_DOC = '"""Accelerations, then multipliers; raises where they do not exist."""'

_TAB = " " * 4


def sharing(programs: Mapping[str, Program]) -> list[str]:
    """What names of right-hand sides begin with (``""``, ``contact_``) that find the multipliers
    with all accelerations, so that two functions can share the solution."""
    sides = {of: programs.get(f"{of}rhs") for of in ("", "contact_")}
    return [
        of
        for of, side in sides.items()
        if side is not None
        and f"{of}multipliers" in programs
        and multipliers_beside(side) == programs[f"{of}multipliers"]
    ]


def shared_sources(
    of: str,
    side: Program,
    names: Mapping[str, str],
    parameter: str,
    sequences: Sequence[tuple[str, int]],
    style: Style,
) -> list[str]:
    """Write the functions ``_solution``, ``rhs`` and ``multipliers``, whose names begin with
    ``of``; the other arguments are those of :func:`.functions.function_source`."""
    dialect = Dialect(double_literal, style.functions, names)
    passed = ", ".join(argument.split("=")[0] for argument in parameter.split(", "))
    solved, *_ = solution(side, dialect)
    body = load_inputs(side, dialect, sequences or (("p", side.parameters),), style)
    body += [*assigned(side.assignments, dialect), *solved, "return a0"]
    text = indent("\n".join(body), _TAB)
    call = f"_{of}solution(t, y, {passed})"
    head = f"def _{of}solution(t, y, {passed}):\n    {_DOC}\n"
    n = side.coordinates
    rates = f"*_numbers(y)[{n}:], *{call}[:{n}]"
    multipliers = multipliers_beside(side)
    assert multipliers is not None
    return [
        f"{head}{text}\n",
        defined(f"{of}rhs", parameter, [f"return array([{rates}], float)"], side, style),
        defined(
            f"{of}multipliers",
            parameter,
            [f"return array({call}[{n}:], float)"],
            multipliers,
            style,
        ),
    ]
