"""Ignored coordinates, Routh's function, the equations of the others."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.analysis.forms.routhian import Routhian, routhian_form
from lagrange_cli.analysis.symmetries.starting_values import value_at_start
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.notation.build import display_row
from lagrange_cli.notation.labels import quantity_labels
from lagrange_cli.report.contents.forms.writer import FormWriter, certified
from lagrange_cli.report.inlines import Inline, Listed, Sentence, enumerated, say, value
from lagrange_cli.report.tree import Block, Formula, Paragraph, Section, formulas

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

#: Digits of the momenta at the start.
_DIGITS = 6


def routhian_sections(writer: FormWriter) -> list[Section]:
    """Return the sections in place of Lagrange's equations."""
    form = routhian_form(writer.equations)
    writer = writer.knowing(form.momenta)
    momenta = [writer.row(writer.momentum(m), m.expression) for m in form.momenta]
    start = {
        m.symbol: known
        for m in form.momenta
        if (known := value_at_start(writer.equations, m.expression)) is not None
    }
    ignored = [
        writer.row(
            writer.coordinate(m.coordinate, 1),
            velocity,
            *([shortened(velocity.xreplace(start))] if start else []),
        )
        for m, velocity in zip(form.momenta, form.velocities, strict=True)
    ]
    sections = [
        Section(
            say("Ignored coordinates"),
            (
                Paragraph(_told(writer, form)),
                formulas(momenta, result=True),
                *_start(writer, form, start),
            ),
        ),
        Section(say("Routhian"), tuple(_routhian(writer, form))),
    ]
    if form.coordinates:
        rows = formulas(_equations(writer, form), result=True)
        sections.append(Section(say("Equations of motion"), (rows,)))
    words = Paragraph(certified(form.certificate))
    recovered = formulas(ignored, result=True), words
    return [*sections, Section(say("Velocities of the ignored coordinates"), recovered)]


def _told(writer: FormWriter, form: Routhian) -> Sentence:
    """Name the cyclic coordinates, and what is constant."""
    return say.counted(
        len(form.momenta),
        "{coordinates} is cyclic; its momentum is a constant of the motion:",
        "{coordinates} are cyclic; their momenta are constants of the motion:",
        coordinates=enumerated([writer.coordinate(m.coordinate) for m in form.momenta]),
    )


def _start(
    writer: FormWriter, form: Routhian, start: Mapping[sympy.Symbol, sympy.Expr]
) -> Iterator[Paragraph]:
    """Return the values of the momenta at the initial state, in parameters where it is so."""
    if form.start or start:
        numbers = form.start or (math.nan,) * len(form.momenta)
        values = [
            Inline(
                writer.momentum(m)
                + " = "
                + (
                    writer.formula(start[m.symbol])
                    if m.symbol in start
                    else value(number, f"{number:.{_DIGITS}g}")
                )
            )
            for m, number in zip(form.momenta, numbers, strict=True)
            if m.symbol in start or form.start
        ]
        yield Paragraph(say("At the start {values}.", values=Listed(tuple(values))))


def _routhian(writer: FormWriter, form: Routhian) -> Iterator[Block]:
    """R with V_eff as a letter, and V_eff; what terms linear in velocities are."""
    name = quantity_labels(writer.equations)["V_eff"]
    letter = sympy.Symbol(name, real=True)
    parts = [e for e in (form.kinetic, form.gyroscopic, -letter) if e != 0]
    yield formulas(
        [
            writer.also(letter, name).total(writer.labels["R"], parts),
            writer.total(writer.labels["V_eff"], form.potential),
        ],
        result=True,
    )
    if form.gyroscopic != 0:
        linear = writer.inline(form.gyroscopic)
        yield Paragraph(say("{linear} is gyroscopic: its force does no work.", linear=linear))


def _equations(writer: FormWriter, form: Routhian) -> list[Formula]:
    return [
        Formula("", (writer.noted(display_row(shown, writer.words)),), name=writer.coordinate(c))
        for c, shown in zip(form.coordinates, form.shown, strict=True)
    ]
