"""The refusal of minimal form, with the reason why each closure stays."""

from __future__ import annotations

from collections.abc import Sequence

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.elimination.solve_equation import (
    linear_parts,
    solutions,
    solves_everywhere,
)
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import quoted

#: Reasons, of one constraint and of several.
_NONHOLONOMIC = (
    "cannot be integrated: it restricts velocities and no positions",
    "cannot all be integrated: they restrict velocities and no positions",
)
_INTEGRABLE = (
    "can be integrated, but not in closed form here",
    "can be integrated, but not in closed form here",
)
_BRANCHES = (
    "gives each coordinate by others in several ways, none of which need hold all along",
    "give each coordinate by others in several ways, none of which need hold all along",
)
_DIVIDES = (
    "gives a coordinate by others only where what it is divided by does not vanish",
    "give a coordinate by others only where what it is divided by does not vanish",
)
_OPEN = ("has no solution in closed form", "have no solution in closed form")


def no_minimal_form_error(reduced: Reduced) -> InputError:
    """The error of asking for a minimal form of a scene with closures, with their reasons."""
    statuses = {line.name: line.status for line in reduced.account.lines}
    reasons: dict[tuple[str, str], dict[str, None]] = {}
    for closure in reduced.closures:
        if closure.kind == "position":
            reason = _of_position(reduced, closure)
        else:
            is_free = statuses.get(closure.name) == "nonholonomic"
            reason = _NONHOLONOMIC if is_free else _INTEGRABLE
        reasons.setdefault(reason, {})[closure.name] = None
    told = "; ".join(_said(list(names), *reason) for reason, names in reasons.items())
    return InputError(
        Problem(
            f"there is no minimal form: {told}",
            reduced.closures[0].mark,
            hint="--formulation multiplier keeps such constraints beside the coordinates; auto"
            " does where it must",
            rule="formulation",
        )
    )


def _said(names: Sequence[str], one: str, several: str) -> str:
    return f"{quoted(names)} {one if len(names) == 1 else several}"


def _of_position(reduced: Reduced, closure: ClosureEquation) -> tuple[str, str]:
    """Reason why an equation between positions is not solved for a coordinate."""
    phi = closure.left - closure.right
    constants = frozenset(reduced.names.parameters.values())
    reason = _OPEN
    for q in (c.q for c in reduced.coordinates if c.q in phi.free_symbols):
        parts = linear_parts(phi, q)
        if parts is not None and not solves_everywhere(*parts, constants):
            return _DIVIDES
        if parts is None and solutions(phi, q):
            reason = _BRANCHES
    return reason
