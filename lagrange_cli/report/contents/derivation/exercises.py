"""An exercise: what a problem gives and what it asks for, of which steps are the solution."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

from lagrange_cli.emit.base import OptionValue
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.step_values import DerivationSteps, ForceSteps, TermSteps
from lagrange_cli.pictures.sketch.svg import emit_svg
from lagrange_cli.report.contents.derivation.freedom import stated
from lagrange_cli.report.contents.derivation.system import inputs, system, tables
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.steps.energies import dissipation
from lagrange_cli.report.contents.steps.writer import StepsWriter
from lagrange_cli.report.document_options import DEFAULT_SECTIONS, sections_of
from lagrange_cli.report.inlines import (
    Inline,
    Label,
    Plain,
    Written,
    below,
    named,
    say,
    symbol,
)
from lagrange_cli.report.tree import (
    Bullets,
    Part,
    Picture,
    Section,
    Title,
    formulas,
    section,
    sections,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Parts of a document that the solution of an exercise leaves to the problem, or out.
_UNSOLVED = ("system", "certificate")


def exercise_parts(
    equations: Equations, options: Mapping[str, OptionValue], *, draws: bool
) -> tuple[str, ...]:
    """Return the parts of a document that an exercise asks for, or that its solution holds.

    ``draws``: true if the format holds a sketch, which a problem has where there is one.

    Raises
    ------
    InputError
        Steps were not derived, or constraint forces that are asked for. The problem of a system
        with rigid bodies needs none.
    """
    derivation = equations.derivation
    has_bodies = any(element.turning is not None for element in equations.system.particles)
    if derivation.steps is None and not (has_bodies and options["style"] == "exercise"):
        hint = "derive(steps='lagrange')"
        raise InputError(Problem("steps were not derived", hint=hint, rule="usage"))
    parts = sections_of(options, forces=derivation.constraint_forces is not None)
    if options["sections"] != DEFAULT_SECTIONS:
        return parts
    if options["style"] == "solution":
        return tuple(part for part in parts if part not in _UNSOLVED)
    return (*parts, "sketch") if draws and _is_drawable(equations) else parts


def _is_drawable(equations: Equations) -> bool:
    try:
        emit_svg(equations, {})
    except InputError:
        return False
    return True


#: Ends of sentences, of which an initial before a name is none.
_SENTENCE_END = re.compile(r"(?<=[.!?])(?<!\b[A-Z]\.)\s+(?=[A-Z])")

#: A formula in prose, or a word for what the equations have as a result.
_RESULT = re.compile(
    r"[=^<>]|\b(?:sqrt|sin|cos|tan)\b|\d\s*/\s*\d|[\w)]/[\w(]|\b(?:conserved|cyclic|integrable)\b"
)


def problem_statement(description: str) -> str:
    """Return what a description says of the problem, without sentences that give results away.

    Of several paragraphs it is the first, as it is. Of one it is the first sentence, and those of
    the others that hold no formula and name nothing as conserved, cyclic or integrable.

    Examples
    --------
    >>> problem_statement("A mass falls. It falls with g/2. W. Weber, Physics (1846).")
    'A mass falls. W. Weber, Physics (1846).'
    """
    first, *further = re.split(r"\n\s*\n?", description.strip())
    if further:
        return first
    sentence, *others = _SENTENCE_END.split(first)
    return " ".join([sentence, *(text for text in others if not _RESULT.search(text))])


def exercise(writer: DocumentWriter, parts: Collection[str], form: str) -> list[Section]:
    """Return the problem: the sketch, the system as the scene states it, and what is asked."""
    return list(
        sections(
            section("", Picture()) if "sketch" in parts else None,
            system(writer),
            stated(writer),
            inputs(writer),
            tables(writer),
            *_applied(writer),
            section(say("Tasks"), Bullets(tuple(_tasks(writer, parts, form)), counted=True)),
        )
    )


def _applied(writer: DocumentWriter) -> Iterator[Section | None]:
    """Yield energies and forces over the names that the scene writes them in."""
    steps = writer.equations.derivation.steps or _stated_terms(writer.equations)
    board = StepsWriter(writer.equations, steps=steps, omission=writer.omission)
    rows = [
        *(
            board.row(named(say("kinetic energy {name}", name=term.name)), term.written)
            for term in steps.kinetic
        ),
        *(
            board.row(named(say("potential {name}", name=term.name)), term.written)
            for term in steps.potentials
        ),
    ]
    blocks: list[Part] = [formulas(rows)]
    for force in steps.forces:
        name = Plain(force.name)
        is_coordinate = any(force.on == c.name for c in writer.equations.system.coordinates)
        on = Inline(board.cartesian(force.on)) if is_coordinate else Plain(force.on)
        torque = say("The torque {name} on {place}:", name=name, place=on)
        pull = say("The force {name} on {place}:", name=name, place=on)
        blocks.append(Title(torque if force.is_torque else pull))
        label = partial(_torque_along, board) if force.is_torque else board.force
        rows = [board.row(label(along), value) for along, value in force.components]
        blocks.append(formulas(rows))
    yield section(say("Energies and forces"), *blocks)
    yield dissipation(board)


def _torque_along(board: StepsWriter, axis: str) -> Label:
    """Return the letter of torques with an axis; in a plane there is none."""
    return below(board.torque_letter, symbol(axis)) if axis else symbol(board.torque_letter)


def _stated_terms(equations: Equations) -> DerivationSteps:
    """Return potentials and forces as the scene states them, of a system without steps."""
    depiction, system = equations.presentation.depiction, equations.system
    potentials = () if depiction is None else depiction.potentials
    places = {particle.name: particle.components for particle in system.particles}
    forces = []
    for force in system.forces:
        along: tuple[str, ...] = (force.on,)
        if len(force.components) == 3:
            on_point = tuple(f"{axis}_{force.on}" for axis in "xyz")
            along = tuple("xyz") if force.is_torque else places.get(force.on, on_point)
        shown = zip(along, force.components, strict=True)
        components = tuple((name, value) for name, value in shown if value != 0)
        forces.append(ForceSteps(force.name, force.on, components, (), force.is_torque))
    return DerivationSteps(
        way="lagrange",
        bodies=(),
        kinetic=(),
        potentials=tuple(TermSteps(name, written, written) for name, written in potentials),
        forces=tuple(forces),
        coordinates=(),
        balances=(),
        in_coordinates=(),
    )


#: Form of the equations → the task of bringing them into it.
_FORMS = {
    "euler": say("Write Euler's equations along the axes of the body."),
    "explicit": say("Solve them for the accelerations."),
    "first-order": say("Write them as equations of first order."),
    "hamiltonian": say("Find the Hamiltonian and the canonical equations."),
    "routhian": say("Eliminate the cyclic coordinates with Routh's function."),
    "small-oscillations": say("Find the small oscillations about equilibrium."),
}

_WAYS = {
    "lagrange": say("Derive the equations of motion by Lagrange's equations."),
    "dalembert": say("Derive the equations of motion by d'Alembert's principle."),
    "virtual-work": say("Find the equilibria by the principle of virtual work."),
}


def _tasks(writer: DocumentWriter, parts: Collection[str], form: str) -> Iterator[Written]:
    """Yield a task for each part of the document that is asked for."""
    derivation = writer.equations.derivation
    steps = derivation.steps
    if "account" in parts:
        yield say("Count the degrees of freedom.")
        if derivation.account.chosen_automatically:
            yield say("Choose generalized coordinates.")
    if "energies" in parts:
        yield say("Write the kinetic energy, the potential and the Lagrangian.")
    if "equations" in parts:
        yield _WAYS["lagrange" if steps is None else steps.way]
        if form in _FORMS:
            yield _FORMS[form]
    if "result" in parts and form != "explicit":
        yield _FORMS["explicit"]
    if "forces" in parts and derivation.constraint_forces is not None:
        yield say("Find the constraint forces.")
    if "conserved" in parts and (steps is None or steps.of_motion):
        yield say("Name the cyclic coordinates and what is conserved, each with its reason.")
