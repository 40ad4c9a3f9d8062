"""Warn of constraints whose gradients lose rank at the initial configuration.

A linkage whose bars lie in one line can leave it in two ways: there the
gradients of its closures depend on each other, and the accelerations are not
determined.
"""

from __future__ import annotations

from collections.abc import Mapping

import sympy as sp

from lagrange_cli.errors import Mark, Problem
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.initial.suggestions import other_start_hint
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate
from lagrange_cli.mechanics.numerics.rank import (
    RANK_TOLERANCE,
    DoubleRow,
    dependent_rows,
    normalized_row,
)
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.system import Closure, Contact, InitialState


def rank_deficiency_warning(
    derivation: Uncertified, initial: InitialState | None
) -> Problem | None:
    """Build the warning that names closures whose gradients depend on each other at the start.

    The gradients of gaps that are closed there count too.
    """
    closures = derivation.closures
    if initial is None or not derivation.pushing:
        return None
    try:
        point = _configuration(derivation, initial)
        rows = _gradients(derivation.pushing, point)
        closed = [k for k, c in enumerate(derivation.contacts, len(closures)) if _closed(c, point)]
    except (DomainError, KeyError):
        return None
    closure_numbers = range(len(closures))
    for numbers in (closure_numbers, *([*closure_numbers, k] for k in closed)):
        for number, circuit in dependent_rows([rows[k] for k in numbers]).items():
            taking_part = sorted(numbers[k] for k in (*circuit, number))
            return _warning([derivation.pushing[k] for k in taking_part], derivation)
    return None


def _closed(contact: Contact, point: Mapping[sp.Symbol, sp.Expr]) -> bool:
    """Tell whether a gap is zero but for rounding."""
    gap = contact.closure.expression
    value, *terms = evaluate([gap, *sp.Add.make_args(gap)], point)
    return bool(abs(value) <= RANK_TOLERANCE * sum(map(abs, terms)))


def _configuration(derivation: Uncertified, initial: InitialState) -> Mapping[sp.Symbol, sp.Expr]:
    reduced = derivation.reduced
    point = dict(reduced.reference)
    symbols = [c.q for c in reduced.coordinates]
    point.update(zip(symbols, map(type(point[reduced.names.t]), initial.positions), strict=True))
    return point


def _gradients(
    closures: tuple[Closure, ...], point: Mapping[sp.Symbol, sp.Expr]
) -> list[DoubleRow]:
    """Φ at a configuration, the largest entry of each row 1."""
    gradients = [entries(c.gradient) for c in closures]
    pending = iter(evaluate([e for row in gradients for e in row.values()], point))
    return [normalized_row({j: next(pending) for j in row}) for row in gradients]


def _warning(taking_part: list[Closure], derivation: Uncertified) -> Problem:
    named = ", ".join(f"'{closure.name}'" for closure in taking_part)
    verb, their = ("is", "its gradient vanishes")
    if len(taking_part) > 1:
        verb, their = ("are", "their gradients depend on each other")
    mark = next((c.mark for c in taking_part if c.mark is not None), None)
    return Problem(
        f"constraint{'s' if len(taking_part) > 1 else ''} {named} {verb} singular at the initial"
        f" configuration: {their} there, and the accelerations are not determined",
        mark or Mark(derivation.reduced.scene.file, 1, 1),
        hint=other_start_hint(derivation.reduced),
        rule="singular",
        severity="warning",
    )
