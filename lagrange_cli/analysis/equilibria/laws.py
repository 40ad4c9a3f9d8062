"""Laws of equilibrium: equations between coordinates and parameters, for all values of these.

The principle of virtual work gives them where it is solved in symbols: m g a = b F of a lever,
tan θ = m g / (2 F) of a ladder. Equations are such a law if the forces balance wherever they hold,
and if they hold all along a branch of the equilibria, so that they ask for no more than that.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Literal, TypeAlias

import sympy as sp

from lagrange_cli.analysis.equilibria.closed_forms import (
    Branch,
    ClosedForms,
    Solver,
    closed_forms,
)
from lagrange_cli.analysis.equilibria.repeats import without_opposites
from lagrange_cli.analysis.equilibria.rest_system import RestSystem
from lagrange_cli.mechanics.algebra.substitution import has_value
from lagrange_cli.mechanics.proofs.zero_test import vanish

LawVerdict: TypeAlias = Literal["proven", "unbalanced", "narrow", "undecided"]
"""Verdict on a law: ``unbalanced`` if forces do not balance where it holds, ``narrow`` if no branch
of the equilibria obeys it."""


def without_values(system: RestSystem) -> RestSystem:
    """Return the same equations of equilibrium for all values of the parameters."""
    return replace(system, known={})


def laws_of_equilibrium(system: RestSystem) -> ClosedForms | None:
    """Solve for all values of the parameters, laws first; None beyond the budget."""
    forms = closed_forms(without_values(system))
    if forms is None:
        return None
    points = without_opposites(system.equations, forms.points)
    return replace(forms, points=tuple(sorted(points, key=lambda p: -len(p.free))))


def law_verdict(system: RestSystem, residuals: Sequence[sp.Expr]) -> LawVerdict:
    """Decide whether ``residuals`` = 0 together are a law of equilibrium.

    Parameters
    ----------
    system
        The equations of equilibrium.
    residuals
        Left sides less right sides, over coordinates and parameters.
    """
    general = without_values(system)
    coordinates = [c.q for c in system.equations.system.coordinates]
    solver = Solver(general, exhaustive=True)
    places = list(solver.run((*residuals, *general.constraints), coordinates))
    if not all(_balances(general, place) for place in places):
        return "unbalanced"
    if not places:
        return "narrow" if solver.complete else "undecided"
    equilibria = Solver(general)
    everything = (*general.forces, *general.constraints)
    for branch in equilibria.run(everything, general.unknowns):
        if branch.is_trial:
            continue  # perhaps a part of a branch that was not found
        if _vanish_in(branch, everything) and _vanish_in(branch, residuals):
            return "proven" if solver.complete else "undecided"
    return "narrow" if equilibria.complete else "undecided"


def _balances(system: RestSystem, place: Branch) -> bool:
    """Say whether multipliers balance the forces all along a branch of configurations."""
    multipliers = [c.multiplier for c in system.equations.system.closures]
    solution = place.solution
    forces = [place.under_relations(f.xreplace(solution)) for f in system.forces]
    if not all(map(has_value, forces)):
        return True  # no configuration: a divisor vanishes
    return any(not branch.conditions for branch in _solved_for(system, forces, multipliers))


def _solved_for(
    system: RestSystem, forces: Sequence[sp.Expr], multipliers: Sequence[sp.Symbol]
) -> Iterator[Branch]:
    if multipliers:
        yield from Solver(system).run(forces, multipliers)
    elif vanish(*forces):
        yield Branch((), ())


def _vanish_in(branch: Branch, expressions: Sequence[sp.Expr]) -> bool:
    solution = branch.solution
    placed = [branch.under_relations(e.xreplace(solution)) for e in expressions]
    return all(map(has_value, placed)) and vanish(*placed)
