"""Documents of a derivation, or of what is found out of its equations, in every format."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

from lagrange_cli.emit.base import OptionValue
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.report.contents.derivation.contents import contents
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.document_options import DEFAULTS, ENDINGS, sections_of, writer_of
from lagrange_cli.report.inlines import Prose
from lagrange_cli.report.phrases.language import Language, language
from lagrange_cli.report.registry import contents_of
from lagrange_cli.report.tree import Document, Section, seen

_STEPS = "steps to the equations of motion"


@dataclass(frozen=True)
class Content:
    """The content of a document: its subject, and a function that writes its sections.

    Attributes
    ----------
    about
        The subject, for a comment at the beginning of a file.
    write
        Writes the sections.
    """

    about: str
    write: Callable[[DocumentWriter], list[Section]]

    def sections(self, writer: DocumentWriter) -> list[Section]:
        """Return the sections of a document."""
        return seen(self.write(writer), "document")


def asked_content(equations: Equations, options: Mapping[str, OptionValue]) -> Content:
    """Return the content of a document of a derivation that options of the registry ask for."""
    parts = sections_of(options, forces=equations.derivation.constraint_forces is not None)
    return derivation_content(equations, parts, str(options["form"]))


def titled(equations: Equations, about: str, sections: Iterable[Section]) -> Document:
    """Return a document about a scene, under the title that the scene gives itself."""
    shown = equations.presentation
    title = Prose(shown.title or shown.name)
    description = Prose(shown.description) if shown.description else ""
    return Document(shown.name, about, title, tuple(sections), description, equations)


def asked_document(
    equations: Equations, options: Mapping[str, OptionValue], content: Content | None
) -> tuple[Document, Language]:
    """Return a document that options of the registry ask for, and the language of its words.

    ``content`` is by default that of the derivation.
    """
    content = content or asked_content(equations, options)
    writer = DocumentWriter(equations, written_out=bool(options["written_out"]))
    document = titled(equations, content.about, content.sections(writer))
    return document, language(str(options["language"]))


@contents_of.register
def derivation_document(equations: Equations) -> Document:
    """Return the parts of a derivation that a document has by default."""
    return asked_document(equations, DEFAULTS, None)[0]


def written_document(
    to: str,
    equations: Equations,
    options: Mapping[str, OptionValue],
    content: Content | None = None,
) -> dict[str, str]:
    """Return the name of a file → a document in a format.

    Parameters
    ----------
    to
        The format.
    equations
        What a derivation yields; its steps are written if it has any.
    options
        Those of the registry.
    content
        What is written; by default the derivation.

    Raises
    ------
    InternalError
        An expression has no exact form in print.
    InputError
        Constraint forces are asked for and were not derived, or the system cannot be drawn.
    """
    if to == "latex":
        files: dict[str, str] = writer_of(to, "emit")(equations, options, content)
        return files
    document, say = asked_document(equations, options, content)
    return {f"{document.name}{ENDINGS[to]}": writer_of(to, "report")(document, say)}


def derivation_content(equations: Equations, parts: Collection[str], form: str) -> Content:
    """Return the content of a document of a derivation; see :func:`contents`."""
    about = "equations of motion" if equations.derivation.steps is None else _STEPS
    return Content(about, lambda writer: contents(writer, parts, form))
