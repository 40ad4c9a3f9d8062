"""Momenta, Hamilton's function and the canonical equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

from lagrange_cli.analysis.forms.hamiltonian import Hamiltonian, hamiltonian_form
from lagrange_cli.report.contents.forms.brackets import bracket_sections
from lagrange_cli.report.contents.forms.writer import FormWriter, certified
from lagrange_cli.report.contents.sentences import is_generalized_potential
from lagrange_cli.report.contents.steps.writer import sum_of
from lagrange_cli.report.tree import Law, Paragraph, Section, formulas

if TYPE_CHECKING:
    from collections.abc import Iterator


def hamiltonian_sections(writer: FormWriter) -> list[Section]:
    """Return the sections in place of Lagrange's equations."""
    equations, say = writer.equations, writer.say
    form = hamiltonian_form(equations)
    writer = writer.knowing([pair.momentum for pair in form.pairs])
    heading = say("Hamilton's equations")
    if not form.pairs:
        return [Section(heading, (Paragraph(say("There are none.")),))]
    momenta = [writer.row(writer.momentum(p.momentum), p.momentum.expression) for p in form.pairs]
    velocities = [
        writer.row(writer.lettered_coordinate(p.momentum.coordinate, 1), p.velocity)
        for p in form.pairs
        if p.velocity is not None
    ]
    rates = [writer.total(writer.momentum(p.momentum, 1), p.rate) for p in form.pairs]
    paragraph = writer.paragraph(_open(writer, form), *_remarks(writer, form))
    return [
        Section(
            say("Momenta"), (Law(_momentum(writer), ends=False), formulas(momenta, result=True))
        ),
        Section(
            say("Hamiltonian"),
            (
                formulas([writer.total(writer.lettered_labels["H"], form.parts)], result=True),
                *([paragraph] if paragraph else []),
            ),
        ),
        Section(
            heading,
            (
                *_law(writer),
                formulas([*velocities, *rates], result=True),
                Paragraph(certified(form.certificate, say)),
            ),
        ),
        *bracket_sections(writer),
    ]


def _open(writer: FormWriter, form: Hamiltonian) -> str:
    """Say which velocities stay in H, and what they are; empty if there are none."""
    if not form.coupled:
        return ""
    coordinates = writer.equations.system.coordinates
    listed = writer.lettered_list(
        [writer.lettered_coordinate(coordinates[j], 1) for j in form.coupled]
    )
    return writer.say(
        "The momenta are linear in {velocities}, which they determine as a linear system: its"
        " solution has no short form, and half of {product} stands for the kinetic energy.",
        velocities=listed,
        product=writer.letters.inline(writer.letters.formula(writer.tree(_product(form)))),
    )


def _product(form: Hamiltonian) -> sympy.Expr:
    """Σ p q̇ of the coordinates that are not solved for."""
    pairs = [form.pairs[j].momentum for j in form.coupled]
    return sympy.Add(*(m.symbol * m.coordinate.v for m in pairs))


def _remarks(writer: FormWriter, form: Hamiltonian) -> Iterator[str]:
    """Say whether H is T + V, and whether it is conserved."""
    say, equations = writer.say, writer.equations
    letters = {key: writer.letters.inline(label) for key, label in writer.lettered_labels.items()}
    is_at_rest = is_generalized_potential(equations)
    potential = writer.lettered_labels["U" if is_at_rest else "V"]
    total = writer.letters.inline(f"{writer.lettered_labels['T']} + {potential}")
    if form.is_sum and is_at_rest:
        yield say("{H} is {T} plus what {U} has without velocities.", **letters)
    elif form.is_sum:
        yield say("{H} is {total}.", **letters, total=total)
    elif form.conserved is not None and form.conserved.is_energy:
        yield say("{H} is the energy {E}.", **letters)
    elif form.is_sum is False:
        yield say("{H} is not {total}.", **letters, total=total)
    if form.conserved is not None:
        time = writer.letters.inline(writer.letters.symbol("t"))
        reason = "{H} is conserved: {L} does not depend on {t}."
        if any(contact.restitution != 1 for contact in equations.system.contacts):
            reason = "{H} is conserved between impacts: {L} does not depend on {t}."
        yield say(reason, **letters, t=time)
    elif "energy" in equations.derivation.open_questions:
        yield say("It is not decided whether {H} is conserved.", **letters)
    else:
        yield say("{H} is not conserved.", **letters)


def _momentum(writer: FormWriter) -> str:
    """p = ∂L/∂q̇."""
    slope = writer.letters.partial(writer.lettered_labels["L"], writer.letters.symbol("q_j", 1))
    return f"{writer.letters.symbol('p_j')} = {slope}"


def _law(writer: FormWriter) -> Iterator[Law]:
    """q̇ = ∂H/∂p and ṗ = −∂H/∂q − ∂D/∂q̇ + Q + Σ λ ∂φ/∂q, as far as there are such parts."""
    letters, labels, equations = writer.letters, writer.lettered_labels, writer.equations
    place, speed = letters.symbol("q_j"), letters.symbol("q_j", 1)
    momentum, rate = letters.symbol("p_j"), letters.symbol("p_j", 1)
    first = f"{speed} = {letters.partial(labels['H'], momentum)}"
    friction = ""
    if equations.system.dissipation != 0:
        friction = f" - {letters.partial(labels['D'], speed)}"
    left = f"-{letters.partial(labels['H'], place)}{friction}"
    pushes = [
        letters.total("k", letters.times(letters.symbol("lambda_k"), slope))
        for kind, slope in (
            ("position", letters.partial(letters.symbol("varphi_k"), place)),
            ("velocity", letters.partial(letters.symbol("psi_k"), speed)),
        )
        if kind in {closure.kind for closure in equations.system.pushing}
    ]
    force = letters.symbol("Q_j") if equations.system.forces else ""
    yield Law(f"{first}{letters.comma}{rate} = {sum_of([left, force, *pushes])}", ends=False)
