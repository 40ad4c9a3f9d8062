"""The sections of a board in the order of a lecture."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial as bound
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.report.contents.sentences import (
    energy_is_sum,
    is_generalized_potential,
    only_between_impacts,
)
from lagrange_cli.report.contents.steps import (
    by_dalembert,
    by_lagrange,
    by_virtual_work,
    energies,
    particles,
    turnings,
)
from lagrange_cli.report.contents.steps.writer import (
    SPEED,
    StepsWriter,
    angular_momentum_sentence,
    start_sentence,
)
from lagrange_cli.report.inlines import (
    Label,
    Listed,
    Written,
    below,
    enumerated,
    partial,
    rate,
    say,
    symbol,
    times,
    total,
)
from lagrange_cli.report.tree import Formula, Part, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.findings import Conserved
    from lagrange_cli.mechanics.step_values import DerivationSteps


def conservation(writer: StepsWriter) -> Section | None:
    """Return the section on cyclic coordinates, ∂L/∂q = 0, and on the energy, ∂L/∂t = 0."""
    if not writer.equations.system.coordinates:
        return None

    def letter(quantity: Conserved) -> Label:
        if quantity.kind == "momentum":
            return below("p", writer.cartesian(quantity.coordinate or ""))
        return writer.labels["E" if quantity.kind == "energy" else "h"]

    heading, start = say("Cyclic coordinates, momenta and energy"), start_sentence(writer, letter)
    return section(heading, *_momenta(writer), *_energy(writer), start)


def _momenta(writer: StepsWriter) -> Iterator[Part]:
    equations, whole = writer.equations, writer.labels["L"]
    conserved = {c.coordinate: c for c in equations.derivation.conserved if c.kind == "momentum"}
    absent = [
        c
        for c, steps in zip(equations.system.coordinates, writer.steps.coordinates, strict=True)
        if steps.slope == 0 or c.name in equations.derivation.cyclic
    ]
    driven = [writer.coordinate(c) for c in absent if c.name not in conserved]
    if not absent and not equations.derivation.open_questions:
        yield say("{lagrangian} depends on every coordinate.", lagrangian=whole)
    if driven:
        yield say.counted(
            len(driven),
            "{listed} does not stand in {lagrangian}, but forces or constraints change its"
            " momentum.",
            "{listed} do not stand in {lagrangian}, but forces or constraints change their"
            " momenta.",
            listed=enumerated(driven),
            lagrangian=whole,
        )
    for c in absent:
        if c.name not in conserved:
            continue
        place, label = writer.coordinate(c), below("p", writer.coordinate(c))
        slope = partial(writer.labels["L"], place) + " = 0"
        sentence = "{name} is cyclic, {slope}, and its momentum is conserved,"
        yield say(sentence, name=place, slope=slope)
        momentum = partial(writer.labels["L"], writer.coordinate(c, 1))
        row = writer.row(label, conserved[c.name].expression)
        yield formulas([replace(row, middle=momentum)], result=True)
        axis = angular_momentum_sentence(writer, conserved[c.name], label)
        if axis is not None:
            yield axis


def _energy(writer: StepsWriter) -> Iterator[Part]:
    equations, labels = writer.equations, writer.labels
    both = labels["T"] + " + " + labels["V"]
    conserved_energy = next(
        (c for c in equations.derivation.conserved if c.kind != "momentum"), None
    )
    function = total("j", times(SPEED, partial(labels["L"], SPEED))) + " - " + labels["L"]
    row = writer.row(function, equations.system.energy)
    reported = conserved_energy or equations.derivation.balance
    if reported is not None:
        label = labels["E" if reported.kind == "energy" else "h"]
        row = Formula(label, row.chain, middle=function)
    yield say("The energy function is")
    yield formulas([row], result=True)
    if conserved_energy is None:
        if equations.derivation.balance is not None:
            yield say("It changes at the rate")
            yield formulas([writer.row(rate(label), equations.derivation.balance.rate)])
        return
    slope = partial(labels["L"], symbol("t")) + " = 0"
    clauses = [say("It is conserved, since {slope}", slope=slope)]
    if equations.system.forces or equations.system.dissipation != 0:
        clauses.append(say(" and the forces do no work"))
    elif only_between_impacts(equations):
        clauses.append(say(", between impacts"))
    if energy_is_sum(equations, conserved_energy):
        clauses.append(say("; it is {energy}", energy=both))
    elif conserved_energy.kind == "jacobi" and not is_generalized_potential(equations):
        clauses.append(say("; it is not {energy}", energy=both))
    yield say("{text}.", text=Listed(tuple(clauses), ""))


#: The part of a document that a section belongs to, and what writes it.
_TO_LAGRANGE = (
    ("energies equations", particles.positions),
    ("energies", particles.velocities),
    ("energies", turnings.rotations),
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
    ("equations", turnings.rotations),
    ("equations", particles.accelerations),
    ("equations", turnings.angular_momenta),
    ("equations", particles.displacements),
    ("equations", by_dalembert.applied_forces),
    ("equations constraints", by_lagrange.constraints),
    ("equations", by_dalembert.principle),
    ("energies", by_dalembert.comparison),
    ("forces", by_dalembert.newton_equations),
)

_TO_EQUILIBRIUM = (
    ("energies equations", particles.positions),
    ("equations", turnings.rotations),
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
    return ((parts, bound(write, writer)) for parts, write in _ORDERS[writer.steps.way])


def conclusions(writer: StepsWriter) -> Sections:
    """Return the sections after the equations of motion, none after those of equilibrium."""
    if writer.steps.of_motion:
        yield "conserved", bound(conservation, writer)


def certified_line(steps: DerivationSteps, digits: int) -> Written:
    """``Every line ... was compared ...``"""
    return say(
        "Every line of the steps compared at {count} of these states to {digits} digits, largest"
        " mismatch {mismatch}",
        count=steps.states,
        digits=digits,
        mismatch=f"{steps.mismatch:.0e}" if steps.mismatch else "0",
    )
