"""Solvers of SciPy as integrators: where they stand, and their state as plain values."""

from __future__ import annotations

from typing import Any

import numpy as np

from lagrange_cli.simulate.integrators.base import Integrator, SavedState

#: Types of values, as against functions and other objects.
_PLAIN = (bool, int, float, str, np.generic, np.ndarray, type(None))


class ScipyIntegrator(Integrator):
    """A solver of SciPy over the difference to an origin, stepped one step at a time."""

    _solver: Any

    def state(self) -> SavedState:
        return {**super().state(), "solver": _solver_state(self._solver)}

    def restore(self, state: SavedState) -> None:
        super().restore(state)
        _restore_solver(self._solver, state["solver"])


def _solver_state(solver: Any) -> SavedState:
    """Copies of all attributes of a solver that are values, or pairs of them."""
    return {name: _copied(value) for name, value in vars(solver).items() if _plain(value)}


def _restore_solver(solver: Any, state: SavedState) -> None:
    """Give a fresh solver of the same problem these attributes."""
    for name, value in state.items():
        setattr(solver, name, _copied(value))
    if hasattr(solver, "K_extended"):
        # The slopes of a step are a part of those of its interpolant.
        solver.K = solver.K_extended[: solver.n_stages + 1]
    if getattr(solver, "Z", None) is not None:
        # Radau's next step begins with the interpolant of the last one.
        solver.sol = solver._compute_dense_output()


def _plain(value: Any) -> bool:
    return isinstance(value, _PLAIN) or (isinstance(value, tuple) and all(map(_plain, value)))


def _copied(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(map(_copied, value))
    return value.copy(order="K") if isinstance(value, np.ndarray) else value
