"""The parts of a document: their names, their order, and which stand in it by default."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.document.certificate import certificate
from lagrange_cli.emit.document.conservation import balance, conserved
from lagrange_cli.emit.document.energies import energies, generalized_forces
from lagrange_cli.emit.document.freedom import freedom
from lagrange_cli.emit.document.motion import closures, contacts, motion, result
from lagrange_cli.emit.document.reactions import constraint_forces
from lagrange_cli.emit.document.start import start
from lagrange_cli.emit.document.system import inputs, outputs, system
from lagrange_cli.emit.document.writer import DocumentWriter
from lagrange_cli.emit.document_options import sections_of
from lagrange_cli.emit.forms.contents import FORMS, form_sections
from lagrange_cli.emit.steps.board import conclusions, working
from lagrange_cli.emit.steps.sections import Block, Picture, Section, Words, formulas, section
from lagrange_cli.emit.steps.writer import StepsWriter

if TYPE_CHECKING:
    from lagrange_cli.emit.base import OptionValue
    from lagrange_cli.mechanics.equations import Equations

_STEPS = "steps to the equations of motion"


@dataclass(frozen=True)
class Content:
    """What a document holds.

    Attributes
    ----------
    about
        The subject, for a comment at the beginning of a file.
    sections
        Writes the sections for lines of so many columns of half an em.
    """

    about: str
    sections: Callable[[DocumentWriter, float], list[Section]]


def asked_content(equations: Equations, options: Mapping[str, OptionValue]) -> Content:
    """The content of a document of a derivation that options of the registry ask for."""
    parts = sections_of(options, forces=equations.constraint_forces is not None)
    return derivation_content(equations, parts, str(options["form"]))


def derivation_content(equations: Equations, parts: Collection[str], form: str) -> Content:
    """The content of a document of a derivation; see :func:`contents`."""
    about = "equations of motion" if equations.steps is None else _STEPS
    return Content(about, lambda writer, _columns: contents(writer, parts, form))


def contents(writer: DocumentWriter, parts: Collection[str], form: str) -> list[Section]:
    """The sections of a document in their order, each named by the part that it belongs to.

    ``parts``: names of :data:`.document_options.SECTIONS`; steps are written where there are some.
    """
    steps = writer.equations.steps
    if steps is None:
        above, below = _above(writer, parts, form), _below(writer, parts, form)
    else:
        board = StepsWriter(
            writer.equations, writer.letters, writer.say, steps=steps, omission=writer.omission
        )
        above = _above_with_steps(writer, board, parts, form)
        below = _below_with_steps(writer, board, parts, form)
    first, last = list(_chosen(above, parts)), list(_chosen(below, parts))
    # What is abbreviated and what is left out is known when all else is written.
    rows = writer.abbreviations()
    below_all: list[Block] = [Words(writer.say("Here")), formulas(rows)] if rows else []
    told = writer.left_out()
    below_all += [] if told is None else [told]
    whole = first or last
    if below_all and whole:
        whole[-1] = replace(whole[-1], blocks=(*whole[-1].blocks, *below_all))
    return [*first, *last]


_Parts: TypeAlias = Iterable[tuple[str, Callable[[], Section | None]]]


def _chosen(sections: _Parts, parts: Collection[str]) -> Iterator[Section]:
    """The sections that belong to a part that is wanted, and hold anything."""
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
        ("system", lambda: inputs(writer)),
        ("energies", lambda: energies(writer)),
        ("equations", lambda: generalized_forces(writer)),
        *_motion(writer, parts, form),
        ("equations constraints", lambda: closures(writer)),
        ("equations constraints", lambda: contacts(writer)),
    )


def _motion(writer: DocumentWriter, parts: Collection[str], form: str) -> _Parts:
    """The equations of motion in a form."""
    if form not in FORMS or "equations" not in parts:
        yield "equations", lambda: motion(writer, form)
        return
    for written in form_sections(form, writer, writer.words, writer.noted):
        yield "equations", partial(_same, written)


def _same(written: Section) -> Section:
    return written


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
    """The derivation line by line."""
    return (
        ("system", lambda: system(writer)),
        ("sketch", lambda: _sketch(writer)),
        ("account constraints", lambda: freedom(writer, parts, positions=False)),
        ("system", lambda: inputs(writer)),
        *working(board),
        *(_motion(writer, parts, form) if form != "lagrange" else ()),
        ("equations constraints", lambda: contacts(writer)),
    )


def _below_with_steps(
    writer: DocumentWriter, board: StepsWriter, parts: Collection[str], form: str
) -> _Parts:
    return (
        ("result", lambda: None if "equations" in parts and form == "explicit" else result(writer)),
        ("forces", lambda: constraint_forces(writer)),
        *conclusions(board),
        *_ending(writer),
    )


def _sketch(writer: DocumentWriter) -> Section | None:
    return section(writer.say("Sketch"), Picture())
