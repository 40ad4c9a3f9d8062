"""Certified equations of motion, with all that can be done with them."""

from __future__ import annotations

from dataclasses import dataclass

from lagrange_cli.api.studied import Studied
from lagrange_cli.api.written import Written


@dataclass(frozen=True)
class Derivation(Written, Studied):
    """Certified equations of motion.

    ``str`` gives the text of ``lagrange derive``; notebooks show it typeset. What it holds is said
    at :class:`~.derived.Derived`.
    """

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return f"<Derivation of {self.equations.presentation.name}>"
