"""The account of degrees of freedom: the contribution of each constraint, and faults.

Every constraint ends as *independent*, *satisfied* (the definitions fulfil it
identically), or *redundant* (others imply it). An account that cannot be balanced is an
error that names constraints and coordinates. Ranks are numerical, at random
feasible configurations; counts alone decide nothing.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import replace
from typing import Literal

import numpy as np
import sympy as sp

from lagrange_cli.errors import Problem
from lagrange_cli.mechanics.diagnosis import errors as refusals
from lagrange_cli.mechanics.diagnosis.inconsistency import proven_inconsistency
from lagrange_cli.mechanics.elimination.eliminate import StatedEquation
from lagrange_cli.mechanics.findings import Account, ConstraintLine
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.rank import (
    Matrix,
    SymbolValues,
    dependent_columns,
    dependent_gradients,
)
from lagrange_cli.mechanics.reduction.geometry import Geometry, IdentityFinder, classify_leftovers
from lagrange_cli.mechanics.symbols.convert import total_derivative
from lagrange_cli.mechanics.symbols.names import Names
from lagrange_cli.mechanics.symbols.quoting import quoted
from lagrange_cli.scene.bodies import ComposedExpression, bodies_of
from lagrange_cli.scene.language.expression import Equation
from lagrange_cli.scene.model import Constraint


def balanced_account(
    geometry: Geometry,
    points: Sequence[SymbolValues],
    closure_numbers: Sequence[int],
    holding: IdentityFinder,
) -> tuple[Account, list[Problem]]:
    """DOF = 3N + 6B + E − K with the status of each constraint; warnings for redundant ones.

    Parameters
    ----------
    points
        Feasible configurations.
    closure_numbers
        Numbers of the stated equations that are closures beside the coordinates.
    holding
        Selects from some equations those that hold identically around the start.

    Raises
    ------
    InputError
        An equation that its solution does not solve, or dependent coordinates.
    """
    names, elimination = geometry.names, geometry.elimination
    _require_solutions(geometry, points, holding)
    spinning = _spinning(geometry)
    _require_independent(geometry, points, closure_numbers, spinning)
    extra = _extra(geometry, points, spinning)
    dependent: dict[int, tuple[int, ...]] = {}
    if elimination.pending:
        phis = [_on_points(names, s.phi) for s in elimination.stated]
        dependent = dependent_gradients(phis, geometry.resolved, geometry.coordinates, points)
    satisfied = _satisfied(set(elimination.pending) - set(closure_numbers), dependent)
    return _account(geometry, satisfied, dependent, closure_numbers, extra), _warnings(
        geometry, dependent
    )


def with_partial_identities(
    geometry: Geometry,
    account: Account,
    warnings: Sequence[Problem],
    violated: Mapping[int, SymbolValues],
) -> tuple[Account, list[Problem]]:
    """Complete the account and its warnings by equations that restrict some configurations only.

    Parameters
    ----------
    account, warnings
        Results of :func:`balanced_account`; its warnings concern redundant equations.
    violated
        Configurations that violate equations, by their numbers.
    """
    stated, solved = geometry.elimination.stated, geometry.solved_sides
    partial = {stated[k].constraint for k in violated}
    lines = tuple(
        replace(x, on_a_part=True)
        if x.name in partial and x.status in ("satisfied", "redundant")
        else x
        for x in account.lines
    )
    by = {x.name: quoted(x.implied_by) for x in lines if x.status == "redundant"}
    places = [stated[k].equation.mark() for k in violated]
    remaining = [w for w in warnings if w.mark not in places]
    for k, point in violated.items():
        others = by.get(stated[k].constraint)
        what = "holds" if k in solved else "is satisfied by the definitions"
        if others and k not in solved:
            what = f"is redundant, implied by {others},"
        remaining.append(_partial(stated[k], what, k in solved, _values_at(geometry, k, point)))
    return replace(account, lines=lines), remaining


def _partial(stated: StatedEquation, what: str, is_solved: bool, place: str) -> Problem:
    as_solved = " as it was solved" if is_solved else ""
    return Problem(
        f"constraint '{stated.constraint}' {what} on a part of the configurations only{as_solved}:"
        f" not at {place}",
        stated.equation.mark(),
        hint="the motion goes on as if it held everywhere: leave the constraint out, or write it"
        " without roots and inverse functions",
        rule="on-a-part",
        severity="warning",
    )


def _values_at(geometry: Geometry, number: int, point: SymbolValues) -> str:
    sides = {**geometry.elimination.pending, **geometry.solved_sides}[number]
    present = symbols_in(sides[0]) | symbols_in(sides[1])
    shown = [s for s in (*geometry.coordinates, geometry.names.t) if s in present]
    return ", ".join(f"{s} = {float(point[s]):.3g}" for s in shown)


def _on_points(names: Names, phi: sp.Expr) -> sp.Expr:
    """Substitute the components of massless points, which do not move freely, in φ."""
    definitions = {
        s: names.given[s] for body in names.point_symbols for s in body if s in names.given
    }
    while present := {s: definitions[s] for s in symbols_in(phi) if s in definitions}:
        phi = phi.xreplace(present)
    return phi


def _satisfied(leftovers: set[int], dependent: Mapping[int, tuple[int, ...]]) -> set[int]:
    """Select remaining equations that definitions fulfil.

    An equation that depends on earlier ones may have been solved in place of one of them; the
    earlier one is independent then.
    """
    satisfied = leftovers - dependent.keys()
    for number, by in dependent.items():
        displaced = sorted(satisfied & set(by))
        if number not in leftovers and displaced:
            satisfied.discard(displaced[-1])
    return satisfied


def _require_solutions(
    geometry: Geometry, points: Sequence[SymbolValues], holding: IdentityFinder
) -> None:
    """Refuse solutions that do not solve their equation (an inverse function's other branch)."""
    elimination, solved = geometry.elimination, geometry.solved_sides
    wrong = [r.number for r in classify_leftovers(solved, points) if not r.identity]
    identities = holding({k: solved[k] for k in wrong}) if wrong else ()
    for number in wrong:
        if number not in identities:
            names = geometry.names
            proven = proven_inconsistency(names, elimination.stated, [number], geometry.reference)
            raise proven or refusals.no_solution_error(elimination.stated[number])


def _account(
    geometry: Geometry,
    satisfied: set[int],
    dependent: Mapping[int, tuple[int, ...]],
    closure_numbers: Sequence[int],
    extra: int,
) -> Account:
    elimination = geometry.elimination
    counted = {*geometry.positions} | _further(geometry) | _placing(geometry)
    dof = len(geometry.coordinates) - len(closure_numbers)
    bodies = bodies_of(geometry.names.scene)
    cartesian = len(geometry.positions) - 3 * len(bodies)
    of_bodies = sum(3 if body.planar else 6 for body in bodies)
    constraints = cartesian + of_bodies + extra - dof
    # Equations that fix names of massless points restrict no particle.
    for_points = sum(
        s not in counted and number not in dependent for s, number in elimination.by.items()
    )
    # Four parts of a quaternion of length 1 are three freedoms of a body's six.
    lengths = geometry.names.scene.lengths
    counted_numbers = [k for k, e in enumerate(elimination.stated) if e.constraint not in lengths]
    independent = len(counted_numbers) - len(dependent.keys() & {*counted_numbers}) - for_points
    return Account(
        cartesian=cartesian,
        extra=extra,
        constraints=constraints,
        dof=dof,
        implied=max(0, constraints - independent),
        lines=tuple(_lines(geometry, satisfied, dependent)),
        chosen_automatically=geometry.names.scene.coordinates is None,
        bodies=len(bodies),
        of_bodies=of_bodies,
    )


def _require_independent(
    geometry: Geometry,
    points: Sequence[SymbolValues],
    closure_numbers: Sequence[int],
    spinning: Set[sp.Symbol],
) -> None:
    """Refuse coordinates that move the particles in fewer independent ways than there are.

    A closure that a motion violates counts as a way, and so does the rate of a coordinate
    that has kinetic energy of its own.
    """
    pending = geometry.elimination.pending
    r = geometry.places
    closures = [pending[k][0] - pending[k][1] for k in closure_numbers]
    moving = geometry.moving(closures)
    r += closures
    r += [q for q in moving if q in spinning]
    null = _unmoved(r, moving, points)
    if null is None:
        return
    weights = np.abs(null).max(axis=0)
    mixed = [q for q, w in zip(moving, weights, strict=True) if w > 1e-6]
    raise refusals.dependence_error(
        geometry.names.scene,
        [q.name for q in geometry.coordinates],
        [q.name for q in mixed],
        len(moving) - len(null),
    )


def _extra(geometry: Geometry, points: Sequence[SymbolValues], spinning: Set[sp.Symbol]) -> int:
    """E: the number of independent changes of the coordinates that move no particle or body."""
    moving = geometry.moving()
    solved = _further(geometry) - {*geometry.coordinates}
    outside = len(geometry.coordinates) - len(moving) + len(solved)
    if spinning.isdisjoint(moving):
        return outside
    null = _unmoved(geometry.places, moving, points)
    return outside + (0 if null is None else len(null))


def _further(geometry: Geometry) -> set[sp.Symbol]:
    """Dependent names in no position, and in no turn of a body."""
    names = geometry.names
    turning = map(symbols_in, geometry.raw_rotations)
    return {*names.dependent}.difference(*map(symbols_in, names.given.values()), *turning)


def _placing(geometry: Geometry) -> set[sp.Symbol]:
    """Dependent names in positions of particles, and in turns of bodies."""
    definitions = geometry.names.given
    seen = set[sp.Symbol]().union(*map(symbols_in, geometry.raw_rotations))
    pending = [s for s in geometry.positions if s in definitions]
    while pending:
        fresh = symbols_in(definitions[pending.pop()]) - seen
        seen |= fresh
        pending += [s for s in fresh if s in definitions]
    return seen.intersection(geometry.names.dependent)


def _spinning(geometry: Geometry) -> Set[sp.Symbol]:
    """Coordinates whose rates stand in the section ``kinetic``, directly or through names."""
    names, t = geometry.names, geometry.names.t
    rates = {q: sp.Dummy(real=True) for q in geometry.coordinates}

    def rate(expr: sp.Expr) -> sp.Expr:
        placed = {s: geometry.resolved[s] for s in symbols_in(expr) & geometry.resolved.keys()}
        place = expr.xreplace(placed) if placed else expr
        moving = sorted(symbols_in(place) & rates.keys(), key=geometry.order.__getitem__)
        return total_derivative(place, t, [(q, rates[q]) for q in moving])

    symbols, meanings = set[sp.Symbol](), dict[str, sp.Expr]()
    for term in names.scene.kinetic:
        symbols |= symbols_in(names.convert(term.expression, rate, meanings))
    return {q for q, rate_of_q in rates.items() if rate_of_q in symbols}


def _unmoved(
    r: Sequence[sp.Expr], moving: Sequence[sp.Symbol], points: Sequence[SymbolValues]
) -> Matrix | None:
    """Directions of the coordinates that leave ``r`` unchanged; None if there are none."""
    if {*moving} <= {*r}:
        return None  # each coordinate is a Cartesian component itself
    return dependent_columns(r, moving, points)


def _lines(
    geometry: Geometry, satisfied: set[int], dependent: Mapping[int, tuple[int, ...]]
) -> list[ConstraintLine]:
    stated = geometry.elimination.stated
    numbered: dict[str, list[int]] = {}
    for k, equation in enumerate(stated):
        numbered.setdefault(equation.constraint, []).append(k)
    lines = []
    for constraint in geometry.names.scene.constraints:
        numbers = numbered.get(constraint.name, [])
        implied_by = [stated[j].constraint for k in numbers for j in dependent.get(k, ())]
        joint = constraint.joint
        lines.append(
            ConstraintLine(
                name=constraint.name,
                equations=tuple(e.text for e in constraint.equations),
                status=_status(numbers, satisfied, dependent),
                implied_by=tuple(dict.fromkeys(n for n in implied_by if n != constraint.name)),
                rheonomic=any(_depends_on_time(geometry.names, stated[k].phi) for k in numbers),
                joint=() if joint is None else (joint.kind, *joint.parts),
                idle=0 if joint is None else sum(k in dependent for k in numbers),
                satisfied=0 if joint is None else sum(k in satisfied for k in numbers),
            )
        )
    for one_sided, gap in zip(geometry.names.scene.unilateral, geometry.gaps, strict=True):
        lines.append(
            ConstraintLine(
                gap.name,
                (gap.text,),
                "unilateral",
                rheonomic=geometry.names.t in symbols_in(gap.left - gap.right),
                restitution=one_sided.restitution.text if one_sided.restitution else "",
            )
        )
    return lines


def _depends_on_time(names: Names, phi: sp.Expr) -> bool:
    """Tell whether t stands in a constraint, or in the position of a point in it."""
    points = {s: names.given[s] for body in names.point_symbols for s in body if s in names.given}
    while symbols_in(phi) & points.keys():
        phi = phi.xreplace(points)
    return names.t in symbols_in(phi)


def _status(
    numbers: Sequence[int], satisfied: set[int], dependent: Mapping[int, tuple[int, ...]]
) -> Literal["independent", "satisfied", "redundant"]:
    if numbers and all(k in dependent for k in numbers):
        return "redundant"
    if numbers and all(k in satisfied or k in dependent for k in numbers):
        return "satisfied"
    return "independent"


def _warnings(geometry: Geometry, dependent: Mapping[int, tuple[int, ...]]) -> list[Problem]:
    stated = geometry.elimination.stated
    joints: dict[str, list[int]] = {}
    for k in dependent:
        if stated[k].joint:
            joints.setdefault(stated[k].constraint, []).append(k)
    return [
        *(
            redundant_warning(
                stated[k].constraint, stated[k].equation, [stated[j].constraint for j in by]
            )
            for k, by in dependent.items()
            if not stated[k].joint
        ),
        *(
            _idle_joint(stated, constraint, joints[constraint.name], dependent)
            for constraint in geometry.names.scene.constraints
            if constraint.name in joints
        ),
    ]


def _idle_joint(
    stated: Sequence[StatedEquation],
    constraint: Constraint,
    numbers: Sequence[int],
    dependent: Mapping[int, tuple[int, ...]],
) -> Problem:
    """Warn of equations of a joint that others imply: a loop that moves though it has too many."""
    name, count = constraint.name, len(constraint.equations)
    by = dict.fromkeys(stated[j].constraint for k in numbers for j in dependent[k])
    further = [cause for cause in by if cause != name]
    reasons = ["its others"] if name in by else []
    reasons += [quoted(further)] if further else []
    are = "is" if len(numbers) == 1 else "are"
    reason = (
        f"implied by {' and '.join(reasons)}" if reasons else "the frames satisfy what they say"
    )
    return Problem(
        f"{len(numbers)} of the {count} equations of constraint '{name}' {are} redundant: {reason}",
        stated[numbers[0]].equation.mark(),
        hint="redundant: " + "; ".join(stated[k].equation.text for k in numbers),
        rule="redundant",
        severity="warning",
    )


def redundant_warning(
    name: str, equation: Equation, by: Sequence[str], by_definitions: bool = False
) -> Problem:
    nothing = "implied by the definitions" if by_definitions else "it restricts nothing"
    reason = f"implied by {quoted(by)}" if by else nothing
    if isinstance(equation.left, ComposedExpression):
        return Problem(
            f"an equation of constraint '{name}' is redundant: {reason}",
            equation.mark(),
            hint=f"redundant: {equation.text}",
            rule="redundant",
            severity="warning",
        )
    return Problem(
        f"constraint '{name}' is redundant: {reason}",
        equation.mark(),
        rule="redundant",
        severity="warning",
    )
