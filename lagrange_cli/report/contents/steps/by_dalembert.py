"""d'Alembert's principle: applied forces, the coefficients of each δq, and the comparison."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import sympy

from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.notation.build import display_terms
from lagrange_cli.report.contents.forces import force_rows
from lagrange_cli.report.contents.steps import turnings
from lagrange_cli.report.contents.steps.by_lagrange import equation, lagrange_law, multiplier_terms
from lagrange_cli.report.contents.steps.energies import lagrangian_row
from lagrange_cli.report.contents.steps.writer import (
    DISPLACED,
    INERTIA,
    PLACE,
    POSITION,
    StepsWriter,
    by_body,
    sum_of,
    work,
    work_in_coordinates,
)
from lagrange_cli.report.inlines import (
    NOTHING,
    Label,
    Listed,
    Plain,
    Written,
    below,
    enumerated,
    group,
    partial,
    rounded,
    say,
    symbol,
    times,
    vector,
    virtual,
)
from lagrange_cli.report.tree import Formula, Law, Part, Section, Title, formulas, section

if TYPE_CHECKING:
    from lagrange_cli.mechanics.step_values import BodySteps, VirtualWork


def applied_forces(writer: StepsWriter) -> Section | None:
    """Return the applied force on each particle, of potentials, dissipation and forces."""
    blocks: list[Part] = list(
        by_body(
            writer,
            lambda body: [
                writer.row(writer.force(p.name), p.force) for p in body.components if p.force != 0
            ],
        )
    )
    torques = list(turnings.torques(writer))
    if torques:
        heading = say("About the centres of mass act the torques")
        return section(say("Applied forces"), *blocks, heading, *torques)
    note = say("No applied force acts on a particle.")
    if writer.turning:
        note = say("No applied force acts on a body.")
    return section(say("Applied forces"), *(blocks or [note]))


def principle(writer: StepsWriter) -> Section | None:
    """Return the coefficient of each δq, which vanishes."""
    names, balances = writer.steps.in_coordinates, writer.steps.balances
    if not balances:
        return None
    return section(
        say("d'Alembert's principle"),
        names_in_coordinates(writer, names),
        say("Constraint forces do no work in virtual displacements that the constraints allow:"),
        Law(total_work(writer, work_with_inertia(writer, *writer.displaced), names) + " = 0"),
        independent(writer),
        *coefficient_law(writer, names),
        *(block for parts in balances for block in _coefficient(writer, parts)),
    )


def independent(writer: StepsWriter) -> Written:
    """Say why the coefficient of each δq vanishes."""
    displacements = [parts.displacement for parts in writer.steps.balances]
    listed: Written = DISPLACED
    if any(one.axis for one in displacements):
        listed = enumerated([virtual(writer.displaced_place(one)) for one in displacements])
    if writer.restricting:
        return say(
            "The {listed} are restricted by the constraints that are kept: with a multiplier for"
            " each of these, every coefficient vanishes.",
            listed=listed,
        )
    sentence = "The {listed} are independent, so the coefficient of each vanishes."
    return say(sentence, listed=listed)


def total_work(writer: StepsWriter, by_particles: Label, names: Sequence[str]) -> Label:
    """A sum of works, less ``Σ_j N_j δq_j`` of terms with ``names`` that act on no particle."""
    if not names:
        return by_particles
    return by_particles + " - " + work_in_coordinates(further_force(writer))


def coefficient_law(
    writer: StepsWriter, names: Sequence[str], force: Label = NOTHING
) -> Iterator[Part]:
    """Return the coefficient of δq_j with terms beside ``force``, where there are any."""
    terms = list(multiplier_terms(writer, writer.restricting))
    if not (names or terms):
        return
    whole = force or work_with_inertia(writer, partial(POSITION, PLACE), writer.spin_slope)
    if names:
        whole += " - " + further_force(writer)
    yield Law(sum_of([whole, *terms]) + " = 0")


def further_force(writer: StepsWriter) -> Label:
    """``N_j``, the inertia less force of what is written in coordinates."""
    return symbol(f"{writer.inertia_letter}_j")


def names_in_coordinates(writer: StepsWriter, names: Sequence[str]) -> Written | None:
    """Name the terms that act on no particle, if there are any."""
    if not names:
        return None
    return say.counted(
        len(names),
        "{listed} is written in coordinates and acts on no particle: its inertia less force"
        " is {further}.",
        "{listed} are written in coordinates and act on no particle: their inertia less"
        " force is {further}.",
        listed=Listed(tuple(map(Plain, names))),
        further=further_force(writer),
    )


def work_with_inertia(writer: StepsWriter, slope: Label, turn: Label) -> Label:
    """``Σ_i (F_i - m_i r̈_i) · δr_i + Σ_i (M_i - L̇_i) · δφ_i``, as far as there are such parts.

    ``slope``, ``turn``: δr_i and δφ_i, or their derivatives by a coordinate.
    """
    whole = work(group(writer.applied + " - " + INERTIA), slope)
    if not writer.turning:
        return whole
    if not turnings.has_torques(writer):
        return whole + " - " + work(writer.momentum_rate, turn)
    return whole + " + " + work(group(writer.torque + " - " + writer.momentum_rate), turn)


def applied_work(writer: StepsWriter, slope: Label, turn: Label) -> Label:
    """``Σ_i F_i · δr_i + Σ_i M_i · δφ_i``, the second where there is a torque."""
    whole = work(writer.applied, slope)
    return whole + " + " + work(writer.torque, turn) if turnings.has_torques(writer) else whole


def _coefficient(writer: StepsWriter, parts: VirtualWork) -> Iterator[Part]:
    place = writer.displaced_place(parts.displacement)
    yield Title(say("For {place}:", place=virtual(place)))
    slope = partial(POSITION, place)
    rows: list[Formula] = []
    if parts.inertia != 0 or parts.work != 0:
        rows.append(writer.row(work(INERTIA, slope), parts.inertia))
        rows.append(writer.row(work(writer.applied, slope), parts.work))
    turn = writer.spin_along(parts.displacement)
    for force, value in ((writer.momentum_rate, parts.turning), (writer.torque, parts.torques)):
        if value != 0:
            rows.append(writer.row(work(force, turn), value))
    if parts.coordinates != 0:
        rows.append(writer.row(below(writer.inertia_letter, place), parts.coordinates))
    yield formulas(rows)
    if parts.displacement.axis:
        shown = ShownEquation("", parts.terms, sympy.Integer(1))
        yield say("so that")
        yield formulas([Formula("", (display_terms(shown, writer.words),))], result=True)
    else:
        names = [c.name for c in writer.equations.system.coordinates]
        yield from equation(writer, names.index(parts.displacement.name), say("so that"))


def comparison(writer: StepsWriter) -> Section | None:
    """Say that Lagrange's equations are the same, as was found by numbers."""
    steps, labels, system = writer.steps, writer.labels, writer.equations.system
    if not steps.balances:
        return None
    size = say("nothing")
    if steps.difference:
        difference = rounded(steps.difference)
        size = say("{difference} at most, relative to their terms", difference=difference)
    return section(
        say("The same by Lagrange's equations"),
        formulas(
            [
                writer.row(labels["T"], system.kinetic),
                writer.row(writer.potential, system.potential),
                lagrangian_row(writer),
            ]
        ),
        Law(lagrange_law(writer, multiplier_terms(writer, system.pushing))),
        _of_quaternions(writer),
        say.counted(
            steps.states,
            "Evaluated from {lagrangian} at {count} random state in {digits} digits, these"
            " differ from the coefficients above by {size}: both ways give the same equations.",
            "Evaluated from {lagrangian} at {count} random states in {digits} digits, these"
            " differ from the coefficients above by {size}: both ways give the same equations.",
            lagrangian=labels["L"],
            digits=writer.equations.derivation.certificate.digits,
            size=size,
        ),
    )


def _of_quaternions(writer: StepsWriter) -> Written | None:
    """Say how Lagrange's equations of the parts of quaternions are those of small turns."""
    if not any(parts.displacement.axis for parts in writer.steps.balances):
        return None
    return say(
        "Those of the parts of a quaternion are multiplied by the derivatives of these by a small"
        " turn and added: the multiplier of its length drops out."
    )


def newton_equations(writer: StepsWriter) -> Section | None:
    """m r̈ = F + f of each particle, where constraint forces f, which may be none, are derived."""
    forces = writer.equations.derivation.constraint_forces
    if forces is None:
        return None
    blocks = list(
        by_body(writer, lambda body: [] if body.name in forces.shared else _newton(writer, body))
    )
    if not blocks:
        return None
    law, note = INERTIA + " = " + writer.applied, None
    if forces.shared or list(force_rows(forces)):
        law += " + " + vector("f")
        note = say("The constraint forces that make up the difference are listed below.")
    return section(say("Newton's equations"), Law(law), note, *blocks)


def _newton(writer: StepsWriter, body: BodySteps) -> Iterator[Formula]:
    for part in body.components:
        is_short = part.acceleration == 0 or part.acceleration.is_Symbol
        if body.mass is not None and not is_short:
            label = times(writer.factor(body.mass), writer.cartesian(part.name, 2))
            yield writer.row(label, body.mass * part.acceleration)
        if part.force != 0:
            yield writer.row(writer.force(part.name), part.force)
