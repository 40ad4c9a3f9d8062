"""The forms of equations that stand in place of Lagrange's, and what writes each."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.emit.forms.first_order import first_order_sections
from lagrange_cli.emit.forms.hamiltonian import hamiltonian_sections
from lagrange_cli.emit.forms.routhian import routhian_sections
from lagrange_cli.emit.forms.small_oscillations import small_oscillation_sections
from lagrange_cli.emit.forms.writer import FormWriter
from lagrange_cli.notation.tree import DisplayNode

if TYPE_CHECKING:
    from lagrange_cli.emit.steps.sections import Section
    from lagrange_cli.emit.steps.writer import Writer
    from lagrange_cli.notation.vocabulary import Vocabulary

#: Name of a form → its sections.
FORMS: Mapping[str, Callable[[FormWriter], list[Section]]] = {
    "first-order": first_order_sections,
    "hamiltonian": hamiltonian_sections,
    "routhian": routhian_sections,
    "small-oscillations": small_oscillation_sections,
}


def form_sections(
    form: str, writer: Writer, words: Vocabulary, noted: Callable[[DisplayNode], DisplayNode]
) -> list[Section]:
    """The sections of a form of :data:`FORMS`.

    Parameters
    ----------
    writer
        Equations, letters and language.
    words
        Display names of the symbols of the equations.
    noted
        Takes note of the abbreviations in a tree, and returns it.

    Raises
    ------
    InputError
        Located: the equations have no such form.
    """
    whole = FormWriter(writer.equations, writer.letters, writer.say, vocabulary=words, noted=noted)
    return FORMS[form](whole)
