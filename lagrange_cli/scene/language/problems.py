"""Collecting problems, so that a scene's independent mistakes are reported together."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import replace

from lagrange_cli.errors import InputError, LimitError, Mark, Problem, nearest
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.language.tokens import ExpressionError

#: More problems than this are not shown: the first ones usually cause the rest.
_MAX_REPORTED = 20
#: Reading stops at this many problems.
_MAX_COLLECTED = 100

_INDICES = re.compile(r"\[[-\d,]*\]")
#: Characters beyond which a text is cut in messages.
_MAX_SHOWN = 40
#: Beginnings and endings by which others name rates, and what stands for them here.
_RATES = (
    *(("dot", "", ending) for ending in ("_dot", "dot", "'", "_prime", "prime", "_t")),
    *(("dot", beginning, "") for beginning in ("d_", "d", "v_", "v")),
    *(("ddot", "", ending) for ending in ("_ddot", "ddot", "_dotdot", "dotdot", "_tt")),
    *(("ddot", beginning, "") for beginning in ("dd_", "dd", "d2_", "d2", "a_")),
)

#: Most known names among which a similar one is sought.
_MAX_CANDIDATES = 1000


def shown(text: str) -> str:
    """Quote a text, and cut it if it is long."""
    return f"'{text}'" if len(text) <= _MAX_SHOWN else f"'{text[: _MAX_SHOWN - 3]}...'"


def suggestion(name: str, known: Collection[str], otherwise: str = "") -> str:
    """Return a hint at the known name closest to ``name``, or ``otherwise``.

    Among more than a thousand names none is searched for.
    """
    if len(name) > _MAX_SHOWN or len(known) > _MAX_CANDIDATES:
        return otherwise
    for candidate in known:
        if candidate.lower() == name.lower():
            return f"did you mean '{candidate}'?"
    return nearest(name, known) or otherwise


def rate_hint(name: str, positions: Collection[str]) -> str:
    """Return the rate of a position that an unknown name is meant for, or ``""``."""
    if name == "dt":
        return "a rate is written dot(NAME)"
    for function, beginning, ending in _RATES:
        stem = name.removeprefix(beginning).removesuffix(ending)
        if len(stem) == len(name) - len(beginning + ending) and stem in positions:
            kind = "rate" if function == "dot" else "second derivative"
            return f"write {function}({stem}) for the {kind} of '{stem}'"
    return ""


class Problems:
    """A growing list of problems of one scene."""

    def __init__(self) -> None:
        # The same problem found twice, or at several elements of a family, is one problem.
        self._found: dict[Problem, Problem] = {}
        #: Problems of a :class:`LimitError`.
        self.limits: set[Problem] = set()

    def add(self, message: str, mark: Mark, *, hint: str = "", rule: str = "invalid") -> None:
        """Record an error."""
        self._append(Problem(message, mark, hint, rule))

    def _append(self, problem: Problem) -> None:
        self._keep(problem)
        if len(self._found) >= _MAX_COLLECTED:
            self.raise_if_any()

    def warn(self, message: str, mark: Mark, *, hint: str = "", rule: str = "warning") -> None:
        """Record a warning."""
        self._keep(Problem(message, mark, hint, rule, "warning"))

    def _keep(self, problem: Problem) -> None:
        of_all_elements = replace(problem, message=_INDICES.sub("[]", problem.message), hint="")
        self._found.setdefault(of_all_elements, problem)

    @contextmanager
    def collect(self, what: str = "") -> Iterator[None]:
        """Record the problems of an :class:`InputError` raised inside, and go on after it.

        If ``what`` describes one element of a family, the messages name it.
        """
        try:
            yield
        except InputError as error:
            self._take(error, what)

    @contextmanager
    def collect_at(self, expression: Expression, what: str = "") -> Iterator[None]:
        """Record an :class:`ExpressionError` raised inside, at its place in an expression.

        If ``what`` describes one element of a family, the message names it.
        """
        try:
            yield
        except ExpressionError as error:
            self._take(error.located(expression.mark(error.span)), what)

    def _take(self, error: InputError, what: str) -> None:
        problems = [replace(p, message=_of_element(p.message, what)) for p in error.problems]
        if isinstance(error, LimitError):
            self.limits.update(problems)
        for problem in problems:
            self._append(problem)

    @property
    def errors(self) -> list[Problem]:
        """The errors so far, in the order in which they were recorded."""
        return [p for p in self._found.values() if p.severity == "error"]

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """The warnings so far."""
        return tuple(p for p in self._found.values() if p.severity == "warning")

    def raise_if_any(self) -> None:
        """Raise :class:`InputError` with the errors so far, in file order.

        At most :data:`_MAX_REPORTED` are given; the last one shown then says how many more
        there are.
        """
        errors = sorted(self.errors, key=_place)
        if not errors:
            return
        shown = errors[:_MAX_REPORTED]
        more = len(errors) - len(shown)
        if more:
            last = shown[-1]
            hint = f"{last.hint}\n" if last.hint else ""
            count = f"{more}" if len(self._found) < _MAX_COLLECTED else f"at least {more}"
            note = f"{hint}and {count} more problem{'s' if more > 1 else ''}"
            shown[-1] = Problem(last.message, last.mark, note, last.rule)
        raise InputError(*shown)


def _of_element(message: str, what: str) -> str:
    return f"{message} in {what}" if _INDICES.search(what) else message


def _place(problem: Problem) -> tuple[int, int]:
    mark = problem.mark
    return (mark.line, mark.column) if mark else (0, 0)
