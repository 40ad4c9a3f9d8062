"""Equations of motion, of closures and of contacts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.mechanics.families.forms import FamilyRow
from lagrange_cli.notation.build import display_row, display_sum
from lagrange_cli.report.contents.derivation.euler import eulers_equations
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.sentences import (
    contacts_lines,
    divisor_and_factor,
    explicit_line,
    multipliers_line,
)
from lagrange_cli.report.contents.steps.by_lagrange import lagrange_law
from lagrange_cli.report.inlines import (
    COMMA,
    Expression,
    Inline,
    Label,
    Listed,
    Plain,
    Prose,
    Text,
    Unit,
    Written,
    at_least,
    closed,
    in_parentheses,
    joined,
    named,
    opened,
    partial,
    ranges,
    say,
    symbol,
    total,
)
from lagrange_cli.report.tree import Block, Formula, Law, Paragraph, Section, formulas, section

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm
    from lagrange_cli.mechanics.equations import ShownEquation
    from lagrange_cli.mechanics.kinks import Switch
    from lagrange_cli.mechanics.system import State


def motion(writer: DocumentWriter, form: str) -> Section | None:
    """Lagrange's equations, or what they say of the accelerations, with ``form`` explicit."""
    equations = writer.equations
    heading = say("Equations of motion")
    if not equations.system.coordinates:
        return section(heading, Paragraph(say("There are none.")))
    if form == "explicit":
        return _solved(writer, heading)
    if writer.euler is not None:
        rows = lagrange_equations(writer)
        of_centre = [row for k, row in enumerate(rows) if k not in writer.euler.numbers]
        return eulers_equations(writer, writer.euler, heading, of_centre)
    return section(
        heading,
        Paragraph(say("Lagrange's equations,"), only="document"),
        Law(lagrange_law(writer, _multiplied(writer)) + ",", ends=False, only="document"),
        Paragraph(say("read"), only="document"),
        formulas(lagrange_equations(writer), result=True),
        writer.paragraph(*_divided(writer), only="document"),
    )


def _solved(writer: DocumentWriter, heading: Written) -> Section | None:
    """Return the accelerations and multipliers, and what they are solved for."""
    sentence = explicit_line(writer.equations, explicit_form(writer.equations))
    return section(
        heading,
        Paragraph(say("{text}:", text=sentence), only="document"),
        formulas(accelerations(writer), result=True),
        lead=(closed(sentence),),
        gap=", ",
    )


def lagrange_equations(writer: DocumentWriter) -> list[Formula]:
    """Return the equation of each coordinate, or of all of a family."""
    equations = writer.equations
    rows = []
    for one in writer.with_families("motion", len(equations.derivation.shown)):
        if isinstance(one, FamilyRow):
            rows.append(_family(writer, one))
            continue
        shown = equations.derivation.shown[one]
        left = writer.noted(writer.shown_row(shown, writer.words))
        name = writer.coordinate(equations.system.coordinates[one])
        rows.append(Formula("", (left,), name=name, aside=_factor(writer, one, shown)))
    return rows


def _factor(writer: DocumentWriter, one: int | FamilyRow, shown: ShownEquation) -> Text:
    """Say in brackets what an equation was divided by or multiplied with, if anything."""
    divisor, factor = divisor_and_factor(shown)
    if divisor is not None:
        return say("(divided by {factor})", factor=_part(writer, one, divisor))
    if factor is not None:
        return say("(multiplied by {factor})", factor=_part(writer, one, factor))
    return ""


def _family(writer: DocumentWriter, row: FamilyRow) -> Formula:
    """Return the equations of a family as one."""
    assert writer.over_letters is not None
    return Formula(
        "",
        (writer.noted(writer.shown_row(row.shown, writer.over_letters.words_of(row))),),
        name=symbol(row.name),
        ranges=ranges(row.ranges),
        aside=_factor(writer, row, row.shown),
    )


def accelerations(writer: DocumentWriter) -> list[Formula]:
    """Return accelerations and multipliers, with M and f where they stay coupled."""
    explicit = explicit_form(writer.equations)
    named = [
        (c.name, writer.coordinate(c, 2), value)
        for c, value in zip(
            writer.equations.system.coordinates, explicit.accelerations, strict=True
        )
        if value is not None
    ]
    rows = list(writer.definitions(named, order=2))
    rows += [
        writer.row(Expression(writer.tree(closure.multiplier)), value)
        for closure, value in zip(
            writer.equations.system.closures, explicit.multipliers, strict=True
        )
        if value is not None
    ]
    return [*rows, *_coupled(writer, explicit.coupled), *_differentiated(writer, explicit)]


def _coupled(writer: DocumentWriter, indices: Sequence[int]) -> Iterator[Formula]:
    """``Σ M a = f`` for coordinates whose accelerations are not solved for."""
    equations, forcing = writer.equations, forcing_with_reactions(writer.equations)
    for i in indices:
        terms = [
            equations.system.mass_matrix[i][j] * equations.system.coordinates[j].a
            for j in indices
            if equations.system.mass_matrix[i][j] != 0
        ]
        left = writer.noted(display_sum(terms, writer.words))
        yield Formula("", (left, writer.tree(forcing[i])))


def _differentiated(writer: DocumentWriter, explicit: ExplicitForm) -> Iterator[Formula]:
    """Return the closures beside accelerations that are not solved for, differentiated."""
    for closure, value in zip(writer.equations.system.closures, explicit.multipliers, strict=True):
        if value is None:
            row = display_row(differentiated(writer.equations, closure), writer.words)
            yield Formula("", (writer.noted(row),))


def _multiplied(writer: DocumentWriter) -> Iterator[Label]:
    """Return the generalized forces of the constraints, by kinds of closures and contacts."""
    kinds = {closure.kind for closure in writer.equations.system.pushing}
    for kind, letter, order in (("position", "varphi", 0), ("velocity", "psi", 1)):
        if kind in kinds:
            slope = partial(symbol(f"{letter}_k"), symbol("q_j", order))
            yield total("k", symbol("lambda_k") + " " + slope)


def _divided(writer: DocumentWriter) -> list[Written]:
    """Say which common factors were divided out of which equations, or multiplied to them."""
    equations = writer.equations
    divided: list[Written] = []
    multiplied: list[Written] = []
    for one in writer.with_families("motion", len(equations.derivation.shown)):
        if isinstance(one, FamilyRow):
            shown, place = one.shown, Inline(symbol(one.name))
        else:
            shown = equations.derivation.shown[one]
            place = Inline(writer.coordinate(equations.system.coordinates[one]))
        divisor, factor = divisor_and_factor(shown)
        if divisor is not None:
            first, later = "{factor} in the equation for {place}", "{factor} in that for {place}"
            parts = {"factor": _part(writer, one, divisor), "place": place}
            divided.append(say.first(not divided, first, later, **parts))
        if factor is not None:
            first, later = "the equation for {place} by {factor}", "that for {place} by {factor}"
            parts = {"factor": _part(writer, one, factor), "place": place}
            multiplied.append(say.first(not multiplied, first, later, **parts))
    sentences: list[Written] = []
    if divided:
        single = "Common factor divided out: {listed}."
        many = "Common factors divided out: {listed}."
        listed = Listed(tuple(divided))
        sentences.append(say.counted(len(divided), single, many, listed=listed))
    if multiplied:
        listed = Listed(tuple(multiplied))
        sentences.append(say("Multiplied to be rid of fractions: {listed}.", listed=listed))
    return sentences


def _part(writer: DocumentWriter, one: int | FamilyRow, expression: Expr) -> Inline:
    """Return a factor of an equation, within a sentence."""
    if isinstance(one, FamilyRow) and writer.over_letters is not None:
        return Inline(Expression(writer.over_letters.part(one, expression)))
    return writer.inline(expression)


def closures(writer: DocumentWriter) -> Section | None:
    """Return the equations beside those of motion, and what their multipliers mean."""
    rows, meant = closure_rows(writer), multipliers_line(writer.equations)
    if writer.euler is not None:
        return section(say("Closure equations"), formulas(rows, result=True))
    if not rows or meant is None:
        return None
    kinds = {closure.kind for closure in writer.equations.system.closures}
    phi, psi = (Inline(symbol(name)) for name in ("varphi_k", "psi_k"))
    sentence = say(
        "These hold beside the equations of motion; their left sides are the {letter}.",
        letter=phi if "position" in kinds else psi,
    )
    if len(kinds) > 1:
        sentence = say(
            "These hold beside the equations of motion; their left sides are {phi}, or {psi} where"
            " they hold velocities.",
            phi=phi,
            psi=psi,
        )
    return section(
        say("Closure equations"),
        Paragraph(sentence, only="document"),
        formulas(rows, result=True),
        Paragraph(say("{text}.", text=meant)),
    )


def closure_rows(writer: DocumentWriter) -> list[Formula]:
    """Return the closure equations, each with its name."""
    rows, listed = [], writer.equations.system.closures
    for one in writer.with_families("closures", len(listed)):
        if isinstance(one, FamilyRow):
            rows.append(replace(writer.family_row("", one), name=named(one.name)))
        else:
            tree, name = writer.tree(listed[one].expression), named(listed[one].name)
            rows.append(Formula("", (tree,), name=name))
    return rows


def contacts(writer: DocumentWriter) -> Section | None:
    """Return gaps with their multipliers and restitutions, and what these mean."""
    rows = contact_rows(writer)
    if not rows:
        return None
    gap, push, elastic = symbol("varphi_k"), symbol("lambda_k"), symbol("e_k")
    closing = symbol("varphi_k", 1)
    restitutions = [
        say("{value} for {name}", value=writer.inline(c.restitution), name=Plain(c.name))
        for c in writer.equations.system.contacts
    ]
    conditions = (at_least(gap), at_least(push), push + " " + gap + " = 0,")
    return section(
        say("Contacts"),
        Paragraph(
            say(
                "The gaps {gap} of one-sided constraints and their multipliers obey",
                gap=Inline(gap),
            ),
            only="document",
        ),
        Law(joined(COMMA, conditions), ends=False, only="document"),
        Paragraph(say("here"), only="document"),
        formulas(rows, result=True),
        Paragraph(
            say(
                "Times the gradient of the gap, {push} is the force of the contact. A gap that"
                " closes with {closing} opens with {opening}; the restitution {elastic} is"
                " {listed}.",
                push=Inline(push),
                closing=Inline(closing + " < 0"),
                opening=Inline("-" + elastic + " " + closing),
                elastic=Inline(elastic),
                listed=Listed(tuple(restitutions)),
            ),
            only="document",
        ),
        *(Paragraph(line, only="terminal") for line in contacts_lines(writer.equations)),
    )


def contact_rows(writer: DocumentWriter) -> list[Formula]:
    """Complementarity of each contact: 0 ≤ λ ⊥ φ ≥ 0."""
    return [
        Formula(
            "",
            (writer.tree(contact.closure.expression),),
            name=named(contact.name),
            multiplier=Expression(writer.tree(contact.closure.multiplier)),
            aside=say("restitution {value}", value=writer.inline(contact.restitution)),
        )
        for contact in writer.equations.system.contacts
    ]


def states(writer: DocumentWriter) -> Section | None:
    """Return the rates of the states of first order, and what they are."""
    memory = {name for c in writer.equations.system.controllers for name, _ in c.memory}
    listed = [s for s in writer.equations.system.states if s.name not in memory]
    if not listed:
        return None
    moving = [s for s in listed if s.switch is None]
    rates = [
        Paragraph(
            say(
                "The rates of these numbers are given; they are no degrees of freedom, and have"
                " neither inertia nor momentum."
            ),
            only="document",
        ),
        formulas([writer.row(symbol(s.name, 1, s.latex), s.rate) for s in moving], result=True),
    ]
    return section(
        say("States of first order") if moving else say("States with two values"),
        *(rates if moving else ()),
        *(_switch(writer, s, s.switch) for s in listed if s.switch is not None),
        _described(listed),
        Paragraph(say("States are no degrees of freedom."), only="terminal"),
    )


def _switch(writer: DocumentWriter, state: State, switch: Switch) -> Paragraph:
    """Say when a state with two values changes."""
    on, off = (Inline(at_least(Expression(writer.tree(e)))) for e in (switch.on, switch.off))
    return Paragraph(
        say(
            "{name} becomes 1 where {on}, and 0 where {off}; elsewhere it stays as it is.",
            name=Inline(symbol(state.name, 0, state.latex)),
            on=on,
            off=off,
        )
    )


def _described(listed: Sequence[State]) -> Paragraph | None:
    """Return units and descriptions of states."""
    described = [
        in_parentheses(
            Inline(symbol(s.name, 0, s.latex)),
            *([Prose(s.description)] if s.description else []),
            *([Unit(s.unit)] if s.unit else []),
        )
        for s in listed
        if s.description or s.unit
    ]
    one, many = "State: {listed}.", "States: {listed}."
    meaning = say.counted(len(described), one, many, listed=Listed(tuple(described)))
    return Paragraph(meaning) if described else None


def controllers(writer: DocumentWriter) -> Section | None:
    """Return what sampled controllers set, and when."""
    system, blocks = writer.equations.system, list[Block | None]()
    state_of = {s.name: s for s in system.states}
    for controller in system.controllers:
        every = writer.inline(controller.every)
        when: Text = opened(say("at the start and at all multiples of {time}", time=every))
        if controller.name:
            when = in_parentheses(when, Plain(controller.name))
        rows = [writer.row(symbol(name), e) for name, e in controller.held_inputs]
        rows += [
            writer.row(symbol(name, 0, state_of[name].latex), e) for name, e in controller.memory
        ]
        blocks += [Paragraph(say("{text}:", text=when)), formulas(rows, result=True)]
    memory = [state_of[name] for c in system.controllers for name, _ in c.memory]
    if not blocks:
        return None
    return section(
        say("Sampled control"),
        *blocks,
        _described(memory),
        Paragraph(
            say(
                "What is set is constant until the next sample; on the right are the values before"
                " it."
            )
        ),
    )


def result(writer: DocumentWriter) -> Section | None:
    """Return the accelerations and multipliers that a computer integrates."""
    return _solved(writer, say("Result")) if writer.equations.system.coordinates else None
