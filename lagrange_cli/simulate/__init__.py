"""Equations → Trajectory: integration with a promised and measured accuracy.

Equations and a request go in; a :class:`~.results.trajectory.Trajectory` comes out, whose error
was measured, or a reason why it ends early. Read :mod:`.simulation` first: it calls the rooms in
order.
"""

from __future__ import annotations

from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.results.trajectory import Event, Trajectory
from lagrange_cli.simulate.simulation import simulate

__all__ = ["INTEGRATORS", "Event", "Trajectory", "simulate"]
