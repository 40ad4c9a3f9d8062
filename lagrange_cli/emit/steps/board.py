"""The sections of a board in the order of a lecture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.language import ENGLISH, Language
from lagrange_cli.emit.steps import by_dalembert, by_lagrange, energies, particles
from lagrange_cli.emit.steps.conservation import conservation
from lagrange_cli.emit.steps.sections import Section
from lagrange_cli.emit.steps.writer import StepsWriter

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import DerivationSteps

#: The part of a document that a section belongs to, and what writes it.
_TO_LAGRANGE = (
    ("energies equations", particles.positions),
    ("energies", particles.velocities),
    ("energies", energies.kinetic_energy),
    ("energies", energies.potential_energy),
    ("energies", energies.lagrangian),
    ("equations", energies.generalized_forces),
    ("energies", energies.dissipation),
    ("equations constraints", by_lagrange.constraints),
    ("equations", by_lagrange.lagrange_equations),
    ("forces", by_dalembert.newton_equations),
)

_TO_DALEMBERT = (
    ("energies equations", particles.positions),
    ("equations", particles.velocities),
    ("equations", particles.accelerations),
    ("equations", particles.displacements),
    ("equations", by_dalembert.applied_forces),
    ("equations constraints", by_lagrange.constraints),
    ("equations", by_dalembert.principle),
    ("energies", by_dalembert.comparison),
    ("forces", by_dalembert.newton_equations),
)

#: Parts of a document, each with what writes a section of it.
Sections: TypeAlias = Iterator[tuple[str, Callable[[], Section | None]]]


def working(writer: StepsWriter) -> Sections:
    """The sections from positions to the equations of motion, and Newton's beside them."""
    order = _TO_LAGRANGE if writer.steps.way == "lagrange" else _TO_DALEMBERT
    return ((parts, partial(write, writer)) for parts, write in order)


def conclusions(writer: StepsWriter) -> Sections:
    """The sections after the equations of motion."""
    yield "conserved", partial(conservation, writer)


def certified_line(steps: DerivationSteps, digits: int, say: Language = ENGLISH) -> str:
    """``Every line ... was compared ...``"""
    return say(
        "Every line of the steps compared at {count} of these states to {digits} digits, largest"
        " mismatch {mismatch}",
        count=steps.states,
        digits=digits,
        mismatch=f"{steps.mismatch:.0e}" if steps.mismatch else "0",
    )
