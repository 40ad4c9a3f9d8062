"""Options of documents: their parts, the width of their lines, their language."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from typing import Any, Literal

from lagrange_cli.emit.base import Option, OptionValue
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of
from lagrange_cli.report.phrases.language import LANGUAGES

#: Equilibria and modes that are listed; JSON has all.
MOST_LISTED = 16

#: Points of a unit of length, as LaTeX has them.
_POINTS = {"pt": 1.0, "mm": 72.27 / 25.4, "cm": 72.27 / 2.54, "in": 72.27}

#: The shortest and the longest line that formulas are broken for, in points.
_LEAST, _MOST = 100.0, 4000.0

_LENGTH = re.compile(r"(\d+(?:\.\d*)?|\.\d+) ?(pt|mm|cm|in)", re.ASCII)


def is_width(text: str) -> bool:
    """Say whether a text is ``page``, ``column`` or a length that a line may have."""
    if text in ("page", "column"):
        return True
    points = length(text)
    return points is not None and _LEAST <= points <= _MOST


def length(text: str) -> float | None:
    """Return the points of a length such as ``8.6cm``; None for other texts."""
    match = _LENGTH.fullmatch(text)
    return float(match[1]) * _POINTS[match[2]] if match else None


#: The parts of a document, in their order.
SECTIONS = (
    "system",
    "sketch",
    "account",
    "constraints",
    "energies",
    "equations",
    "result",
    "forces",
    "conserved",
    "initial",
    "certificate",
)

#: Those that a document has if nothing else is asked for; of ``forces`` only those derived.
DEFAULT_SECTIONS = ",".join(s for s in SECTIONS if s not in ("sketch", "result", "initial"))

#: Forms of the equations.
FORMS = (
    *("lagrange", "euler", "explicit", "first-order", "hamiltonian", "routhian"),
    "small-oscillations",
)

FORM = Option("form", "the form of the equations", choices=FORMS, default="lagrange")

_SECTIONS = Option(
    "sections",
    f"the parts, with commas between them: {', '.join(SECTIONS)}; sketch in LaTeX and HTML alone",
    choices=SECTIONS,
    default=DEFAULT_SECTIONS,
    default_text="all but sketch, result and initial",
    metavar="LIST",
)


_MACROS = Option(
    "macros",
    "a macro for each symbol",
)

_LANGUAGE = Option(
    "language",
    "the language of the words between formulas",
    choices=LANGUAGES,
    default="en",
)


_WRITTEN_OUT = Option(
    "written_out",
    "no sums and indices, and expressions of any length",
)


def _sections_without_sketch(why: str) -> Option:
    """Return the parts of a document that holds no pictures."""
    names = tuple(name for name in SECTIONS if name != "sketch")
    return replace(_SECTIONS, choices=names, refused={"sketch": why})


#: Styles that hold a problem without its solution, and the steps that solve it.
EXERCISES = ("exercise", "solution")

_STYLE = Option(
    "style",
    "the kind of text; exercise is the problem alone, solution its steps",
    choices=("document", *EXERCISES),
    default="document",
)

LATEX_OPTIONS = (
    replace(_STYLE, choices=("document", "beamer", "snippet", *EXERCISES)),
    FORM,
    _SECTIONS,
    Option(
        "width",
        "the width of lines, a length as 8.6cm; column makes two columns",
        default="page",
        metavar="page|column|LENGTH",
        accepted=is_width,
    ),
    Option("numbers", "numbers of displays", choices=("on", "off"), default="on"),
    _MACROS,
    _LANGUAGE,
    _WRITTEN_OUT,
)

MARKDOWN_OPTIONS = (
    _STYLE,
    FORM,
    _sections_without_sketch("Markdown holds no pictures: lagrange emit SCENE --to svg writes one"),
    _LANGUAGE,
    _WRITTEN_OUT,
)

HTML_OPTIONS = (_STYLE, FORM, _SECTIONS, _LANGUAGE, _WRITTEN_OUT)

TYPST_OPTIONS = (
    _STYLE,
    FORM,
    _sections_without_sketch("lagrange emit SCENE --to svg writes one for image(...)"),
    _LANGUAGE,
    _WRITTEN_OUT,
)

TEXT_OPTIONS = (
    _sections_without_sketch("text holds no pictures: lagrange emit SCENE --to svg writes one"),
    _LANGUAGE,
    _WRITTEN_OUT,
)


#: Names of the options that documents of a derivation have alone.
_OF_DERIVATIONS = ("form", "sections", "written_out")


@dataclass(frozen=True, slots=True)
class DocumentFormat:
    """A format of documents.

    Attributes
    ----------
    title
        Its description in a few words.
    ending
        That of its files.
    module
        Module of :mod:`.writers` that has ``report_NAME(document, language)``, which returns a
        text.
    options
        Its options for derivations.
    """

    title: str
    ending: str
    module: str
    options: tuple[Option, ...]

    @property
    def draws(self) -> bool:
        """True if its documents hold the sketch of a system."""
        return _SECTIONS in self.options


#: Every format of documents by its name; a format is listed here and nowhere else.
DOCUMENTS = {
    "latex": DocumentFormat(
        "LaTeX: a document that compiles, or a snippet for lecture notes",
        ".tex",
        "latex.document",
        LATEX_OPTIONS,
    ),
    "markdown": DocumentFormat(
        "Markdown with formulas in LaTeX, for notebooks and repositories",
        ".md",
        "markdown",
        MARKDOWN_OPTIONS,
    ),
    "typst": DocumentFormat(
        "Typst: a document that compiles", ".typ", "typst.document", TYPST_OPTIONS
    ),
    "html": DocumentFormat(
        "HTML: a page with formulas in MathML, for any browser", ".html", "html", HTML_OPTIONS
    ),
}

#: Format of ``derive --format`` → its options beside those of ``derive`` itself.
DERIVED: dict[str, tuple[Option, ...]] = {
    "text": TEXT_OPTIONS,
    **{name: tuple(o for o in one.options if o is not FORM) for name, one in DOCUMENTS.items()},
    "json": (Option("latex", "the expressions in LaTeX too", further=True),),
}

#: Format of ``analyze --format`` → its options. The parts of an analysis are options of the
#: command, a family's elements are always written out, and no exercise asks for it.
ANALYZED: dict[str, tuple[Option, ...]] = {
    "text": (_LANGUAGE,),
    **{
        name: tuple(
            replace(o, choices=o.choices[: -len(EXERCISES)], help="the kind of text")
            if o.name == "style"
            else o
            for o in one.options
            if o.name not in _OF_DERIVATIONS and o is not _STYLE
        )
        for name, one in DOCUMENTS.items()
    },
    "json": (),
}

#: Options of a document for which nothing else is asked.
DEFAULTS: dict[str, OptionValue] = {option.name: option.default for option in LATEX_OPTIONS}

#: Format of a report → ending of its files.
ENDINGS = {"text": ".txt", **{name: one.ending for name, one in DOCUMENTS.items()}, "json": ".json"}


def format_of(path: str | None) -> str | None:
    """Return the format of reports that a file's ending says; None for others and for no file."""
    ending = None if path is None else ending_of(path)
    return next((name for name, known in ENDINGS.items() if known == ending), None)


def writer_of(name: str, kind: Literal["emit", "report", "body"]) -> Callable[..., Any]:
    """Return the function of a format of documents, which imports its module.

    ``kind``: ``report`` for whole documents; ``body`` for what stands within another one, in HTML
    and LaTeX; ``emit`` for those of LaTeX in its styles.
    """
    module = import_module(f"{__package__}.writers.{DOCUMENTS[name].module}")
    function: Callable[..., Any] = getattr(module, f"{kind}_{name}")
    return function


def sections_of(options: Mapping[str, OptionValue], *, forces: bool) -> tuple[str, ...]:
    """Return the parts of a document that its option ``sections`` asks for.

    Parameters
    ----------
    options
        Complete options.
    forces
        True if constraint forces were derived.

    Raises
    ------
    InputError
        Constraint forces are asked for, and were not derived.
    """
    parts = tuple(part.strip() for part in str(options["sections"]).split(","))
    if "forces" in parts and not forces and options["sections"] != DEFAULT_SECTIONS:
        hint = "derive(forces=True)"
        raise InputError(Problem("constraint forces were not derived", hint=hint, rule="usage"))
    return parts
