"""Options of documents: their parts, the width of their lines, their language."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.emit.base import Option, OptionValue
from lagrange_cli.errors import InputError, Problem
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
FORMS = ("lagrange", "explicit", "first-order", "hamiltonian", "routhian", "small-oscillations")

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


LATEX_OPTIONS = (
    Option(
        "style",
        "the kind of text",
        choices=("document", "beamer", "snippet"),
        default="document",
    ),
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
    FORM,
    _sections_without_sketch("Markdown holds no pictures: lagrange emit SCENE --to svg writes one"),
    _LANGUAGE,
    _WRITTEN_OUT,
)

HTML_OPTIONS = (FORM, _SECTIONS, _LANGUAGE, _WRITTEN_OUT)

TYPST_OPTIONS = (
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

#: Format of ``analyze --format`` → its options. The parts of an analysis are options of the
#: command, and a family's elements are always written out.
ANALYZED: dict[str, tuple[Option, ...]] = {
    "text": (_LANGUAGE,),
    "latex": tuple(o for o in LATEX_OPTIONS if o.name not in _OF_DERIVATIONS),
    "markdown": (_LANGUAGE,),
    "typst": (_LANGUAGE,),
    "html": (_LANGUAGE,),
    "json": (),
}


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
