"""Further outputs of equations that a motion may be asked for: momenta, conserved quantities."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem, nearest

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations


def with_further_outputs(equations: Equations, names: Collection[str]) -> Equations:
    """Add the outputs of these names to those of the scene.

    Raises
    ------
    InputError
        There is none of a name.
    """
    for name in names:
        if name not in FURTHER:
            hint = nearest(name, FURTHER) or f"there are {', '.join(FURTHER)}"
            raise InputError(Problem(f"no further columns are '{name}'", hint=hint, rule="extra"))
    for name, add in FURTHER.items():
        equations = add(equations) if name in names else equations
    return equations


def _with_momenta(equations: Equations) -> Equations:
    from lagrange_cli.analysis.momenta import with_momenta

    return with_momenta(equations)


def _with_constants(equations: Equations) -> Equations:
    from lagrange_cli.analysis.constants_of_motion import with_constants_of_motion

    return with_constants_of_motion(equations)


#: Name → what adds its outputs, in this order. These need the coordinates of the scene.
FURTHER: Mapping[str, Callable[[Equations], Equations]] = {
    "momenta": _with_momenta,
    "conserved": _with_constants,
}
