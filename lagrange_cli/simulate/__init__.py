"""Equations → Trajectory: integration with a promised and measured accuracy.

Equations and a request go in; a :class:`~.results.trajectory.Trajectory` comes out, whose error
was measured, or a reason why it ends early. Read :mod:`.simulation` first: it calls the rooms in
order.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.simulate.integrators import INTEGRATORS
    from lagrange_cli.simulate.results.trajectory import Event, Trajectory
    from lagrange_cli.simulate.simulation import simulate

__all__ = ["INTEGRATORS", "Event", "Trajectory", "simulate"]

_HOMES = {
    "INTEGRATORS": "integrators",
    "Event": "results.trajectory",
    "Trajectory": "results.trajectory",
    "simulate": "simulation",
}


def __getattr__(name: str) -> Any:
    """Import what simulates when it is used: the compiler can be at work before."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
