"""d'Alembert's principle: applied forces, the coefficients of each δq, and the comparison."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from lagrange_cli.report.contents.forces import force_rows
from lagrange_cli.report.contents.sentences import is_generalized_potential
from lagrange_cli.report.contents.steps.by_lagrange import equation, lagrange_law, multiplier_terms
from lagrange_cli.report.contents.steps.energies import lagrangian_row
from lagrange_cli.report.contents.steps.writer import StepsWriter, sum_of
from lagrange_cli.report.tree import (
    Block,
    Formula,
    Law,
    Paragraph,
    Section,
    Title,
    formulas,
    section,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import BodySteps, VirtualWork
    from lagrange_cli.mechanics.system import Coordinate


def applied_forces(writer: StepsWriter) -> Section | None:
    """Return the applied force on each particle, of potentials, dissipation and forces."""
    blocks: list[Block] = []
    for body in writer.steps.bodies:
        rows = [
            writer.row(writer.force(part.name), part.force)
            for part in body.components
            if part.force != 0
        ]
        if rows:
            blocks += [writer.title(body.name)] if len(writer.steps.bodies) > 1 else []
            blocks.append(formulas(rows))
    note = "" if blocks else writer.say("No applied force acts on a particle.")
    return section(writer.say("Applied forces"), writer.paragraph(note), *blocks)


def principle(writer: StepsWriter) -> Section | None:
    """Return the coefficient of each δq, which vanishes."""
    coordinates = writer.equations.system.coordinates
    if not coordinates:
        return None
    say, names = writer.say, writer.steps.in_coordinates
    return section(
        say("d'Alembert's principle"),
        *names_in_coordinates(writer, names),
        Paragraph(
            say("Constraint forces do no work in virtual displacements that the constraints allow:")
        ),
        Law(f"{total_work(writer, effective_force(writer), names)} = 0"),
        Paragraph(independent(writer)),
        *coefficient_law(writer, names),
        *(
            block
            for number, (c, parts) in enumerate(
                zip(coordinates, writer.steps.balances, strict=True)
            )
            for block in _coefficient(writer, number, c, parts)
        ),
    )


def independent(writer: StepsWriter) -> str:
    """Say why the coefficient of each δq vanishes."""
    name = writer.letters.inline(writer.letters.virtual(writer.letters.symbol("q_j")))
    if writer.equations.system.pushing:
        return writer.say(
            "The {listed} are restricted by the constraints that are kept: with a multiplier for"
            " each of these, every coefficient vanishes.",
            listed=name,
        )
    sentence = "The {listed} are independent, so the coefficient of each vanishes."
    return writer.say(sentence, listed=name)


def total_work(writer: StepsWriter, force: str, names: Sequence[str]) -> str:
    """``Σ_i F_i · δr_i``, less ``Σ_j N_j δq_j`` of terms with ``names`` that act on no particle."""
    letters = writer.letters
    displaced = letters.virtual(letters.vector("r"))
    work = letters.total("i", f"{force}{letters.dot_product}{displaced}")
    if not names:
        return work
    displaced = letters.virtual(letters.symbol("q_j"))
    return f"{work} - {letters.total('j', letters.times(further_force(writer), displaced))}"


def coefficient_law(writer: StepsWriter, names: Sequence[str], total: str = "") -> Iterator[Block]:
    """Return the coefficient of δq_j with terms beside ``total``, where there are any."""
    letters = writer.letters
    terms = list(multiplier_terms(writer))
    if not (names or terms):
        return
    if not total:
        place = letters.partial(letters.vector("r"), letters.symbol("q_j"))
        total = letters.total("i", f"{effective_force(writer)}{letters.dot_product}{place}")
    total += f" - {further_force(writer)}" if names else ""
    yield Law(f"{sum_of([total, *terms])} = 0")


def further_force(writer: StepsWriter) -> str:
    """``N_j``, the inertia less force of what is written in coordinates."""
    return writer.letters.symbol(f"{writer.inertia_letter}_j")


def names_in_coordinates(writer: StepsWriter, names: Sequence[str]) -> Iterator[Paragraph]:
    """Name the terms that act on no particle, if there are any."""
    letters = writer.letters
    if not names:
        return
    yield Paragraph(
        writer.say.counted(
            len(names),
            "{listed} is written in coordinates and acts on no particle: its inertia less force"
            " is {further}.",
            "{listed} are written in coordinates and act on no particle: their inertia less"
            " force is {further}.",
            listed=", ".join(map(letters.words, names)),
            further=letters.inline(further_force(writer)),
        )
    )


def effective_force(writer: StepsWriter) -> str:
    """``(F_i - m_i r̈_i)``."""
    letters = writer.letters
    inertia = letters.times(letters.symbol("m_i"), letters.vector("r", 2))
    return letters.group(f"{letters.vector(writer.force_letter)} - {inertia}")


def _coefficient(
    writer: StepsWriter, number: int, coordinate: Coordinate, parts: VirtualWork
) -> Iterator[Block]:
    letters = writer.letters
    place = writer.lettered_coordinate(coordinate)
    yield Title(writer.say("For {place}:", place=letters.inline(letters.virtual(place))))
    slope = letters.partial(letters.vector("r"), place)
    inertia = letters.times(letters.symbol("m_i"), letters.vector("r", 2))
    rows: list[Formula] = []
    if parts.inertia != 0 or parts.work != 0:
        moved = letters.total("i", f"{inertia}{letters.dot_product}{slope}")
        force = letters.vector(writer.force_letter)
        worked = letters.total("i", f"{force}{letters.dot_product}{slope}")
        rows += [writer.row(moved, parts.inertia), writer.row(worked, parts.work)]
    if parts.coordinates != 0:
        label = letters.below(writer.inertia_letter, place)
        rows.append(writer.row(label, parts.coordinates))
    yield formulas(rows)
    yield from equation(
        writer, writer.steps.coordinates[number], writer.equations.derivation.shown[number]
    )


def comparison(writer: StepsWriter) -> Section | None:
    """Say that Lagrange's equations are the same, as was found by numbers."""
    if not writer.steps.balances:
        return None
    steps, labels, say = writer.steps, writer.lettered_labels, writer.say
    size = say("nothing")
    if steps.difference:
        difference = writer.letters.inline(writer.letters.number(steps.difference))
        size = say("{difference} at most, relative to their terms", difference=difference)
    potential = labels["U" if is_generalized_potential(writer.equations) else "V"]
    return section(
        say("The same by Lagrange's equations"),
        formulas(
            [
                writer.row(labels["T"], writer.equations.system.kinetic),
                writer.row(potential, writer.equations.system.potential),
                lagrangian_row(writer),
            ]
        ),
        Law(lagrange_law(writer, multiplier_terms(writer))),
        Paragraph(
            say.counted(
                steps.states,
                "Evaluated from {lagrangian} at {count} random state in {digits} digits, these"
                " differ from the coefficients above by {size}: both ways give the same equations.",
                "Evaluated from {lagrangian} at {count} random states in {digits} digits, these"
                " differ from the coefficients above by {size}: both ways give the same equations.",
                lagrangian=writer.letters.inline(labels["L"]),
                digits=writer.equations.derivation.certificate.digits,
                size=size,
            )
        ),
    )


def newton_equations(writer: StepsWriter) -> Section | None:
    """m r̈ = F + f of each particle, where constraint forces f, which may be none, are derived."""
    forces = writer.equations.derivation.constraint_forces
    if forces is None:
        return None
    letters = writer.letters
    inertia = letters.times(letters.symbol("m_i"), letters.vector("r", 2))
    blocks: list[Block] = []
    for body in writer.steps.bodies:
        rows = [] if body.name in forces.shared else list(_newton(writer, body))
        if rows:
            blocks += [writer.title(body.name)] if len(writer.steps.bodies) > 1 else []
            blocks.append(formulas(rows))
    if not blocks:
        return None
    law = f"{inertia} = {letters.vector(writer.force_letter)}"
    if not (forces.shared or list(force_rows(forces))):
        return section(writer.say("Newton's equations"), Law(law), *blocks)
    return section(
        writer.say("Newton's equations"),
        Law(f"{law} + {letters.vector('f')}"),
        Paragraph(
            writer.say("The constraint forces that make up the difference are listed below.")
        ),
        *blocks,
    )


def _newton(writer: StepsWriter, body: BodySteps) -> Iterator[Formula]:
    for part in body.components:
        is_short = part.acceleration == 0 or part.acceleration.is_Symbol
        if body.mass is not None and not is_short:
            acceleration = writer.cartesian(part.name, 2)
            label = writer.letters.times(writer.factor(body.mass), acceleration)
            yield writer.row(label, body.mass * part.acceleration)
        if part.force != 0:
            yield writer.row(writer.force(part.name), part.force)
