"""Documents of a derivation, or of what is found out of its equations, in every format."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass

from lagrange_cli.emit.base import OptionValue
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.report.contents.derivation.contents import contents
from lagrange_cli.report.contents.derivation.exercises import (
    exercise,
    exercise_parts,
    problem_statement,
)
from lagrange_cli.report.contents.derivation.writer import DocumentWriter
from lagrange_cli.report.document_options import (
    DEFAULTS,
    DOCUMENTS,
    ENDINGS,
    EXERCISES,
    sections_of,
    writer_of,
)
from lagrange_cli.report.inlines import Prose, Text, say
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
    titled
        Makes the title of the document of that of the scene.
    draws
        True if the document holds the sketch of the system.
    described
        Makes the document's description of that of the scene.
    """

    about: str
    write: Callable[[DocumentWriter], list[Section]]
    titled: Callable[[Text], Text] = lambda title: title
    draws: bool = False
    described: Callable[[str], str] = lambda description: description

    def sections(self, writer: DocumentWriter) -> list[Section]:
        """Return the sections of a document."""
        return seen(self.write(writer), "document")


def asked_content(to: str, equations: Equations, options: Mapping[str, OptionValue]) -> Content:
    """Return the content of a document of a derivation that options of a format ask for."""
    style, form = str(options["style"]), str(options["form"])
    if style in EXERCISES:
        parts = exercise_parts(equations, options, draws=DOCUMENTS[to].draws)
        draws = "sketch" in parts
        if style == "exercise":
            return Content(
                "an exercise",
                lambda writer: exercise(writer, parts, form),
                lambda title: say("Exercise: {title}", title=title),
                draws,
                problem_statement,
            )
        return Content(
            "solution of an exercise",
            lambda writer: contents(writer, parts, form),
            lambda title: say("Solution: {title}", title=title),
            draws,
            lambda description: "",  # the problem has it
        )
    parts = sections_of(options, forces=equations.derivation.constraint_forces is not None)
    return derivation_content(equations, parts, form)


def titled(
    equations: Equations, content: Content | None = None, sections: Iterable[Section] = ()
) -> Document:
    """Return a document about a scene, under the title that the scene gives itself."""
    shown = equations.presentation
    title: Text = Prose(shown.title or shown.name)
    title, about = (title, "") if content is None else (content.titled(title), content.about)
    described = shown.description or ""
    if content is not None:
        described = content.described(described)
    description = Prose(described) if described else ""
    return Document(shown.name, about, title, tuple(sections), description, equations)


def asked_document(
    to: str, equations: Equations, options: Mapping[str, OptionValue], content: Content | None
) -> tuple[Document, Language]:
    """Return a document that options of a format ask for, and the language of its words.

    ``content`` is by default that of the derivation.
    """
    content = content or asked_content(to, equations, options)
    writer = DocumentWriter(equations, written_out=bool(options["written_out"]))
    document = titled(equations, content, content.sections(writer))
    return document, language(str(options["language"]))


@contents_of.register
def derivation_document(equations: Equations) -> Document:
    """Return the parts of a derivation that a document has by default."""
    return asked_document("html", equations, DEFAULTS, None)[0]


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
    document, language_of_words = asked_document(to, equations, options, content)
    text = writer_of(to, "report")(document, language_of_words)
    return {f"{document.name}{ENDINGS[to]}": text}


def derivation_content(equations: Equations, parts: Collection[str], form: str) -> Content:
    """Return the content of a document of a derivation; see :func:`contents`."""
    about = "equations of motion" if equations.derivation.steps is None else _STEPS
    return Content(about, lambda writer: contents(writer, parts, form))
