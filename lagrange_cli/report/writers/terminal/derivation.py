"""The derivation as a person reads it in a terminal, section by section."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.base import OptionValue, completed
from lagrange_cli.emit.initial_state import multiple_of_pi
from lagrange_cli.mechanics.families.families import families_in
from lagrange_cli.notation.families import FamilyNotation
from lagrange_cli.notation.page import USUAL_WIDTH, Block, Page, Row, page, words
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.notation.scene_language import ScenePrinter
from lagrange_cli.notation.vocabulary import Omission, unabbreviated, vocabulary
from lagrange_cli.report.contents.sentences import certificate_line, omission_told, operations_told
from lagrange_cli.report.document_options import TEXT_OPTIONS, sections_of
from lagrange_cli.report.inlines import Text
from lagrange_cli.report.phrases.language import language
from lagrange_cli.report.writers.terminal.conserved import conserved, energy
from lagrange_cli.report.writers.terminal.constraints import closures, constraint_forces, contacts
from lagrange_cli.report.writers.terminal.energies import energies, forces, inputs, outputs
from lagrange_cli.report.writers.terminal.freedom import account, parameters
from lagrange_cli.report.writers.terminal.motion import accelerations, motion
from lagrange_cli.report.writers.terminal.writer import (
    DEFAULT_PARTS,
    TextWriter,
    heading_row,
    title_row,
)

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.step_values import DerivationSteps


#: Parts of the text, each with what writes one of its sections.
_Parts: TypeAlias = Iterable[tuple[str, Callable[[], Iterable["Row | Block"]]]]


def derivation_text(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    width: int = USUAL_WIDTH,
    **options: OptionValue,
) -> str:
    """Write the derivation in lines of ``width`` columns where formulas allow; see
    :func:`derivation_page`. ``options`` are those of the registry for text."""
    return derivation_page(equations, ascii=ascii, form=form, options=options).text(width)


def derivation_page(
    equations: Equations,
    *,
    ascii: bool = False,
    form: str = "lagrange",
    options: Mapping[str, OptionValue] | None = None,
) -> Page:
    """Write the derivation: degrees of freedom, energies, equations, what is conserved.

    Parameters
    ----------
    equations
        What a derivation yields.
    ascii
        Seven-bit text with formulas in the scene language; else Unicode.
    form
        ``lagrange`` for Lagrange's equations; ``explicit`` for accelerations and
        multipliers where few are coupled, and M q̈ = f where more are; or one of
        :data:`.forms.contents.FORMS`.
    options
        ``sections`` and ``language`` as the registry declares them for text.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    """
    steps = equations.derivation.steps
    chosen = completed("text", TEXT_OPTIONS, options or {})
    is_written = steps is not None or chosen["written_out"]
    families = None if is_written else families_in(equations)
    printer = ScenePrinter() if ascii else UnicodePrinter(lowered=families is not None)
    say = language(str(chosen["language"]))
    say = say.in_ascii() if ascii else say
    omission = None if chosen["written_out"] else Omission(operations_told)
    letters = vocabulary(equations, abbreviating=steps is None, omission=omission)
    over_letters = None if families is None else FamilyNotation(families, letters)
    forces = equations.derivation.constraint_forces is not None
    parts = frozenset(sections_of(chosen, forces=forces))
    writer = TextWriter(equations, letters, printer, over_letters, parts=parts, say=say)
    rows = whole(writer, form) if steps is None else with_steps(writer, form, steps)
    return page(rows, ascii=ascii)


def whole(writer: TextWriter, form: str) -> Iterator[Iterable[Row | Block]]:
    """Return the derivation in short."""
    above: _Parts = (
        ("system", lambda: parameters(writer) if writer.parts != DEFAULT_PARTS else []),
        ("account constraints", partial(account, writer)),
        ("system energies", partial(inputs, writer)),
        ("energies", partial(energies, writer)),
        ("equations", partial(forces, writer)),
        *equations_in(writer, form),
        ("equations constraints", partial(closures, writer)),
        ("equations constraints", partial(contacts, writer)),
    )
    below: _Parts = (
        ("result", lambda: result(writer, form)),
        ("forces", partial(constraint_forces, writer)),
        ("conserved", partial(conserved, writer)),
        ("conserved", partial(energy, writer)),
        ("initial", partial(initial, writer)),
        ("equations", partial(outputs, writer)),
        ("certificate", partial(certificate, writer)),
    )
    return in_order(writer, above, below)


def with_steps(
    writer: TextWriter, form: str, steps: DerivationSteps
) -> Iterator[Iterable[Row | Block]]:
    """Return the derivation line by line."""
    from lagrange_cli.report.contents.steps.board import conclusions, working
    from lagrange_cli.report.contents.steps.writer import StepsWriter
    from lagrange_cli.report.writers.terminal.sections import SectionRows

    board = StepsWriter(writer.equations, steps=steps, omission=writer.words.omission)
    rows = SectionRows(writer.lettering, writer.printer)
    above: _Parts = (
        ("system", partial(parameters, writer)),
        ("account constraints", lambda: account(writer, positions=False)),
        ("system energies", partial(inputs, writer)),
        *rows.each(working(board)),
        *(equations_in(writer, form) if form != "lagrange" else ()),
        ("equations constraints", partial(contacts, writer)),
    )
    below: _Parts = (
        ("result", lambda: result(writer, form) if steps.of_motion else []),
        ("forces", partial(constraint_forces, writer)),
        *rows.each(conclusions(board)),
        ("initial", partial(initial, writer)),
        ("equations", partial(outputs, writer)),
        ("certificate", partial(certificate, writer)),
    )
    return in_order(writer, above, below)


def in_order(writer: TextWriter, above: _Parts, below: _Parts) -> Iterator[Iterable[Row | Block]]:
    """Write the sections that are wanted; what is abbreviated is known when all are written."""
    first, last = list(chosen(writer, above)), list(chosen(writer, below))
    return iter([[title_row(writer)], *first, abbreviations(writer), left_out(writer), *last])


def chosen(writer: TextWriter, sections: _Parts) -> Iterator[Iterable[Row | Block]]:
    """Write the sections that belong to a part that is wanted."""
    for names, write in sections:
        if not writer.parts.isdisjoint(names.split()):
            yield write()


def certificate(writer: TextWriter) -> list[Row]:
    seal, steps = writer.equations.derivation.certificate, writer.equations.derivation.steps
    lines: list[Text] = [certificate_line(seal)]
    if steps is not None:
        from lagrange_cli.report.contents.steps.board import certified_line

        lines.append(certified_line(steps, seal.digits))
    return [Row("", "", writer.prose(line)) for line in lines]


def initial(writer: TextWriter) -> list[Row]:
    """Return positions and velocities at the start, in parameters where the scene writes them so.

    Velocities that are zero are there, too.
    """
    start, written = writer.equations.system.initial, dict(writer.equations.derivation.start)
    if start is None and not written:
        return [Row(writer.say("Initial values"), "   ", words(writer.say("none")), "heading")]
    rows = [heading_row(writer.say("Initial values"))]
    coordinates = writer.equations.system.coordinates
    unknown = [math.nan] * len(coordinates)
    numbers = (unknown, unknown) if start is None else (start.positions, start.velocities)
    for order, values in enumerate(numbers):
        for c, value in zip(coordinates, values, strict=True):
            name = f"  {writer.printer.symbol(c.name, order)}"
            exact = written.get(c.v if order else c.q)
            if exact is None and order == 0:
                exact = multiple_of_pi(value)
            if exact is not None:
                rows.append(writer.formula(name, exact))
            elif not math.isnan(value):
                rows.append(Row(name, f" = {repr(value).removesuffix('.0')}", role="name"))
    return rows


def result(writer: TextWriter, form: str) -> list[Row]:
    """Accelerations, unless they are the equations that are written."""
    if form == "explicit" and "equations" in writer.parts:
        return []
    return accelerations(writer, writer.say("Result"))


def equations_in(writer: TextWriter, form: str) -> _Parts:
    """Return the sections of the equations of motion in a form."""
    if form in ("lagrange", "explicit"):
        yield "equations", partial(accelerations if form == "explicit" else motion, writer)
    elif "equations" in writer.parts:
        from lagrange_cli.report.contents.forms.contents import form_sections
        from lagrange_cli.report.tree import Law
        from lagrange_cli.report.writers.terminal.sections import SectionRows

        rows = SectionRows(writer.lettering, writer.printer, margin=2)
        for whole in form_sections(form, writer.equations, writer.words, writer.noted):
            # Laws are for documents and boards.
            blocks = tuple(b for b in whole.blocks if not isinstance(b, Law))
            yield "equations", partial(rows.section, replace(whole, blocks=blocks))


def left_out(writer: TextWriter) -> list[Row]:
    """Return the note on expressions that were left out."""
    omission = writer.words.omission
    if omission is None or not omission.counts:
        return []
    return [Row("", "", writer.prose(omission_told()))]


def abbreviations(writer: TextWriter) -> list[Row]:
    """Return the definitions of the abbreviations in use, and of those that these use."""
    rows: list[Row] = []
    for name, expression in reversed(writer.equations.presentation.abbreviations):
        if name in writer.abbreviated:
            definition_writer = replace(writer, words=unabbreviated(name, writer.words))
            rows.insert(
                0, definition_writer.formula(f"  {writer.printer.symbol(name)}", expression)
            )
    return [heading_row(writer.say("Abbreviations")), *rows] if rows else []
