"""The sections of a board in the order of a lecture."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.emit.steps import by_dalembert, by_lagrange, energies, particles
from lagrange_cli.emit.steps.conservation import conservation
from lagrange_cli.emit.steps.letters import Letters
from lagrange_cli.emit.steps.sections import Section
from lagrange_cli.emit.steps.writer import StepsWriter

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import DerivationSteps

_TO_LAGRANGE = (
    particles.positions,
    particles.velocities,
    energies.kinetic_energy,
    energies.potential_energy,
    energies.lagrangian,
    energies.generalized_forces,
    energies.dissipation,
    by_lagrange.constraints,
    by_lagrange.lagrange_equations,
)

_TO_DALEMBERT = (
    particles.positions,
    particles.velocities,
    particles.accelerations,
    particles.displacements,
    by_dalembert.applied_forces,
    by_lagrange.constraints,
    by_dalembert.principle,
    by_dalembert.comparison,
)


def working(equations: Equations, steps: DerivationSteps, letters: Letters) -> list[Section]:
    """The sections from positions to the equations of motion, and Newton's beside them."""
    writer = StepsWriter(equations, steps, letters)
    order = _TO_LAGRANGE if steps.way == "lagrange" else _TO_DALEMBERT
    sections = [write(writer) for write in (*order, by_dalembert.newton_equations)]
    return [s for s in sections if s is not None]


def conclusions(equations: Equations, steps: DerivationSteps, letters: Letters) -> list[Section]:
    """The sections after the equations of motion."""
    section = conservation(StepsWriter(equations, steps, letters))
    return [] if section is None else [section]


def certified_line(steps: DerivationSteps, digits: int) -> str:
    """``Every line ... was compared ...``"""
    noun = "state" if steps.states == 1 else "states"
    mismatch = f"{steps.mismatch:.0e}" if steps.mismatch else "0"
    return (
        f"Every line of the steps compared at {steps.states} of these {noun} to {digits} digits,"
        f" largest mismatch {mismatch}"
    )
