"""Equations → Trajectory: integration with a promised and measured accuracy."""

from __future__ import annotations

from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.trajectory import Event, Trajectory

__all__ = ["INTEGRATORS", "Event", "Trajectory", "simulate"]
