"""The initial state over the parameters of the scene, where it writes it so."""

from __future__ import annotations

import sympy as sp

from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.values import nearest_double
from lagrange_cli.mechanics.system import InitialState


def written_start(
    reduced: Reduced, initial: InitialState | None
) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
    """Symbols q and q̇ with their starts over the parameters.

    Velocities that the scene leaves out are zero. Empty unless a start holds a parameter, if
    closures or gaps may change the start, or if the scene gives it in other names.
    """
    if reduced.closures or (initial is None and reduced.scene.unilateral):
        return ()
    places = {c.q: (c.q, c.v) for c in reduced.coordinates}
    start = {c.v: sp.Integer(0) for c in reduced.coordinates}
    for entry in reduced.scene.initial:
        symbol = reduced.names.lookup(entry.name)
        if symbol not in places:
            return ()
        start[places[symbol][entry.order]] = reduced.names.convert(entry.value)
    if not any(symbols_in(value) for value in start.values()):
        return ()
    if initial is not None and not _is_start(reduced, initial, start):
        return ()
    return tuple(start.items())


def _is_start(reduced: Reduced, initial: InitialState, start: dict[sp.Symbol, sp.Expr]) -> bool:
    """Compare written values with the state that is simulated, as doubles."""
    numbers = {reduced.names.parameters[n]: x for n, x in reduced.values.exact.items()}
    doubles = [*initial.positions, *initial.velocities]
    symbols = [*(c.q for c in reduced.coordinates), *(c.v for c in reduced.coordinates)]
    return all(
        nearest_double(start[s].xreplace(numbers)) == x
        for s, x in zip(symbols, doubles, strict=True)
        if s in start
    )
