"""T, V, L and the dissipation function, and generalized forces."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.notation.labels import has_kinetic_energy
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.sentences import is_generalized_potential, without_line
from lagrange_cli.report.inlines import Inline, Label, Less, Listed, Plain, Written, below, say
from lagrange_cli.report.tree import Formula, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.system import BodyForce


def energies(writer: DocumentWriter) -> Section | None:
    """T, V, L, and the dissipation function where there is one."""
    equations, labels = writer.equations, writer.labels
    dissipates, generalized = equations.system.dissipation != 0, is_generalized_potential(equations)
    phrase = {
        (False, False): say("The kinetic energy, the potential and the Lagrangian are"),
        (True, False): say("The kinetic energy, the generalized potential and the Lagrangian are"),
        (False, True): say(
            "The kinetic energy, the potential, the Lagrangian and the dissipation function are"
        ),
        (True, True): say(
            "The kinetic energy, the generalized potential, the Lagrangian and the dissipation"
            " function are"
        ),
    }[generalized, dissipates]
    potential = labels["U" if generalized else "V"]
    kinetic, whole, dissipation = writer.energy_forms
    euler = writer.euler
    if euler is not None:
        kinetic_row = writer.row(labels["T"], euler.kinetic)
    else:
        kinetic_row = writer.energy(labels["T"], equations.system.kinetic, kinetic)
    rows = [
        kinetic_row,
        writer.energy(potential, equations.system.potential, whole),
        _lagrangian(writer, labels["T"] + " - " + potential),
    ]
    if dissipates:
        rows.append(writer.energy(labels["D"], equations.system.dissipation, dissipation))
    without = without_line(equations)
    below_rows = None
    if without is not None:
        phrase_below = "Here {lagrangian} is {without}."
        below_rows = say(phrase_below, lagrangian=Inline(labels["L"]), without=without)
    return section(
        say("Lagrangian"),
        Paragraph(phrase, only="document") if has_kinetic_energy(equations) else None,
        formulas(rows, result=True),
        None if below_rows is None else Paragraph(below_rows, only="document"),
        terse=None,
    )


def _lagrangian(writer: DocumentWriter, difference: Label) -> Formula:
    """L = T − V, written out where T and V are and it is short, less what is left out of it."""
    label, short = writer.labels["L"], writer.equations.derivation.short_lagrangian
    is_sum = any(writer.energy_forms) or writer.euler is not None
    whole = writer.equations.system.lagrangian if short is None else short.expression
    row = Formula(label, ()) if is_sum else writer.sum_row(label, whole)
    if short is None:
        # A terminal has T and V above it.
        return replace(row, middle=difference, only="document")
    row = replace(row, aside=Listed(("(", without_line(writer.equations) or "", ")"), between=""))
    if row.chain:
        return row
    return replace(row, middle=difference + Less(writer.tree(-short.left_out)))


def generalized_forces(writer: DocumentWriter) -> Section | None:
    """Return generalized forces of the scene's forces, one after the other.

    Those on a quaternion are in Euler's equations.
    """
    equations = writer.equations
    left_out = () if writer.euler is None else writer.euler.numbers
    rows = [
        replace(writer.row(below("Q", writer.coordinate(c)), q), aside=_source(force))
        for force in equations.system.forces
        for k, (c, q) in enumerate(
            zip(equations.system.coordinates, force.generalized, strict=True)
        )
        if q != 0 and k not in left_out
    ]
    if not rows:
        return None
    listed = Listed(tuple(map(_source, equations.system.forces)))
    return section(
        say("Generalized forces"),
        Paragraph(
            say("Of the non-conservative forces ({listed}), in this order:", listed=listed),
            only="document",
        ),
        formulas(rows, result=True),
    )


def _source(force: BodyForce) -> Written:
    name, place = Plain(force.name), Plain(force.on)
    if force.is_torque:
        return say("torque {name} on {place}", name=name, place=place)
    return say("{name} on {place}", name=name, place=place)
