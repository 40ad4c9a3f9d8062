"""The refusal of minimal form, with the reason why each closure stays."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.elimination.solve_equation import (
    linear_parts,
    solutions,
    solves_everywhere,
)
from lagrange_cli.mechanics.reduction.geometry import ClosureEquation
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import quoted

#: Reasons, phrased for one constraint and for several.
_NONHOLONOMIC = (
    "cannot be integrated: it restricts velocities and no positions",
    "cannot all be integrated: together they restrict velocities more than positions",
)
_INTEGRABLE = (
    "can be integrated, but no closed form of its integral was found",
    "can be integrated, but no closed form of their integrals was found",
)
_FORCED = (
    "gives by others only coordinates that a force acts on",
    "give by others only coordinates that a force acts on",
)
_DIVIDES = (
    "gives a coordinate by others only where what it is divided by does not vanish",
    "give a coordinate by others only where what it is divided by does not vanish",
)
_PARTLY = (
    "gives a coordinate by others only where a root or inverse function is real",
    "give a coordinate by others only where a root or inverse function is real",
)
_BRANCHES = (
    "gives coordinates by others in several ways, none of which need hold all along",
    "give coordinates by others in several ways, none of which need hold all along",
)
_OPEN = ("has no solution in closed form", "have no solution in closed form")


def no_minimal_form_error(reduced: Reduced) -> InputError:
    """Build the refusal of a minimal form for a scene with closures, with their reasons."""
    statuses = {line.name: line.status for line in reduced.account.lines}
    reasons: dict[tuple[str, str], dict[str, None]] = {}
    for closure in reduced.closures:
        if closure.kind == "position":
            reason = _of_position(reduced, closure)
        else:
            is_free = statuses.get(closure.name) == "nonholonomic"
            reason = _NONHOLONOMIC if is_free else _INTEGRABLE
        reasons.setdefault(reason, {})[closure.name] = None
    phrase = "; ".join(_said(list(names), *reason) for reason, names in reasons.items())
    return InputError(
        Problem(
            f"there is no minimal form: {phrase}",
            reduced.closures[0].mark,
            hint="--formulation multiplier keeps such constraints beside the coordinates; auto"
            " does where it must",
            rule="formulation",
        )
    )


def _said(names: Sequence[str], one: str, several: str) -> str:
    return f"{quoted(names)} {one if len(names) == 1 else several}"


def _of_position(reduced: Reduced, closure: ClosureEquation) -> tuple[str, str]:
    """Find the reason why an equation between positions is not solved for a coordinate.

    If there are undeclared names, it should be solved for these.
    """
    phi = closure.left - closure.right
    involved = [c for c in reduced.coordinates if c.q in phi.free_symbols]
    declared = reduced.names.coordinates
    opened = [c for c in involved if c.name not in declared] if declared else []
    reasons = {_reason(reduced, phi, c.q) for c in opened or involved}
    if opened and reasons == {_OPEN}:
        named = quoted([c.name for c in opened])
        return f"gives {named} in no closed form", f"give {named} in no closed form"
    return next(r for r in (_FORCED, _DIVIDES, _PARTLY, _BRANCHES, _OPEN) if r in reasons)


def _reason(reduced: Reduced, phi: sp.Expr, q: sp.Symbol) -> tuple[str, str]:
    """Find the reason why φ = 0 is not solved for one coordinate."""
    parts = linear_parts(phi, q)
    if parts is not None:
        constants = frozenset(reduced.names.parameters.values())
        return _FORCED if solves_everywhere(*parts, constants) else _DIVIDES
    branches = solutions(phi, q) or []
    if not branches:
        return _OPEN
    return _BRANCHES if len(branches) > 1 else _PARTLY
