"""Momenta of cyclic coordinates and the energy function."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import sympy

from lagrange_cli.emit.constraint_wording import energy_is_sum
from lagrange_cli.emit.steps.sections import Block, Formula, Section, Words, formulas, section
from lagrange_cli.emit.steps.writer import StepsWriter


def conservation(writer: StepsWriter) -> Section | None:
    """What ∂L/∂q = 0 and ∂L/∂t = 0 say."""
    if not writer.equations.coordinates:
        return None
    return section("Cyclic coordinates, momenta and energy", *_momenta(writer), *_energy(writer))


def _momenta(writer: StepsWriter) -> Iterator[Block]:
    equations, letters = writer.equations, writer.letters
    conserved = {c.coordinate: c for c in equations.conserved if c.kind == "momentum"}
    absent = [
        c
        for c, steps in zip(equations.coordinates, writer.steps.coordinates, strict=True)
        if steps.slope == 0 or c.name in equations.cyclic
    ]
    driven = [writer.coordinate(c) for c in absent if c.name not in conserved]
    if not absent and not equations.open_questions:
        yield Words(f"{letters.inline(writer.labels['L'])} depends on every coordinate.")
    if driven:
        verb = "does" if len(driven) == 1 else "do"
        what = "its momentum" if len(driven) == 1 else "their momenta"
        yield Words(
            f"{writer.listed(driven)} {verb} not stand in {letters.inline(writer.labels['L'])},"
            f" but forces or constraints change {what}."
        )
    for c in absent:
        if c.name not in conserved:
            continue
        slope = letters.inline(f"{letters.partial(writer.labels['L'], writer.coordinate(c))} = 0")
        name = letters.inline(writer.coordinate(c))
        yield Words(f"{name} is cyclic, {slope}, and its momentum is conserved,")
        momentum = letters.partial(writer.labels["L"], writer.coordinate(c, 1))
        label = letters.below("p", writer.coordinate(c))
        row = writer.row(label, conserved[c.name].expression)
        yield formulas([replace(row, middle=momentum)], result=True)


def _energy(writer: StepsWriter) -> Iterator[Block]:
    equations, letters, labels = writer.equations, writer.letters, writer.labels
    held = next((c for c in equations.conserved if c.kind != "momentum"), None)
    momentum = letters.partial(labels["L"], letters.symbol("q_j", 1))
    function = letters.total("j", letters.times(letters.symbol("q_j", 1), momentum))
    row = writer.row(f"{function} - {labels['L']}", equations.energy)
    reported = held or equations.balance
    if reported is not None:
        label = labels["E" if reported.kind == "energy" else "h"]
        row = Formula(label, row.chain, middle=row.label)
    yield Words("The energy function is")
    yield formulas([row], result=True)
    if held is None:
        if equations.balance is not None:
            yield Words("It changes at the rate")
            yield formulas([writer.row(letters.rate(label), equations.balance.rate)])
        return
    slope = letters.inline(f"{letters.partial(labels['L'], letters.symbol('t'))} = 0")
    told = f"It is conserved, since {slope}"
    if equations.forces or equations.dissipation != 0:
        told += " and the forces do no work"
    elif "between impacts" in held.reason:
        told += ", between impacts"
    if energy_is_sum(equations, held):
        told += f"; it is {letters.inline(labels['T'] + ' + ' + labels['V'])}"
    elif held.kind == "jacobi" and not equations.potential.free_symbols & _velocities(writer):
        told += f"; it is not {letters.inline(labels['T'] + ' + ' + labels['V'])}"
    yield Words(f"{told}.")


def _velocities(writer: StepsWriter) -> set[sympy.Symbol]:
    return {c.v for c in writer.equations.coordinates}
