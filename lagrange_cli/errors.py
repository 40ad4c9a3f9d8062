"""Problems with a place, by which all mistakes are reported.

Every mistake in YAML, an expression, the geometry of a scene or an expected result becomes a
:class:`Problem`, and every refusal is a :class:`LagrangeError` that carries its problems and the
exit code of the command line.
"""

from __future__ import annotations

import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Literal


@dataclass(frozen=True, slots=True)
class Mark:
    """A place in a file.

    Attributes
    ----------
    file
        Name of the file in messages.
    line, column
        Counted from 1.
    text
        The line itself; empty if it is not known.
    length
        Number of characters that are marked from the column on.
    """

    file: str
    line: int
    column: int
    text: str = ""
    length: int = 1


@dataclass(frozen=True, slots=True)
class Edit:
    """A replacement of what a mark marks.

    Attributes
    ----------
    mark
        The place.
    text
        What stands there then.
    """

    mark: Mark
    text: str


@dataclass(frozen=True, slots=True)
class Problem:
    """One mistake, its place, and a way to mend it.

    Attributes
    ----------
    message
        A sentence without a full stop.
    mark
        The place; None if there is none.
    hint
        Further lines; empty for none.
    rule
        A short stable identifier for reports (``unknown-name``, ``redundant``).
    severity
        Warnings are refused with ``--strict`` only.
    edits
        Replacements by values that were found, which mend it; empty if none is known.
    """

    message: str
    mark: Mark | None = None
    hint: str = ""
    rule: str = "invalid"
    severity: Literal["error", "warning"] = "error"
    edits: tuple[Edit, ...] = ()


class LagrangeError(Exception):
    """Base of all refusals; ``exit_code`` is what the command returns."""

    exit_code: ClassVar[int] = 2

    def __init__(self, *problems: Problem) -> None:
        super().__init__("\n".join(render(p) for p in problems))
        self.problems = problems

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle an error by its problems, so that another process can raise it."""
        return _remade, (type(self), self.problems), vars(self)


def _remade(kind: type[LagrangeError], problems: tuple[Problem, ...]) -> LagrangeError:
    """Rebuild an error from its problems."""
    error = kind.__new__(kind)
    LagrangeError.__init__(error, *problems)
    return error


class InputError(LagrangeError):
    """The scene, a parameter or the usage is wrong (exit 2)."""


class SingularError(InputError):
    """Constraints, coordinates or inertia are singular where the motion begins, or everywhere."""


class InconsistentError(InputError):
    """The constraints contradict each other, or no real configuration satisfies them."""


class MissingStartError(InputError):
    """The initial values do not determine the initial state."""


class InconsistentStartError(InputError):
    """The initial values contradict the constraints."""


class NotRealError(InputError):
    """A value is no real number."""


class LimitError(InputError):
    """Something is larger or deeper than the program takes."""


def placed(refusal: InputError, mark: Mark | None) -> InputError:
    """Return the same refusal, with a place for the problems that have none."""
    return type(refusal)(*(p if p.mark else replace(p, mark=mark) for p in refusal.problems))


class AccuracyError(LagrangeError):
    """A requested accuracy was not reached (exit 1)."""

    exit_code = 1


class InternalError(LagrangeError):
    """The program is wrong, not its input (exit 3)."""

    exit_code = 3


class StoppedError(Exception):
    """The budget of seconds is spent, or the user has asked for an end."""


def escape_controls(text: str) -> str:
    """Replace control and bidirectional-format characters by escapes, so that
    echoed text cannot steer a terminal."""
    return "".join(
        c if unicodedata.category(c) not in ("Cc", "Cf", "Cs", "Zl", "Zp") else f"\\x{ord(c):02x}"
        for c in text
    )


def nearest(name: str, candidates: Iterable[str]) -> str:
    """Return ``did you mean 'x'?`` for the closest candidate, or ``""``."""
    from difflib import get_close_matches

    close = get_close_matches(name, sorted(set(candidates)), n=1, cutoff=0.6)
    return f"did you mean '{close[0]}'?" if close else ""


def _caret_lines(mark: Mark) -> list[str]:
    """Write the source line, and carets under the marked part (tabs become one space)."""
    if not mark.text:
        return []
    # Long lines are cut to a window around the column.
    start = max(0, mark.column - 61)
    window = mark.text[start : start + 120].replace("\t", " ")
    before = escape_controls(window[: mark.column - 1 - start])
    tail = window[mark.column - 1 - start :]
    marked = escape_controls(tail[: max(1, mark.length)])
    shown = before + marked + escape_controls(tail[max(1, mark.length) :])
    gutter = f"{mark.line:5d} | "
    return [
        (gutter + shown).rstrip(),
        " " * (len(gutter) - 2) + "| " + " " * len(before) + "^" * max(1, len(marked)),
    ]


def render(problem: Problem) -> str:
    """Format a problem as ``file:line:column: message`` with its source line and caret."""
    word = "warning: " if problem.severity == "warning" else ""
    lines = []
    if problem.mark is None:
        lines.append(word + escape_controls(problem.message))
    else:
        m = problem.mark
        place = f"{escape_controls(m.file)}:{m.line}:{m.column}"
        lines.append(f"{place}: {word}{escape_controls(problem.message)}")
        lines.extend(_caret_lines(m))
    lines.extend("   " + escape_controls(line) for line in problem.hint.splitlines())
    return "\n".join(lines)
