"""Ends of tables, and slips that vanish, beyond which the equations do not hold."""

from __future__ import annotations

from collections.abc import Set
from fractions import Fraction
from itertools import chain
from typing import TYPE_CHECKING

import sympy as sp

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.tabulated import Tabulated, borders
from lagrange_cli.notation.scene_language import to_scene_language
from lagrange_cli.simulate.model.expressions import distinct_parts, forces_and_inertias

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sympy import Expr, Symbol

    from lagrange_cli.mechanics.equations import Equations


def table_ends(equations: Equations) -> list[tuple[str, Expr]]:
    """List the ends of the tables in equations, each with what is positive within.

    ``equations``: those of a simulation, with functions of time in place of inputs.

    Raises
    ------
    InputError
        The argument of such a table holds an input whose values are only known in the run.
    """
    ends: dict[tuple[str, Expr], None] = {}
    inputs = {u.symbol: u.name for u in equations.system.inputs}
    for part in distinct_parts(_evaluated(equations)):
        if isinstance(part, Tabulated):
            for within, end, _ in borders(part):
                name = f"{part.token.name}({float(end):g})"
                for symbol in sorted(within.free_symbols & inputs.keys(), key=str):
                    raise _unwatched(part.token.name, inputs[symbol])
                ends[name, within] = None
    return list(ends)


#: Part of the largest speed of the start below which a slip has vanished: what is left of it is as
#: small as errors of the most accurate motions.
_LEAST_SLIP = Fraction(1, 10**9)


def vanishing_slips(equations: Equations) -> list[tuple[str, Expr]]:
    """List the norms of velocities by which forces are divided, each with what is positive as long
    as it has not vanished.

    Dry friction against a slip of two directions, μ N v/|v|, has no direction where v = 0, and
    holds a body there that no law of the scene describes.
    """
    initial = equations.system.initial
    speeds = [] if initial is None else [abs(v) for v in initial.velocities]
    least = _LEAST_SLIP * Fraction(max(speeds, default=0.0))
    if not least:
        return []
    velocities = {c.v for c in equations.system.coordinates}
    slips: dict[tuple[str, Expr], None] = {}
    for part in distinct_parts(equations.system.forcing):
        if _is_divided_by_norm(part, velocities):
            name = to_scene_language(sp.sqrt(part.base), equations)
            slips[name, part.base / sp.Rational(least.numerator, least.denominator) ** 2 - 1] = None
    return list(slips)


def _is_divided_by_norm(part: Expr, velocities: Set[Symbol]) -> bool:
    """Tell whether a part of a force is a negative power of a sum of squares with velocities."""
    if not (part.is_Pow and part.exp.is_Rational and part.exp < 0 and part.exp.q == 2):
        return False
    base = part.base
    moving = [term for term in base.args if not velocities.isdisjoint(term.free_symbols)]
    return base.is_Add and len(moving) > 1 and all(term.is_nonnegative for term in base.args)


def _evaluated(equations: Equations) -> Iterator[Expr]:
    system = equations.system
    yield from forces_and_inertias(equations)
    yield from (expression for _, expression in system.outputs)
    for closure in (*system.closures, *(c.closure for c in system.contacts)):
        yield from chain([closure.expression, closure.bias], entries(closure.gradient).values())


def _unwatched(table: str, source: str) -> InputError:
    return InputError(
        Problem(
            f"the argument of the table '{table}' holds the input '{source.partition('|')[0]}',"
            " whose values are known in the run alone: its end cannot be watched",
            hint="outside: hold, or outside: extend",
            rule="table",
        )
    )
