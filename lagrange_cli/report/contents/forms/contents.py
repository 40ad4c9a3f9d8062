"""The forms of equations that stand in place of Lagrange's, and what writes each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from lagrange_cli.mechanics.dynamics.accelerations import differentiated, explicit_form
from lagrange_cli.notation.build import display_row
from lagrange_cli.notation.labels import free_letter
from lagrange_cli.notation.ordering import symbol_of
from lagrange_cli.notation.tree import Dependence, DisplayNode
from lagrange_cli.report.contents.forms.hamiltonian import hamiltonian_sections
from lagrange_cli.report.contents.forms.routhian import routhian_sections
from lagrange_cli.report.contents.forms.small_oscillations import small_oscillation_sections
from lagrange_cli.report.contents.forms.writer import FormWriter
from lagrange_cli.report.contents.sentences import explicit_line
from lagrange_cli.report.inlines import say, symbol
from lagrange_cli.report.tree import Formula, Paragraph, Section, formulas

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate
    from lagrange_cli.notation.vocabulary import Vocabulary


def first_order_sections(writer: FormWriter) -> list[Section]:
    """Return the section in place of Lagrange's equations."""
    equations = writer.equations
    heading = say("Equations of first order")
    if not equations.system.coordinates:
        return [Section(heading, (Paragraph(say("There are none.")),))]
    letter = velocity_letter(equations)
    writer = replace(writer, vocabulary=with_velocities(writer.words, equations, letter))
    solved = explicit_form(equations)
    pairs = list(zip(equations.system.coordinates, solved.accelerations, strict=True))
    rates = [writer.row(writer.coordinate(c, 1), c.v) for c in equations.system.coordinates]
    rates += [writer.row(writer.formula(c.a), value) for c, value in pairs if value is not None]
    rates += [writer.row(symbol(s.name, 1, s.latex), s.rate) for s in equations.system.states]
    rates += [
        writer.row(writer.formula(closure.multiplier), value)
        for closure, value in zip(equations.system.closures, solved.multipliers, strict=True)
        if value is not None
    ]
    open_rows = [
        Formula("", (writer.noted(display_row(shown, writer.words)),), name=writer.coordinate(c))
        for (c, value), shown in zip(pairs, equations.derivation.shown, strict=True)
        if value is None
    ]
    open_rows += [
        Formula("", (writer.noted(display_row(differentiated(equations, closure), writer.words)),))
        for closure, value in zip(equations.system.closures, solved.multipliers, strict=True)
        if value is None
    ]
    sentence = say("{text}.", text=explicit_line(equations, solved))
    rows = [formulas(part, result=True) for part in (rates, open_rows) if part]
    return [Section(heading, (*rows, Paragraph(sentence)))]


def velocity_letter(equations: Equations) -> str:
    """Return the first letter that makes names of velocities which the scene does not have."""
    return free_letter(equations, ("v", "w", "V", "u", "vv"))


def with_velocities(words: Vocabulary, equations: Equations, letter: str) -> Vocabulary:
    """Return the vocabulary in which velocities print as ``v_theta``, accelerations as its rate."""
    atoms = dict(words.atoms)
    for rank, c in enumerate(equations.system.coordinates):
        name, latex = f"{letter}_{c.name}", _latex(letter, c)
        atoms[c.v] = symbol_of(name, Dependence.VELOCITY, rank, latex=latex)
        atoms[c.a] = symbol_of(name, Dependence.ACCELERATION, rank, order=1, latex=latex)
    return replace(words, atoms=atoms)


def _latex(letter: str, coordinate: Coordinate) -> str | None:
    return None if coordinate.latex is None else f"{letter}_{{{coordinate.latex}}}"


#: Name of a form → its sections.
FORMS: Mapping[str, Callable[[FormWriter], list[Section]]] = {
    "first-order": first_order_sections,
    "hamiltonian": hamiltonian_sections,
    "routhian": routhian_sections,
    "small-oscillations": small_oscillation_sections,
}


def form_sections(
    form: str,
    equations: Equations,
    words: Vocabulary,
    noted: Callable[[DisplayNode], DisplayNode],
) -> list[Section]:
    """Return the sections of a form of :data:`FORMS`.

    Parameters
    ----------
    form
        Its name.
    equations
        The equations.
    words
        Display names of the symbols of the equations.
    noted
        Takes note of the abbreviations in a tree, and returns it.

    Raises
    ------
    InputError
        Located: the equations have no such form.
    """
    return FORMS[form](FormWriter(equations, vocabulary=words, noted=noted))
