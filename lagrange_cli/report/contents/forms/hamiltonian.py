"""Momenta, Hamilton's function and the canonical equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy

from lagrange_cli.analysis.forms.hamiltonian import Hamiltonian, hamiltonian_form
from lagrange_cli.report.contents.forms.brackets import bracket_sections
from lagrange_cli.report.contents.forms.writer import FormWriter, certified
from lagrange_cli.report.contents.sentences import is_generalized_potential
from lagrange_cli.report.inlines import (
    COMMA,
    Inline,
    Label,
    Listed,
    Sentence,
    enumerated,
    joined,
    partial,
    say,
    symbol,
    times,
    total,
)
from lagrange_cli.report.tree import Law, Paragraph, Section, formulas

if TYPE_CHECKING:
    from collections.abc import Iterator


def hamiltonian_sections(writer: FormWriter) -> list[Section]:
    """Return the sections in place of Lagrange's equations."""
    form = hamiltonian_form(writer.equations)
    writer = writer.knowing([pair.momentum for pair in form.pairs])
    heading = say("Hamilton's equations")
    if not form.pairs:
        return [Section(heading, (Paragraph(say("There are none.")),))]
    momenta = [writer.row(writer.momentum(p.momentum), p.momentum.expression) for p in form.pairs]
    velocities = [
        writer.row(writer.coordinate(p.momentum.coordinate, 1), p.velocity)
        for p in form.pairs
        if p.velocity is not None
    ]
    rates = [writer.total(writer.momentum(p.momentum, 1), p.rate) for p in form.pairs]
    remarks = Listed((*_open(writer, form), *_remarks(writer, form)), " ")
    return [
        Section(
            say("Momenta"),
            (Law(_momentum(writer), ends=False, only="document"), formulas(momenta, result=True)),
        ),
        Section(
            say("Hamiltonian"),
            (
                formulas([writer.total(writer.labels["H"], form.parts)], result=True),
                Paragraph(remarks),
            ),
        ),
        Section(
            heading,
            (
                *_law(writer),
                formulas([*velocities, *rates], result=True),
                Paragraph(certified(form.certificate)),
            ),
        ),
        *bracket_sections(writer),
    ]


def _open(writer: FormWriter, form: Hamiltonian) -> Iterator[Sentence]:
    """Say which velocities stay in H, and what they are."""
    if not form.coupled:
        return
    coordinates = writer.equations.system.coordinates
    yield say(
        "The momenta are linear in {velocities}, which they determine as a linear system: its"
        " solution has no short form, and half of {product} stands for the kinetic energy.",
        velocities=enumerated([writer.coordinate(coordinates[j], 1) for j in form.coupled]),
        product=writer.inline(_product(form)),
    )


def _product(form: Hamiltonian) -> sympy.Expr:
    """Σ p q̇ of the coordinates that are not solved for."""
    pairs = [form.pairs[j].momentum for j in form.coupled]
    return sympy.Add(*(m.symbol * m.coordinate.v for m in pairs))


def _remarks(writer: FormWriter, form: Hamiltonian) -> Iterator[Sentence]:
    """Say whether H is T + V, and whether it is conserved."""
    equations = writer.equations
    inline = {key: Inline(label) for key, label in writer.labels.items()}
    is_at_rest = is_generalized_potential(equations)
    energy = Inline(writer.labels["T"] + " + " + writer.labels["U" if is_at_rest else "V"])
    if form.is_sum and is_at_rest:
        yield say("{H} is {T} plus what {U} has without velocities.", **inline)
    elif form.is_sum:
        yield say("{H} is {total}.", **inline, total=energy)
    elif form.conserved is not None and form.conserved.is_energy:
        yield say("{H} is the energy {E}.", **inline)
    elif form.is_sum is False:
        yield say("{H} is not {total}.", **inline, total=energy)
    if form.conserved is not None:
        reason = "{H} is conserved: {L} does not depend on {t}."
        if any(contact.restitution != 1 for contact in equations.system.contacts):
            reason = "{H} is conserved between impacts: {L} does not depend on {t}."
        yield say(reason, **inline, t=Inline(symbol("t")))
    elif "energy" in equations.derivation.open_questions:
        yield say("It is not decided whether {H} is conserved.", **inline)
    else:
        yield say("{H} is not conserved.", **inline)


def _momentum(writer: FormWriter) -> Label:
    """p = ∂L/∂q̇."""
    return symbol("p_j") + " = " + partial(writer.labels["L"], symbol("q_j", 1))


def _law(writer: FormWriter) -> Iterator[Law]:
    """q̇ = ∂H/∂p and ṗ = −∂H/∂q − ∂D/∂q̇ + Q + Σ λ ∂φ/∂q, as far as there are such parts."""
    labels, system = writer.labels, writer.equations.system
    place, speed, momentum = symbol("q_j"), symbol("q_j", 1), symbol("p_j")
    first = speed + " = " + partial(labels["H"], momentum)
    left = "-" + partial(labels["H"], place)
    if system.dissipation != 0:
        left = left + " - " + partial(labels["D"], speed)
    pushes = [
        total("k", times(symbol("lambda_k"), slope))
        for kind, slope in (
            ("position", partial(symbol("varphi_k"), place)),
            ("velocity", partial(symbol("psi_k"), speed)),
        )
        if kind in {closure.kind for closure in system.pushing}
    ]
    forces = [symbol("Q_j")] if system.forces else []
    second = symbol("p_j", 1) + " = " + joined(" + ", [left, *forces, *pushes])
    yield Law(first + COMMA + second, ends=False, only="document")
