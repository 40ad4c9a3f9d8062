"""The account of degrees of freedom: what each constraint contributes, and what is wrong.

Every constraint ends as *independent*, *satisfied* (the definitions fulfil it
identically), or *redundant* (others imply it). What cannot be balanced is an
error that names constraints and coordinates. Ranks are numerical, at random
feasible configurations; nothing is only counted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.mechanics.elimination import Elimination, Stated, eliminate
from lagrange_cli.mechanics.equations import Account, ConstraintLine
from lagrange_cli.mechanics.names import Names
from lagrange_cli.mechanics.sampling import STARTS, Sampler, double
from lagrange_cli.mechanics.tape import DomainError, Tape, values
from lagrange_cli.scene.model import Scene

__all__ = ["balance", "require_enough", "require_solved"]

#: Relative tolerance of consistency and rank (so that √6/4 may be written in decimals).
TOLERANCE = 1e-9

#: Configurations at which identities and ranks are looked at.
POINTS = 3


def require_solved(found: Elimination) -> None:
    """Refuse a constraint that still holds an unknown: it has no closed-form solution."""
    for number, (left, right) in found.pending.items():
        open_names = [u for u in found.unknowns if u in (left - right).free_symbols]
        if open_names:
            raise _no_closed_form(found.stated[number], open_names)


def require_enough(scene: Scene, found: Elimination) -> None:
    """Refuse declared coordinates when more names are open than equations are left."""
    excess = len(found.unknowns) - len(found.pending)
    if scene.coordinates is not None and excess > 0:
        raise _too_few(scene, found, excess)


def _no_closed_form(stated: Stated, unknowns: Sequence[sp.Symbol]) -> InputError:
    listed = ", ".join(f"'{u}'" for u in unknowns)
    return InputError(
        Problem(
            f"constraint '{stated.constraint}' has no closed-form solution for {listed};"
            " implicit constraints are not supported yet",
            stated.equation.mark(),
            hint="declare 'coordinates' and give the Cartesian names in 'definitions'",
            rule="not-supported-yet",
        )
    )


def _too_few(scene: Scene, found: Elimination, excess: int) -> InputError:
    open_names = [u.name for u in found.unknowns]
    have = [c.name for c in scene.coordinates or ()]
    listed = ", ".join(f"'{m}'" for m in open_names)
    which = listed if excess == len(open_names) else f"{excess} of {listed}"
    return InputError(
        Problem(
            f"too few coordinates: nothing determines {which}"
            f" ({len(have)} declared, {len(have) + excess} degrees of freedom)",
            scene.coordinates_mark,
            hint=f"coordinates: [{', '.join([*have, *open_names[:excess]])}]",
            rule="too-few-coordinates",
        )
    )


@dataclass(frozen=True)
class _Leftover:
    """A stated equation that no unknown was solved from: its values at feasible points."""

    number: int
    reduced: sp.Expr
    identity: bool
    constant: bool


def balance(
    scene: Scene,
    names: Names,
    found: Elimination,
    resolved: Mapping[sp.Symbol, sp.Expr],
    coordinates: Sequence[sp.Symbol],
    sampler: Sampler,
    chosen: bool,
    stated: Sequence[Stated],
    reference: Mapping[sp.Symbol, mpf],
) -> tuple[Account, list[Problem]]:
    """DOF = 3N + E − K with the status of each constraint; warnings for redundant ones.

    Raises
    ------
    InputError
        Inconsistent constraints, dependent or superfluous coordinates, or no
        feasible configuration.
    """
    points = _feasible(scene, found, sampler)
    leftovers = [_leftover(k, sides, points) for k, sides in found.pending.items()]
    for leftover in leftovers:
        if not leftover.identity:
            raise _unbalanced(names, found, stated, leftover, coordinates, reference)
    positions = [s for body in names.particle_symbols for s in body]
    _require_independent(scene, resolved, positions, coordinates, points)
    dependent = _dependent(stated, resolved, points) if leftovers else {}
    satisfied = {x.number for x in leftovers} - dependent.keys()
    inside = {s for p in positions for s in resolved[p].free_symbols}
    extra = sum(q not in inside for q in coordinates)
    cartesian = len(positions)
    constraints = cartesian + extra - len(coordinates)
    particle_names = set(positions)
    for_points = sum(
        1 for s, number in found.by.items() if s not in particle_names and number not in dependent
    )
    independent = len(stated) - len(dependent) - for_points
    account = Account(
        cartesian=cartesian,
        extra=extra,
        constraints=constraints,
        dof=len(coordinates),
        implied=max(0, constraints - independent),
        lines=tuple(_lines(scene, names, stated, satisfied, dependent)),
        chosen_automatically=chosen,
    )
    return account, _redundancy_warnings(scene, stated, dependent)


def _feasible(scene: Scene, found: Elimination, sampler: Sampler) -> list[dict[sp.Symbol, mpf]]:
    points = [p for p in (sampler.draw() for _ in range(POINTS)) if p is not None]
    if len(points) == POINTS:
        return points
    suspects = sorted(set(found.by.values()))
    nonlinear = [found.stated[k] for k in suspects] or list(found.stated)
    named = ", ".join(f"'{c}'" for c in dict.fromkeys(s.constraint for s in nonlinear))
    mark = nonlinear[0].equation.mark() if nonlinear else _scene_mark(scene)
    raise InputError(
        Problem(
            f"no configuration found in {STARTS} starts that satisfies {named or 'the scene'}",
            mark,
            hint="give one in 'initial' or 'near'",
            rule="inconsistent",
        )
    )


def _scene_mark(scene: Scene) -> Mark:
    return Mark(scene.file, 1, 1)


def _leftover(
    number: int, sides: tuple[sp.Expr, sp.Expr], points: Sequence[Mapping[sp.Symbol, mpf]]
) -> _Leftover:
    """Evaluate a reduced equation at feasible points: an identity, a contradiction or a relation."""
    left, right = sides
    phi = left - right
    if phi == 0:
        return _Leftover(number, phi, identity=True, constant=True)
    terms = [*sp.Add.make_args(left), *sp.Add.make_args(right)]
    relative = []
    for point in points:
        *parts, total = values([*terms, phi], point)
        scale = sum((abs(x) for x in parts), mpf(0))
        relative.append(total / scale if scale else total)
    identity = all(abs(x) <= TOLERANCE for x in relative)
    spread = max(relative) - min(relative)
    return _Leftover(number, phi, identity, constant=bool(spread <= TOLERANCE))


def _unbalanced(
    names: Names,
    found: Elimination,
    stated: Sequence[Stated],
    leftover: _Leftover,
    coordinates: Sequence[sp.Symbol],
    reference: Mapping[sp.Symbol, mpf],
) -> InputError:
    """The error for a stated equation that no configuration of the coordinates satisfies."""
    this = stated[leftover.number]
    involved = [q for q in coordinates if q in leftover.reduced.free_symbols]
    if leftover.constant or not involved:
        return _contradiction(names, found, stated, leftover, reference)
    listed = ", ".join(f"'{q}'" for q in involved)
    if len(involved) == 1:
        message = f"too many coordinates: constraint '{this.constraint}' fixes {listed}"
    else:
        message = f"too many coordinates: constraint '{this.constraint}' relates {listed}"
    rest = [q.name for q in coordinates if q != involved[-1]]
    return InputError(
        Problem(
            f"{message} ({len(coordinates)} declared)",
            this.equation.mark(),
            hint=f"coordinates: [{', '.join(rest)}]",
            rule="too-many-coordinates",
        )
    )


def _contradiction(
    names: Names,
    found: Elimination,
    stated: Sequence[Stated],
    leftover: _Leftover,
    reference: Mapping[sp.Symbol, mpf],
) -> InputError:
    suspects = sorted(found.touched[leftover.number] | {leftover.number})
    smallest = _smallest(names, stated, suspects, reference)
    this = stated[leftover.number]
    named = list(dict.fromkeys(stated[k].constraint for k in smallest))
    if len(named) == 1:
        which = f"constraint '{named[0]}' contradicts "
        which += "itself" if len(smallest) > 1 else "the definitions"
    else:
        which = "constraints " + ", ".join(f"'{n}'" for n in named) + " contradict each other"
    reduced = str(leftover.reduced).replace("**", "^")
    return InputError(
        Problem(
            f"{which}: together they give {reduced} = 0",
            this.equation.mark(),
            hint="\n".join(f"{stated[k].constraint}: {stated[k].equation.text}" for k in smallest),
            rule="inconsistent",
        )
    )


def _smallest(
    names: Names,
    stated: Sequence[Stated],
    suspects: list[int],
    reference: Mapping[sp.Symbol, mpf],
) -> list[int]:
    """A subset that contradicts itself and of which no member can be left out.

    The deletion filter of Chinneck and Dravnieks (ORSA J. Computing 3, 1991).
    """
    kept = list(suspects)
    for candidate in suspects:
        fewer = [k for k in kept if k != candidate]
        if _contradicts(names, [stated[k] for k in fewer], reference):
            kept = fewer
    return kept


def _contradicts(
    names: Names, stated: Sequence[Stated], reference: Mapping[sp.Symbol, mpf]
) -> bool:
    declared = set(names.coordinates.values())
    unknowns = [s for s in names.cartesian.values() if s not in names.given and s not in declared]
    constants = frozenset(names.parameters.values())
    try:
        found = eliminate(stated, names.given, unknowns, reference, constants)
    except InputError:
        return False
    for left, right in found.pending.values():
        phi = (left - right).xreplace(
            {s: sp.Float(x, 40) for s, x in reference.items() if s in constants}
        )
        if phi.is_number and abs(phi.evalf(30)) > TOLERANCE * _size(left, right, reference):
            return True
    return False


def _size(left: sp.Expr, right: sp.Expr, reference: Mapping[sp.Symbol, mpf]) -> mpf:
    terms = [*sp.Add.make_args(left), *sp.Add.make_args(right)]
    total = mpf(0)
    for term in terms:
        try:
            total += abs(values([term], {s: reference[s] for s in term.free_symbols})[0])
        except (DomainError, KeyError):
            total += 1
    return total


def _jacobian(
    functions: Sequence[sp.Expr],
    variables: Sequence[sp.Symbol],
    point: Mapping[sp.Symbol, mpf],
) -> np.ndarray:
    """∂functions/∂variables at a point, rows scaled to unit length; shape (functions, variables)."""
    others = [s for s in point if s not in set(variables)]
    inputs = [*variables, *others]
    run = Tape(functions, inputs).run([(point[s], mpf(0), mpf(0)) for s in inputs], order=0)
    rows = np.zeros((len(functions), len(variables)))
    for k in range(len(functions)):
        gradient = run.gradient({k: (mpf(1), mpf(0), mpf(0))})
        row = [g[0] for g in gradient[: len(variables)]]
        largest = max((abs(x) for x in row), default=mpf(0))
        if largest:
            rows[k] = [double(x / largest) for x in row]
    return rows


def _require_independent(
    scene: Scene,
    resolved: Mapping[sp.Symbol, sp.Expr],
    positions: Sequence[sp.Symbol],
    coordinates: Sequence[sp.Symbol],
    points: Sequence[Mapping[sp.Symbol, mpf]],
) -> None:
    """Refuse coordinates that move the particles in fewer independent ways than there are."""
    r = [resolved[s] for s in dict.fromkeys(positions) if resolved[s].free_symbols]
    inside = {s for e in r for s in e.free_symbols}
    moving = [q for q in coordinates if q in inside]
    if all(q in r for q in moving):
        return  # each coordinate is a Cartesian component itself
    best: np.ndarray | None = None
    for point in points:
        matrix = _jacobian(r, moving, point)
        scaled = matrix / np.maximum(np.linalg.norm(matrix, axis=0), 1e-300)
        _, sizes, right = np.linalg.svd(scaled, full_matrices=True)
        null = right[int(np.sum(sizes > TOLERANCE * max(sizes[0], 1e-300))) :]
        if not len(null):
            return
        best = null
    assert best is not None
    weights = np.abs(best).max(axis=0)
    mixed = [q.name for q, w in zip(moving, weights, strict=True) if w > 1e-6]
    rest = [q.name for q in coordinates if q.name != mixed[-1]]
    listed = ", ".join(f"'{m}'" for m in mixed)
    raise InputError(
        Problem(
            f"the coordinates {listed} are not independent:"
            f" they move the particles in {len(moving) - len(best)} ways only",
            scene.coordinates_mark,
            hint=f"coordinates: [{', '.join(rest)}]",
            rule="dependent-coordinates",
        )
    )


def _dependent(
    stated: Sequence[Stated],
    resolved: Mapping[sp.Symbol, sp.Expr],
    points: Sequence[Mapping[sp.Symbol, mpf]],
) -> dict[int, tuple[int, ...]]:
    """Stated equations whose gradients depend on earlier ones' at every feasible point.

    Gradients are taken over Cartesian names and coordinates, before anything is
    eliminated, so that definitions play no part. Maps the number of an equation
    to those that imply it.
    """
    phis = [s.phi for s in stated]
    variables = list(
        dict.fromkeys(
            v
            for phi in phis
            for v in sorted(phi.free_symbols, key=str)
            if v in resolved or v in _coordinates_of(resolved)
        )
    )
    found: dict[int, tuple[int, ...]] | None = None
    for point in points:
        everywhere = dict(point)
        symbols = [s for s in resolved if s not in everywhere]
        positions = values([resolved[s] for s in symbols], point)
        everywhere.update(zip(symbols, positions, strict=True))
        here = _dependent_rows(_jacobian(phis, variables, everywhere))
        found = here if found is None else {k: v for k, v in found.items() if k in here}
    return found or {}


def _coordinates_of(resolved: Mapping[sp.Symbol, sp.Expr]) -> set[sp.Symbol]:
    return {s for e in resolved.values() for s in e.free_symbols}


def _dependent_rows(matrix: np.ndarray) -> dict[int, tuple[int, ...]]:
    """Rows that are combinations of earlier independent rows, with the rows that take part."""
    basis: list[int] = []
    dependent: dict[int, tuple[int, ...]] = {}
    for k, row in enumerate(matrix):
        size = np.linalg.norm(row)
        if not size:
            dependent[k] = ()
            continue
        if basis:
            shares, *_ = np.linalg.lstsq(matrix[basis].T, row, rcond=1e-12)
            if np.linalg.norm(matrix[basis].T @ shares - row) <= TOLERANCE * size:
                part = np.abs(shares) > 1e-7 * np.abs(shares).max()
                dependent[k] = tuple(b for b, p in zip(basis, part, strict=True) if p)
                continue
        basis.append(k)
    return dependent


def _lines(
    scene: Scene,
    names: Names,
    stated: Sequence[Stated],
    satisfied: set[int],
    dependent: Mapping[int, tuple[int, ...]],
) -> list[ConstraintLine]:
    lines = []
    for constraint in scene.constraints:
        numbers = [k for k, s in enumerate(stated) if s.constraint == constraint.name]
        implied_by = [stated[j].constraint for k in numbers for j in dependent.get(k, ())]
        status = "independent"
        if numbers and all(k in dependent for k in numbers):
            status = "redundant"
        elif numbers and all(k in satisfied or k in dependent for k in numbers):
            status = "satisfied"
        lines.append(
            ConstraintLine(
                name=constraint.name,
                equations=tuple(e.text for e in constraint.equations),
                status=status,  # type: ignore[arg-type]
                implied_by=tuple(dict.fromkeys(n for n in implied_by if n != constraint.name)),
                rheonomic=any(names.t in stated[k].phi.free_symbols for k in numbers),
            )
        )
    return lines


def _redundancy_warnings(
    scene: Scene, stated: Sequence[Stated], dependent: Mapping[int, tuple[int, ...]]
) -> list[Problem]:
    warnings = []
    for k, by in dependent.items():
        this = stated[k]
        others = list(dict.fromkeys(stated[j].constraint for j in by))
        implied = ", ".join(f"'{n}'" for n in others) or "nothing else"
        warnings.append(
            Problem(
                f"constraint '{this.constraint}' is redundant: implied by {implied}",
                this.equation.mark(),
                rule="redundant",
                severity="warning",
            )
        )
    return warnings
