"""Starts of the states of first order, beside the initial state of the coordinates."""

from __future__ import annotations

from dataclasses import replace

import mpmath

from lagrange_cli.errors import InputError, MissingStartError, Problem
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import initial_snippet
from lagrange_cli.mechanics.symbols.values import (
    DECIMAL_DIGITS,
    decimal,
    evaluated,
    nearest_double,
)
from lagrange_cli.mechanics.system import InitialState


def with_states(reduced: Reduced, initial: InitialState | None) -> InitialState | None:
    """Add the given starts of the states to an initial state; None if there is none.

    Raises
    ------
    InputError
        A state has no start.
    """
    scene = reduced.scene
    if initial is None or not scene.states:
        return initial
    starts = {entry.name: entry for entry in scene.state_starts}
    missing = [state for state in scene.states if state.name not in starts]
    if missing:
        values = {state.name: "0" for state in missing}
        listed = ", ".join(f"'{state.name}'" for state in missing)
        raise MissingStartError(
            Problem(
                f"the initial values do not say where the state {listed} begins"
                if len(missing) == 1
                else f"the initial values do not say where the states {listed} begin",
                (scene.initial or scene.state_starts)[0].mark,
                hint=f"give it too:\n{initial_snippet(scene, values, (0, 1))}",
                rule="initial-missing",
            )
        )
    exact = [reduced.values.number(starts[state.name].value) for state in scene.states]
    for state, value in zip(scene.states, exact, strict=True):
        if state.switch is not None and value not in (0, 1):
            raise InputError(
                Problem(
                    f"the state '{state.name}' has the values 0 and 1, and begins with neither",
                    starts[state.name].mark,
                    hint="1 is on, 0 is off; where a condition holds at the start, it changes",
                    rule="misplaced-state",
                )
            )
    known = [value for value in exact if value is not None]
    assert len(known) == len(exact)  # every parameter has a value
    decimals = initial.decimals
    if decimals:
        with mpmath.workdps(2 * DECIMAL_DIGITS):
            numbers = (decimal(evaluated(value, 2 * DECIMAL_DIGITS)) for value in known)
            decimals = (*decimals, *numbers)
    return replace(initial, states=tuple(map(nearest_double, known)), decimals=decimals)
