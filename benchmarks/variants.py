"""Random systems near a given one: other parameters, another initial state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lagrange_cli.simulate.integrators.hybrid.contact_system import HybridRhs
from lagrange_cli.simulate.integrators.right_hand_side import structured
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import right_hand_side

__all__ = ["variant"]

#: By how much numbers change at most, as a part of them, and those of the state besides, as a
#: part of the largest position or velocity.
PART, BESIDES = 0.1, 0.03


#: Draws until a state is found that contacts allow.
DRAWS = 100


def variant(model: Model, seed: int) -> Model:
    """A model with other numbers, which a seed decides; its initial state obeys the constraints.

    Where contacts allow none of the states that are drawn, it is the model itself.
    """
    chance = np.random.default_rng(seed)
    drawn = (_drawn(model, chance) for _ in range(DRAWS))
    return next((other for other in drawn if _is_allowed(other)), model)


def _drawn(model: Model, chance: np.random.Generator) -> Model:
    parameters = tuple(
        replace(p, value=None if p.value is None else p.value * (1 + PART * chance.uniform(-1, 1)))
        for p in model.parameters
    )
    state = np.array(model.initial, dtype=float)
    n = len(state) // 2
    largest = np.repeat([np.abs(half).max(initial=0.0) for half in (state[:n], state[n:])], n)
    state = state * (1 + PART * chance.uniform(-1, 1, 2 * n))
    state += BESIDES * largest * chance.uniform(-1, 1, 2 * n)
    other = replace(model, parameters=parameters)
    project = structured(right_hand_side(other).rhs).project
    if project is not None:
        state = project(model.defaults.start, state)
    return replace(other, initial=tuple(state.tolist()))


def _is_allowed(model: Model) -> bool:
    """Whether no contact is violated at the start."""
    rhs = right_hand_side(model).rhs
    state = np.array(model.initial)
    if not isinstance(rhs, HybridRhs):
        return bool(np.isfinite(state).all())
    return bool((rhs.gaps(model.defaults.start, state).values >= 0).all())
