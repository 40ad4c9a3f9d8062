"""The parts of a report of a derivation, their order, and what a terminal prints of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.base import OptionValue, completed
from lagrange_cli.emit.initial_state import multiple_of_pi
from lagrange_cli.notation.labels import multiplier_label
from lagrange_cli.notation.page import USUAL_WIDTH, Page, page
from lagrange_cli.notation.printers.one_line import OneLinePrinter
from lagrange_cli.notation.printers.scene import ScenePrinter
from lagrange_cli.notation.printers.unicode import UnicodePrinter
from lagrange_cli.report.contents.derivation.conservation import balance, conserved
from lagrange_cli.report.contents.derivation.energies import energies, generalized_forces
from lagrange_cli.report.contents.derivation.freedom import freedom
from lagrange_cli.report.contents.derivation.motion import (
    closures,
    contacts,
    controllers,
    motion,
    result,
    states,
)
from lagrange_cli.report.contents.derivation.system import inputs, outputs, system, tables
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.contents.forces import force_notes, force_rows, forces_line, reaction_rows
from lagrange_cli.report.contents.forms.contents import FORMS, form_sections
from lagrange_cli.report.contents.sentences import certificate_line
from lagrange_cli.report.contents.steps.writer import StepsWriter
from lagrange_cli.report.document_options import (
    DEFAULT_SECTIONS,
    TEXT_OPTIONS,
    sections_of,
)
from lagrange_cli.report.inlines import (
    Inline,
    Lettering,
    Text,
    magnitude,
    named,
    opened,
    rounded,
    say,
    symbol,
    value,
)
from lagrange_cli.report.phrases.language import language
from lagrange_cli.report.tree import (
    Block,
    Formula,
    Paragraph,
    Picture,
    Section,
    formulas,
    section,
    seen,
)
from lagrange_cli.report.writers.terminal.letters import AsciiLetters, UnicodeLetters
from lagrange_cli.report.writers.terminal.sections import TerseRows, title_row

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.findings import ConstraintForces


def start(writer: DocumentWriter) -> Section | None:
    """Return positions and velocities at the start."""
    equations = writer.equations
    if not equations.system.coordinates:
        return None
    heading = say("Initial values")
    initial, exact = equations.system.initial, dict(equations.derivation.start)
    if initial is None and not exact:
        return section(heading, Paragraph(say("The scene gives none.")))
    unknown = (math.nan,) * len(equations.system.coordinates)
    positions = unknown if initial is None else initial.positions
    velocities = unknown if initial is None else initial.velocities
    time = Inline("t = " + value(equations.system.simulate.start))
    return section(
        heading,
        Paragraph(say("At {time}", time=time), only="document"),
        formulas(_start_rows(writer, 0, positions)),
        formulas(_start_rows(writer, 1, velocities), only=None if any(velocities) else "terminal"),
        None if any(velocities) else Paragraph(say("at rest."), only="document"),
        formulas(_state_rows(writer)),
    )


def _start_rows(writer: DocumentWriter, order: int, values: Sequence[float]) -> Iterator[Formula]:
    for c, number in zip(writer.equations.system.coordinates, values, strict=True):
        label = writer.coordinate(c, order)
        exact = dict(writer.equations.derivation.start).get(c.v if order else c.q)
        if exact is None and order == 0:
            exact = multiple_of_pi(number)
        if exact is not None:
            yield writer.row(label, exact)
        elif not math.isnan(number):
            yield Formula(label, (), middle=value(number))


def _state_rows(writer: DocumentWriter) -> list[Formula]:
    """Return the states of first order at the start."""
    initial, states = writer.equations.system.initial, writer.equations.system.states
    if initial is None:
        return []
    return [
        Formula(symbol(s.name, 0, s.latex), (), middle=value(number))
        for s, number in zip(states, initial.states, strict=True)
    ]


def constraint_forces(writer: DocumentWriter) -> Section | None:
    """Return the forces on the particles; None where they were not asked for."""
    forces = writer.equations.derivation.constraint_forces
    if forces is None:
        return None
    rows = list(_force_rows(writer, forces))
    is_empty = not (rows or forces.shared)
    meaning = say("There are none.") if is_empty else opened(say("{text}.", text=forces_line()))
    return section(
        say("Constraint forces"),
        Paragraph(meaning, only="document"),
        *([formulas(rows, result=True)] if rows else ()),
        *(Paragraph(opened(say("{text}.", text=note))) for note in force_notes(forces)),
        lead=(say("none") if is_empty else forces_line(),),
    )


def _force_rows(writer: DocumentWriter, forces: ConstraintForces) -> Iterator[Formula]:
    for body, components in force_rows(forces):
        for label, expression in components:
            letter = magnitude(symbol("f")) if label == "|f|" else symbol(label)
            yield replace(writer.row(letter, expression), name=named(body))
    for name, multiplier, sizes in reaction_rows(writer.equations, forces):
        shown = named(name)
        if multiplier is not None:
            letter = symbol(multiplier_label(writer.equations, name))
            yield replace(writer.row(letter, multiplier), name=shown)
        for bodies, size in sizes:
            on = named(say("force on {place}", place=bodies))
            yield replace(writer.row(on, size), name=shown)


def certificate(writer: DocumentWriter) -> Section | None:
    """Return the section on the certificate: states compared, digits, largest mismatch."""
    seal = writer.equations.derivation.certificate
    sentence = say.counted(
        seal.points,
        "At {count} random state these equations were compared, in arithmetic of {digits} digits,"
        " with Lagrange's equations evaluated from {lagrangian} itself; the largest relative"
        " mismatch was {mismatch}.",
        "At {count} random states these equations were compared, in arithmetic of {digits} digits,"
        " with Lagrange's equations evaluated from {lagrangian} itself; the largest relative"
        " mismatch was {mismatch}.",
        digits=seal.digits,
        lagrangian=Inline(writer.labels["L"]),
        mismatch=Inline(rounded(seal.mismatch)),
    )
    return section(
        say("Certificate"),
        Paragraph(sentence, only="document"),
        _steps(writer),
        *(Paragraph(line, only="terminal") for line in _certified(writer)),
        terse=None,
    )


def _certified(writer: DocumentWriter) -> Iterator[Text]:
    """Yield the certificate in a line, and that of the steps."""
    seal, steps = writer.equations.derivation.certificate, writer.equations.derivation.steps
    yield certificate_line(seal)
    if steps is not None:
        from lagrange_cli.report.contents.steps.board import certified_line

        yield certified_line(steps, seal.digits)


def _steps(writer: DocumentWriter) -> Paragraph | None:
    steps = writer.equations.derivation.steps
    if steps is None:
        return None
    return Paragraph(
        say(
            "Every line of the steps was compared at {count} of these states with automatic"
            " differentiation: the largest mismatch was {mismatch}.",
            count=steps.states,
            mismatch=Inline(rounded(steps.mismatch)),
        ),
        only="document",
    )


def contents(writer: DocumentWriter, parts: Collection[str], form: str) -> list[Section]:
    """Return the sections of a document in their order, each named by the part that it belongs to.

    ``parts``: names of :data:`.document_options.SECTIONS`; steps are written where there are some.
    """
    if "equations" in parts:
        writer.equations.derivation.textbook()  # refuses what is too long before all else is made
    steps = writer.equations.derivation.steps
    writer = replace(writer, form=form)
    if steps is None:
        above, below = _above(writer, parts, form), _below(writer, parts, form)
    else:
        board = StepsWriter(writer.equations, steps=steps, omission=writer.omission)
        above = _above_with_steps(writer, board, parts, form)
        below = _below_with_steps(writer, board, parts, form)
    first, last = list(_chosen(above, parts)), list(_chosen(below, parts))
    # What is abbreviated and what is left out is known when all else is written.
    rows, note = writer.abbreviations(), writer.left_out()
    below_all: list[Block] = []
    if rows:
        below_all += [Paragraph(say("Here"), only="document"), formulas(rows, only="document")]
    if note is not None:
        below_all.append(replace(note, only="document"))
    whole = first or last
    if below_all and whole:
        whole[-1] = replace(whole[-1], blocks=(*whole[-1].blocks, *below_all))
    between = section(say("Abbreviations"), formulas(rows, only="terminal"))
    hint = None if note is None else section("", replace(note, only="terminal"), terse=None)
    return [*first, *(s for s in (between, hint) if s is not None), *last]


_Parts: TypeAlias = Iterable[tuple[str, Callable[[], Section | None]]]


def _chosen(sections: _Parts, parts: Collection[str]) -> Iterator[Section]:
    """Return the sections that belong to a part that is wanted, and hold anything."""
    for names, write in sections:
        wanted = [name for name in names.split() if name in parts]
        written = write() if wanted else None
        if written is not None:
            yield replace(written, name=wanted[0])


def _above(writer: DocumentWriter, parts: Collection[str], form: str) -> _Parts:
    return (
        ("system", lambda: system(writer)),
        ("sketch", lambda: _sketch(writer)),
        ("account constraints", lambda: freedom(writer, parts)),
        ("system energies", lambda: inputs(writer)),
        ("system energies", lambda: tables(writer)),
        ("energies", lambda: energies(writer)),
        ("equations", lambda: generalized_forces(writer)),
        *_motion(writer, parts, form),
        ("equations", lambda: None if form == "first-order" else states(writer)),
        ("equations", lambda: controllers(writer)),
        ("equations constraints", lambda: closures(writer)),
        ("equations constraints", lambda: contacts(writer)),
    )


def _motion(writer: DocumentWriter, parts: Collection[str], form: str) -> _Parts:
    """Return the equations of motion in a form."""
    if form not in FORMS or "equations" not in parts:
        yield "equations", lambda: motion(writer, form)
        return
    for written in form_sections(form, writer.equations, writer.words, writer.noted):
        yield "equations", partial(replace, written, margin=2)


def _on_board(sections: _Parts) -> _Parts:
    """Return sections whose formulas a terminal aligns at their signs."""
    for names, write in sections:
        yield names, partial(_aligned, write)


def _aligned(write: Callable[[], Section | None]) -> Section | None:
    written = write()
    return None if written is None else replace(written, margin=4)


def _below(writer: DocumentWriter, parts: Collection[str], form: str) -> _Parts:
    return (
        ("result", lambda: None if "equations" in parts and form == "explicit" else result(writer)),
        ("forces", lambda: constraint_forces(writer)),
        ("conserved", lambda: conserved(writer)),
        ("conserved", lambda: balance(writer)),
        *_ending(writer),
    )


def _ending(writer: DocumentWriter) -> _Parts:
    return (
        ("initial", lambda: start(writer)),
        ("equations", lambda: outputs(writer)),
        ("certificate", lambda: certificate(writer)),
    )


def _above_with_steps(
    writer: DocumentWriter, board: StepsWriter, parts: Collection[str], form: str
) -> _Parts:
    """Return the derivation line by line."""
    from lagrange_cli.report.contents.steps.board import working

    return (
        ("system", lambda: system(writer)),
        ("sketch", lambda: _sketch(writer)),
        ("account constraints", lambda: freedom(writer, parts, positions=False)),
        ("system energies", lambda: inputs(writer)),
        ("system energies", lambda: tables(writer)),
        *_on_board(working(board)),
        *(_motion(writer, parts, form) if form != "lagrange" else ()),
        ("equations", lambda: states(writer)),
        ("equations", lambda: controllers(writer)),
        ("equations constraints", lambda: contacts(writer)),
    )


def _below_with_steps(
    writer: DocumentWriter, board: StepsWriter, parts: Collection[str], form: str
) -> _Parts:
    has_result = board.steps.of_motion and not ("equations" in parts and form == "explicit")
    from lagrange_cli.report.contents.steps.board import conclusions

    return (
        ("result", lambda: result(writer) if has_result else None),
        ("forces", lambda: constraint_forces(writer)),
        *_on_board(conclusions(board)),
        *_ending(writer),
    )


def _sketch(writer: DocumentWriter) -> Section | None:
    return section(say("Sketch"), Picture())


# In a terminal.


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
        ``lagrange`` for Lagrange's equations; ``euler`` for Euler's of one body; ``explicit`` for
        accelerations and multipliers where few are coupled, and rows of M q̈ = f where more are;
        or one of :data:`.forms.contents.FORMS`.
    options
        ``sections`` and ``language`` as the registry declares them for text.

    Raises
    ------
    InputError
        The equations have no such form.
    InternalError
        An expression has no exact form in print.
    """
    chosen = completed("text", TEXT_OPTIONS, options or {})
    say = language(str(chosen["language"]))
    written_out = bool(chosen["written_out"])
    writer = DocumentWriter(equations, written_out=written_out, read_back=ascii)
    # The scene has the parameters; they are shown with steps, and where they are asked for.
    asked = sections_of(chosen, forces=equations.derivation.constraint_forces is not None)
    is_usual = chosen["sections"] == DEFAULT_SECTIONS and equations.derivation.steps is None
    parts = [part for part in asked if not (is_usual and part == "system")]
    lettering = Lettering(AsciiLetters(), say.in_ascii())
    printer: OneLinePrinter = ScenePrinter()
    if not ascii:
        is_lowered = writer.families is not None
        lettering = Lettering(UnicodeLetters(lowered=is_lowered), say)
        printer = UnicodePrinter(lowered=is_lowered)
    rows = TerseRows(lettering, printer)
    sections = seen(contents(writer, parts, form), "terminal")
    return page([[title_row(equations, ascii=ascii)], *map(rows.section, sections)], ascii=ascii)
