"""Fixed steps in C, for real time: no allocation, the inputs held over a step."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.emit.c.solvers import routine_texts
from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
    from lagrange_cli.emit.c.target import CTarget
    from lagrange_cli.mechanics.equations import Equations


@dataclass(frozen=True)
class FixedStep:
    """A method of fixed steps: the routine, its title, and the arrays that it overwrites."""

    routine: str
    title: str
    arrays: int


#: Function → method, by the options that ask for them.
FIXED_STEPS: Mapping[str, FixedStep] = {
    "step": FixedStep("runge_kutta", "Runge and Kutta's method of order 4", 3),
    "midpoint": FixedStep("implicit_midpoint", "the implicit midpoint rule, of order 2", 2),
}


#: A function of the interface around its routine.
_FUNCTION = """\
int @NAME@_@STEP@(@REAL@ t, @REAL@ *y, const @REAL@ *u, const @NAME@_params *p, @REAL@ h,
    @REAL@ *work)
{
    @REAL@ *const own = work + @NAME@_WORK;
    int status = 0;
    if (!@NAME@_@ROUTINE@(@SIZE@, u, p, work, &status, t, h, y, @ARRAYS@) && status == 0) {
        status = 3;
    }
    return status;
}
"""


def require_steps(equations: Equations, options: Mapping[str, str | bool]) -> list[str]:
    """Return the functions that are asked for.

    Raises
    ------
    InputError
        Contacts would open and close within a step; or ``main`` has a step of its own.
    """
    asked = [name for name in FIXED_STEPS if options.get(name)]
    reason = ""
    if asked and equations.system.contacts:
        reason = "contacts open and close within a step: the functions of contacts lead on"
    elif asked and equations.system.switches:
        reason = "a state changes between its two values within a step: NAME_switches tells when"
    elif "step" in asked and options["main"]:
        reason = "the program of --main has a function of that name: emit it by itself"
    if reason:
        mark = Mark(equations.presentation.file, 1, 1)
        raise InputError(Problem(f"no fixed steps: {reason}", mark, rule="emit-step"))
    return asked


def step_text(equations: Equations, target: CTarget, asked: list[str]) -> str:
    """Write the functions, and the routines behind them."""
    size = equations.system.layout.size
    parts = routine_texts([FIXED_STEPS[name].routine for name in asked], target)
    for name in asked:
        method = FIXED_STEPS[name]
        arrays = ", ".join(f"own + {k * size}" if k else "own" for k in range(method.arrays))
        tokens = {"@STEP@": name, "@ROUTINE@": method.routine, "@SIZE@": str(size)}
        parts.append(target.fill(_FUNCTION, {**tokens, "@ARRAYS@": arrays}))
    return "\n".join(parts)


def step_declarations(
    equations: Equations, target: CTarget, asked: list[str], errors: Mapping[str, str]
) -> str:
    """Declare the functions, with what was measured of their errors."""
    if not asked:
        return ""
    lines = list(_documented(equations, target.prefix, asked, errors))
    most = max(FIXED_STEPS[name].arrays for name in asked) * equations.system.layout.size
    real, prefix = target.real.name, target.prefix
    arguments = (
        f"{real} t, {real} *y, const {real} *u, const {prefix}_params *p, {real} h, {real} *work"
    )
    declared = [f"int {prefix}_{name}({arguments});" for name in asked]
    size = f"#define {prefix}_STEP_WORK ({prefix}_WORK + {most})"
    return "\n".join(
        ["", "/*", *(f" * {line}".rstrip() for line in lines), " */", size, *declared, ""]
    )


def _documented(
    equations: Equations, prefix: str, asked: list[str], errors: Mapping[str, str]
) -> Iterator[str]:
    yield "Fixed steps for real time: y at t becomes y at t + h, with u held in between."
    yield f"work holds {prefix}_STEP_WORK numbers. A result of 3: the iteration does not settle,"
    yield "since h is too long; y is left as it was unless the result is 0."
    if equations.system.closures:
        yield f"Steps leave closures by their errors: {prefix}_project leads back."
    for name in asked:
        text = f"{prefix}_{name}: {FIXED_STEPS[name].title}. {errors.get(name, '')}"
        yield from wrap(text.strip(), 90, subsequent_indent="  ")
