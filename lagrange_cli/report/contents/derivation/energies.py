"""T, V, L and the dissipation function, and generalized forces."""

from __future__ import annotations

from dataclasses import replace

from lagrange_cli.notation.labels import has_kinetic_energy
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.sentences import is_generalized_potential, without_line
from lagrange_cli.report.tree import Formula, Paragraph, Section, formulas, section


def energies(writer: DocumentWriter) -> Section | None:
    """T, V, L, and the dissipation function where there is one."""
    equations, labels, say = writer.equations, writer.lettered_labels, writer.say
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
    if not has_kinetic_energy(equations):
        phrase = ""
    potential = labels["U" if generalized else "V"]
    kinetic, whole, dissipation = writer.energy_forms
    rows = [
        writer.energy(labels["T"], equations.system.kinetic, kinetic),
        writer.energy(potential, equations.system.potential, whole),
        _lagrangian(writer, f"{labels['T']} - {potential}"),
    ]
    if dissipates:
        rows.append(writer.energy(labels["D"], equations.system.dissipation, dissipation))
    without = without_line(equations, writer.letters.inline("t"), say)
    if without:
        lagrangian = writer.letters.inline(labels["L"])
        without = say("Here {lagrangian} is {without}.", lagrangian=lagrangian, without=without)
    rows_below = formulas(rows, result=True)
    return section(
        say("Lagrangian"), writer.paragraph(phrase), rows_below, writer.paragraph(without)
    )


def _lagrangian(writer: DocumentWriter, difference: str) -> Formula:
    """L = T − V, written out where T and V are and it is short, less what is left out of it."""
    label, short = writer.lettered_labels["L"], writer.equations.derivation.short_lagrangian
    is_sum = any(writer.energy_forms)
    whole = writer.equations.system.lagrangian if short is None else short.expression
    row = Formula(label, ()) if is_sum else writer.sum_row(label, whole)
    if short is None:
        return replace(row, middle=difference)
    if row.chain:
        return row
    less = writer.letters.formula(writer.tree(-short.left_out))
    less = f"- {less[1:]}" if less.startswith("-") else f"+ {less}"
    return replace(row, middle=f"{difference} {less}")


def generalized_forces(writer: DocumentWriter) -> Section | None:
    """Return generalized forces of the scene's forces, one after the other."""
    equations, letters, say = writer.equations, writer.letters, writer.say
    rows = [
        writer.row(letters.below("Q", writer.lettered_coordinate(c)), q)
        for force in equations.system.forces
        for c, q in zip(equations.system.coordinates, force.generalized, strict=True)
        if q != 0
    ]
    if not rows:
        return None
    listed = ", ".join(
        say("{name} on {place}", name=letters.words(f.name), place=letters.words(f.on))
        for f in equations.system.forces
    )
    return section(
        say("Generalized forces"),
        Paragraph(say("Of the non-conservative forces ({listed}), in this order:", listed=listed)),
        formulas(rows, result=True),
    )
