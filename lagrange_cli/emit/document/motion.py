"""Equations of motion, of closures and of contacts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.emit.constraint_wording import (
    divisor_and_factor,
    explicit_line,
    multipliers_line,
)
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.steps.sections import Block, Formula, Law, Section, Words, formulas, section
from lagrange_cli.emit.steps.writer import sum_of
from lagrange_cli.mechanics.dynamics.accelerations import (
    differentiated,
    explicit_form,
    forcing_with_reactions,
)
from lagrange_cli.notation.build import display, display_row, display_sum

if TYPE_CHECKING:
    from lagrange_cli.mechanics.dynamics.accelerations import ExplicitForm


def motion(writer: DocumentWriter, form: str) -> Section | None:
    """Lagrange's equations, or what they say of the accelerations, with ``form`` explicit."""
    equations, say = writer.equations, writer.say
    heading = say("Equations of motion")
    if not equations.coordinates:
        return section(heading, Words(say("There are none.")))
    if form == "explicit":
        told = explicit_line(equations, explicit_form(equations), say)
        return section(
            heading, Words(say("{text}:", text=told)), formulas(accelerations(writer), result=True)
        )
    return section(
        heading,
        Words(say("Lagrange's equations,")),
        Law(f"{_law(writer)},", ends=False),
        Words(say("read")),
        formulas(lagrange_equations(writer), result=True),
        writer.told(*_divided(writer)),
    )


def lagrange_equations(writer: DocumentWriter) -> list[Formula]:
    """The equation of each coordinate."""
    equations = writer.equations
    rows = []
    for c, shown in zip(equations.coordinates, equations.shown, strict=True):
        is_rate = shown.momentum is not None
        left = display_row(shown, writer.words)
        if shown.momentum is not None:
            left = display(shown.momentum, writer.words)
        rows.append(Formula("", (writer.noted(left),), name=writer.coordinate(c), is_rate=is_rate))
    return rows


def accelerations(writer: DocumentWriter) -> list[Formula]:
    """Accelerations and multipliers, with M and f where they stay coupled."""
    explicit = explicit_form(writer.equations)
    labels = [
        *(writer.coordinate(c, 2) for c in writer.equations.coordinates),
        *(writer.letters.formula(writer.tree(c.multiplier)) for c in writer.equations.closures),
    ]
    values = (*explicit.accelerations, *explicit.multipliers)
    rows = [
        writer.row(label, value)
        for label, value in zip(labels, values, strict=True)
        if value is not None
    ]
    return [*rows, *_coupled(writer, explicit.coupled), *_differentiated(writer, explicit)]


def _coupled(writer: DocumentWriter, indices: Sequence[int]) -> Iterator[Formula]:
    """``Σ M a = f`` for coordinates whose accelerations are not solved for."""
    equations, forcing = writer.equations, forcing_with_reactions(writer.equations)
    for i in indices:
        terms = [
            equations.mass_matrix[i][j] * equations.coordinates[j].a
            for j in indices
            if equations.mass_matrix[i][j] != 0
        ]
        left = writer.noted(display_sum(terms, writer.words))
        yield Formula("", (left, writer.tree(forcing[i])))


def _differentiated(writer: DocumentWriter, explicit: ExplicitForm) -> Iterator[Formula]:
    """The closures beside accelerations that are not solved for, differentiated."""
    for closure, value in zip(writer.equations.closures, explicit.multipliers, strict=True):
        if value is None:
            row = display_row(differentiated(writer.equations, closure), writer.words)
            yield Formula("", (writer.noted(row),))


def _law(writer: DocumentWriter) -> str:
    """d/dt ∂L/∂q̇ − ∂L/∂q + ∂D/∂q̇ = Q + Σ λ ∂φ/∂q, as far as there are such parts."""
    letters, labels = writer.letters, writer.labels
    place, speed = letters.symbol("q_j"), letters.symbol("q_j", 1)
    left = f"{letters.rate(letters.partial(labels['L'], speed))}"
    left += f" - {letters.partial(labels['L'], place)}"
    if writer.equations.dissipation != 0:
        left += f" + {letters.partial(labels['D'], speed)}"
    force = letters.symbol("Q_j") if writer.equations.forces else ""
    return f"{left} = {sum_of([force, *_multiplied(writer)])}"


def _multiplied(writer: DocumentWriter) -> Iterator[str]:
    """The generalized forces of the constraints, by kinds of closures and contacts."""
    letters, kinds = writer.letters, {closure.kind for closure in writer.equations.pushing}
    for kind, letter, order in (("position", "varphi", 0), ("velocity", "psi", 1)):
        if kind in kinds:
            slope = letters.partial(letters.symbol(f"{letter}_k"), letters.symbol("q_j", order))
            yield letters.total("k", f"{letters.symbol('lambda_k')} {slope}")


def _divided(writer: DocumentWriter) -> list[str]:
    """Say which common factors were divided out of which equations, or multiplied to them."""
    equations, say, letters = writer.equations, writer.say, writer.letters
    divided: list[str] = []
    multiplied: list[str] = []
    for c, shown in zip(equations.coordinates, equations.shown, strict=True):
        divisor, factor = divisor_and_factor(shown)
        place = letters.inline(writer.coordinate(c))
        if divisor is not None:
            first, next_ = "{factor} in the equation for {place}", "{factor} in that for {place}"
            divided.append(
                say.first(not divided, first, next_, factor=writer.inline(divisor), place=place)
            )
        if factor is not None:
            first, next_ = "the equation for {place} by {factor}", "that for {place} by {factor}"
            multiplied.append(
                say.first(not multiplied, first, next_, factor=writer.inline(factor), place=place)
            )
    told = []
    if divided:
        one, many = "Common factor divided out: {listed}.", "Common factors divided out: {listed}."
        told.append(say.counted(len(divided), one, many, listed=", ".join(divided)))
    if multiplied:
        listed = ", ".join(multiplied)
        told.append(say("Multiplied to be rid of fractions: {listed}.", listed=listed))
    return told


def closures(writer: DocumentWriter) -> Section | None:
    """The equations beside those of motion, and what their multipliers mean."""
    rows, say, letters = closure_rows(writer), writer.say, writer.letters
    if not rows:
        return None
    kinds = {closure.kind for closure in writer.equations.closures}
    phi, psi = (letters.inline(letters.symbol(name)) for name in ("varphi_k", "psi_k"))
    told = say(
        "These hold beside the equations of motion; their left sides are the {letter}.",
        letter=phi if "position" in kinds else psi,
    )
    if len(kinds) > 1:
        told = say(
            "These hold beside the equations of motion; their left sides are {phi}, or {psi} where"
            " they hold velocities.",
            phi=phi,
            psi=psi,
        )
    meant = say("{text}.", text=multipliers_line(writer.equations, say))
    return section(say("Closure equations"), Words(told), formulas(rows, result=True), Words(meant))


def closure_rows(writer: DocumentWriter) -> list[Formula]:
    """The closure equations, each with its name."""
    return [
        Formula("", (writer.tree(c.expression),), name=writer.letters.named(c.name))
        for c in writer.equations.closures
    ]


def contacts(writer: DocumentWriter) -> Section | None:
    """Gaps with their multipliers and restitutions, and what these mean."""
    say, letters, rows = writer.say, writer.letters, contact_rows(writer)
    if not rows:
        return None
    gap, push = letters.symbol("varphi_k"), letters.symbol("lambda_k")
    rate = letters.symbol("varphi_k", 1)
    elastic = letters.symbol("e_k")
    told = [
        say("{value} for {name}", value=writer.inline(c.restitution), name=letters.words(c.name))
        for c in writer.equations.contacts
    ]
    blocks: list[Block] = [
        Words(
            say(
                "The gaps {gap} of one-sided constraints and their multipliers obey",
                gap=letters.inline(gap),
            )
        ),
        Law(
            letters.comma.join(
                (letters.at_least(gap), letters.at_least(push), f"{push} {gap} = 0,")
            ),
            ends=False,
        ),
        Words(say("here")),
        formulas(rows, result=True),
        Words(
            say(
                "Times the gradient of the gap, {push} is the force of the contact. A gap that"
                " closes with {closing} opens with {opening}; the restitution {elastic} is"
                " {listed}.",
                push=letters.inline(push),
                closing=letters.inline(f"{rate} < 0"),
                opening=letters.inline(f"-{elastic} {rate}"),
                elastic=letters.inline(elastic),
                listed=", ".join(told),
            )
        ),
    ]
    return section(say("Contacts"), *blocks)


def contact_rows(writer: DocumentWriter) -> list[Formula]:
    """Complementarity of each contact: 0 ≤ λ ⊥ φ ≥ 0."""
    return [
        Formula(
            "",
            (writer.tree(contact.closure.expression),),
            name=writer.letters.named(contact.name),
            multiplier=writer.letters.formula(writer.tree(contact.closure.multiplier)),
        )
        for contact in writer.equations.contacts
    ]


def result(writer: DocumentWriter) -> Section | None:
    """The accelerations and multipliers that a computer integrates."""
    equations, say = writer.equations, writer.say
    if not equations.coordinates:
        return None
    told = explicit_line(equations, explicit_form(equations), say)
    return section(
        say("Result"),
        Words(say("{text}:", text=told)),
        formulas(accelerations(writer), result=True),
    )
