"""The sections of a board in the order of a lecture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

import sympy

from lagrange_cli.report.contents.sentences import energy_is_sum, only_between_impacts
from lagrange_cli.report.contents.steps import (
    by_dalembert,
    by_lagrange,
    by_virtual_work,
    energies,
    particles,
)
from lagrange_cli.report.contents.steps.writer import (
    StepsWriter,
    angular_momentum_sentence,
    start_sentence,
)
from lagrange_cli.report.phrases.language import ENGLISH, Language
from lagrange_cli.report.tree import Block, Formula, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import DerivationSteps


def conservation(writer: StepsWriter) -> Section | None:
    """Return the section on cyclic coordinates, ∂L/∂q = 0, and on the energy, ∂L/∂t = 0."""
    if not writer.equations.system.coordinates:
        return None
    heading = writer.say("Cyclic coordinates, momenta and energy")
    named = {c.name: writer.lettered_coordinate(c) for c in writer.equations.system.coordinates}

    def letter(quantity: Conserved) -> str:
        if quantity.kind == "momentum":
            return writer.letters.below("p", named[quantity.coordinate or ""])
        return writer.lettered_labels["E" if quantity.kind == "energy" else "h"]

    start = start_sentence(writer, letter)
    return section(heading, *_momenta(writer), *_energy(writer), start)


def _momenta(writer: StepsWriter) -> Iterator[Block]:
    equations, letters, say = writer.equations, writer.letters, writer.say
    whole = letters.inline(writer.lettered_labels["L"])
    conserved = {c.coordinate: c for c in equations.derivation.conserved if c.kind == "momentum"}
    absent = [
        c
        for c, steps in zip(equations.system.coordinates, writer.steps.coordinates, strict=True)
        if steps.slope == 0 or c.name in equations.derivation.cyclic
    ]
    driven = [writer.lettered_coordinate(c) for c in absent if c.name not in conserved]
    if not absent and not equations.derivation.open_questions:
        yield Paragraph(say("{lagrangian} depends on every coordinate.", lagrangian=whole))
    if driven:
        yield Paragraph(
            say.counted(
                len(driven),
                "{listed} does not stand in {lagrangian}, but forces or constraints change its"
                " momentum.",
                "{listed} do not stand in {lagrangian}, but forces or constraints change their"
                " momenta.",
                listed=writer.lettered_list(driven),
                lagrangian=whole,
            )
        )
    for c in absent:
        if c.name not in conserved:
            continue
        slope = letters.inline(
            f"{letters.partial(writer.lettered_labels['L'], writer.lettered_coordinate(c))} = 0"
        )
        name = letters.inline(writer.lettered_coordinate(c))
        yield Paragraph(
            say("{name} is cyclic, {slope}, and its momentum is conserved,", name=name, slope=slope)
        )
        momentum = letters.partial(writer.lettered_labels["L"], writer.lettered_coordinate(c, 1))
        label = letters.below("p", writer.lettered_coordinate(c))
        row = writer.row(label, conserved[c.name].expression)
        yield formulas([replace(row, middle=momentum)], result=True)
        sentence = angular_momentum_sentence(writer, conserved[c.name], label)
        if sentence is not None:
            yield sentence


def _energy(writer: StepsWriter) -> Iterator[Block]:
    equations, letters, labels = writer.equations, writer.letters, writer.lettered_labels
    say, both = writer.say, letters.inline(f"{labels['T']} + {labels['V']}")
    conserved_energy = next(
        (c for c in equations.derivation.conserved if c.kind != "momentum"), None
    )
    momentum = letters.partial(labels["L"], letters.symbol("q_j", 1))
    function = letters.total("j", letters.times(letters.symbol("q_j", 1), momentum))
    row = writer.row(f"{function} - {labels['L']}", equations.system.energy)
    reported = conserved_energy or equations.derivation.balance
    if reported is not None:
        label = labels["E" if reported.kind == "energy" else "h"]
        row = Formula(label, row.chain, middle=row.label)
    yield Paragraph(say("The energy function is"))
    yield formulas([row], result=True)
    if conserved_energy is None:
        if equations.derivation.balance is not None:
            yield Paragraph(say("It changes at the rate"))
            yield formulas([writer.row(letters.rate(label), equations.derivation.balance.rate)])
        return
    slope = letters.inline(f"{letters.partial(labels['L'], letters.symbol('t'))} = 0")
    sentence = say("It is conserved, since {slope}", slope=slope)
    if equations.system.forces or equations.system.dissipation != 0:
        sentence += say(" and the forces do no work")
    elif only_between_impacts(equations):
        sentence += say(", between impacts")
    if energy_is_sum(equations, conserved_energy):
        sentence += say("; it is {energy}", energy=both)
    elif (
        conserved_energy.kind == "jacobi"
        and not equations.system.potential.free_symbols & _velocities(writer)
    ):
        sentence += say("; it is not {energy}", energy=both)
    yield Paragraph(say("{text}.", text=sentence))


def _velocities(writer: StepsWriter) -> set[sympy.Symbol]:
    return {c.v for c in writer.equations.system.coordinates}


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

_TO_EQUILIBRIUM = (
    ("energies equations", particles.positions),
    ("equations", particles.displacements),
    ("equations", by_dalembert.applied_forces),
    ("equations constraints", by_lagrange.constraints),
    ("equations", by_virtual_work.principle),
    ("equations", by_virtual_work.equilibrium),
)

_ORDERS = {
    "lagrange": _TO_LAGRANGE,
    "dalembert": _TO_DALEMBERT,
    "virtual-work": _TO_EQUILIBRIUM,
}

#: Parts of a document, each with what writes a section of it.
Sections: TypeAlias = Iterator[tuple[str, Callable[[], Section | None]]]


def working(writer: StepsWriter) -> Sections:
    """Return the sections from positions to the equations of motion, and Newton's beside them."""
    return ((parts, partial(write, writer)) for parts, write in _ORDERS[writer.steps.way])


def conclusions(writer: StepsWriter) -> Sections:
    """Return the sections after the equations of motion, none after those of equilibrium."""
    if writer.steps.of_motion:
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
