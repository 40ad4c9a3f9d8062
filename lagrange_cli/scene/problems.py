"""Collecting problems, so that a scene's independent mistakes are reported together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.scene.expression import Expression
from lagrange_cli.scene.tokens import ExpressionError

__all__ = ["MAX_REPORTED", "Problems"]

#: More problems than this are not shown: the first ones usually cause the rest.
MAX_REPORTED = 20


class Problems:
    """A growing list of problems of one scene."""

    def __init__(self) -> None:
        self._found: list[Problem] = []

    def add(self, message: str, mark: Mark, *, hint: str = "", rule: str = "invalid") -> None:
        """Record an error."""
        self._found.append(Problem(message, mark, hint, rule))

    def warn(self, message: str, mark: Mark, *, hint: str = "", rule: str = "warning") -> None:
        """Record a warning."""
        self._found.append(Problem(message, mark, hint, rule, "warning"))

    @contextmanager
    def collect(self) -> Iterator[None]:
        """Record the problems of an :class:`InputError` raised inside, and go on after it."""
        try:
            yield
        except InputError as error:
            self._found.extend(error.problems)

    @contextmanager
    def collect_at(self, expression: Expression) -> Iterator[None]:
        """Record an :class:`ExpressionError` raised inside, at its place in an expression."""
        try:
            yield
        except ExpressionError as error:
            mark = expression.mark(error.span)
            self.add(error.message, mark, hint=error.hint, rule=error.rule)

    @property
    def errors(self) -> list[Problem]:
        """The errors found so far, in the order they were found, each once."""
        return list(dict.fromkeys(p for p in self._found if p.severity == "error"))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """The warnings found so far."""
        return tuple(dict.fromkeys(p for p in self._found if p.severity == "warning"))

    def raise_if_any(self) -> None:
        """Raise :class:`InputError` with the errors found, in file order.

        At most :data:`MAX_REPORTED` are given; the last one shown then says
        how many more there are.
        """
        found = sorted(self.errors, key=_place)
        if not found:
            return
        shown = found[:MAX_REPORTED]
        more = len(found) - len(shown)
        if more:
            last = shown[-1]
            hint = f"{last.hint}\n" if last.hint else ""
            note = f"{hint}and {more} more problem{'s' if more > 1 else ''}"
            shown[-1] = Problem(last.message, last.mark, note, last.rule)
        raise InputError(*shown)


def _place(problem: Problem) -> tuple[int, int]:
    mark = problem.mark
    return (mark.line, mark.column) if mark else (0, 0)
