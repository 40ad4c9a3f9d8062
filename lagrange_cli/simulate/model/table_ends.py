"""Ends of tables, beyond which the equations do not hold."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.sparse import entries
from lagrange_cli.mechanics.tabulated import Tabulated, borders
from lagrange_cli.simulate.model.expressions import distinct_parts, forces_and_inertias

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sympy import Expr

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
