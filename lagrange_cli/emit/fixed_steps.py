"""Functions of fixed steps that ``--with`` asks for: methods, refusals, and their documentation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Mark, Problem

if TYPE_CHECKING:
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


def require_steps(equations: Equations, options: Mapping[str, str | bool]) -> list[str]:
    """Return the functions that are asked for.

    Raises
    ------
    InputError
        Contacts would open and close, or states change their values, within a step.
    """
    asked = [name for name in FIXED_STEPS if options.get(name)]
    reason = ""
    if asked and equations.system.contacts:
        reason = "contacts open and close within a step: the functions of contacts lead on"
    elif asked and equations.system.switches:
        reason = "a state changes between its two values within a step: switches tells when"
    if reason:
        mark = Mark(equations.presentation.file, 1, 1)
        raise InputError(Problem(f"no fixed steps: {reason}", mark, rule="emit-step"))
    return asked


def step_note(name: str, errors: Mapping[str, str]) -> str:
    """Return the method of a function, and the sentence on its measured error."""
    return f"{FIXED_STEPS[name].title}. {errors.get(name, '')}".strip()


def step_lines(
    equations: Equations, name: str, errors: Mapping[str, str], failure: str, width: int
) -> list[str]:
    """Return the documentation of a function of fixed steps, wrapped.

    Parameters
    ----------
    errors
        Function → a sentence on its measured error.
    failure
        What the function gives where a step has no result.
    width
        Letters of a line.
    """
    note = step_note(name, errors)
    inputs_note = ", with the inputs held in between" if equations.system.inputs else ""
    settles = ", or its iteration does not settle since h is too long" * (name == "midpoint")
    closed = " It leaves closures by its error: project leads back." * bool(
        equations.system.closures
    )
    text = (
        f"State at t + h{inputs_note}, for real time. {failure} where rhs has no result"
        f"{settles}.{closed} {note[0].upper()}{note[1:]}"
    )
    return wrap(text, width)
