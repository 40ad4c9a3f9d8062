"""Euler's equations of one body, with the rates of what turns it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.step_values import spin_symbol
from lagrange_cli.notation.tree import DisplayNode, DisplayProduct, DisplaySum, factors_of
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.inlines import Plain, Written, say, symbol
from lagrange_cli.report.tree import Formula, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import EulerForm


def eulers_equations(
    writer: DocumentWriter, form: EulerForm, heading: Written, of_centre: Sequence[Formula]
) -> Section | None:
    """Return Euler's equations and the rates of what turns, then Lagrange's of the centre."""
    coordinates = writer.equations.system.coordinates
    spins = [symbol(writer.spin_name(form, axis)) for axis in "123"]
    laws = [
        Formula(
            "", (writer.tree(inertia), _in_cyclic_order(writer, gyroscopic + torque)), name=spin
        )
        for spin, inertia, gyroscopic, torque in zip(
            spins, form.inertia, form.gyroscopic, form.torques, strict=True
        )
    ]
    rates = [
        writer.row(writer.coordinate(coordinates[k], 1), rate)
        for k, rate in zip(form.numbers, form.rates, strict=True)
    ]
    return section(
        heading,
        Paragraph(say("Euler's equations along the axes of {body}:", body=Plain(form.body))),
        formulas(laws, result=True),
        Paragraph(say("Here")),
        formulas(writer.row(label, spin) for label, spin in zip(spins, form.spins, strict=True)),
        Paragraph(
            say("so that the quaternion changes at the rates")
            if len(form.numbers) == 4
            else say("so that the angles change at the rates")
        ),
        formulas(rates, result=True),
        Paragraph(say("Lagrange's equations of the centre of mass:")) if of_centre else None,
        formulas(of_centre, result=True),
    )


def _in_cyclic_order(writer: DocumentWriter, expression: Expr) -> DisplayNode:
    """Return an expression as it is displayed, with ω_3 ω_1 in place of ω_1 ω_3."""
    assert writer.euler is not None
    first, third = (writer.words.atoms[spin_symbol(writer.euler.body, axis)] for axis in "13")

    def ordered(node: DisplayNode) -> DisplayNode:
        factors = list(factors_of(node))
        if not isinstance(node, DisplayProduct) or not {first, third} <= {*factors}:
            return node
        k, j = factors.index(first), factors.index(third)
        factors[k], factors[j] = third, first
        return replace(node, factors=tuple(factors))

    tree = writer.tree(expression)
    if not isinstance(tree, DisplaySum):
        return ordered(tree)
    return replace(tree, terms=tuple(replace(t, node=ordered(t.node)) for t in tree.terms))
