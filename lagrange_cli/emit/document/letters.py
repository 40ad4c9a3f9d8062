"""Letters of formats that documents are written in: those of steps, and texts of a scene."""

from __future__ import annotations

from abc import abstractmethod

from lagrange_cli.emit.steps.letters import Letters


class DocumentLetters(Letters):
    """Letters of a format that documents are written in.

    ``comma`` is a comma between formulas of one display.
    """

    comma: str

    @abstractmethod
    def upright(self, phrase: str) -> str:
        """Words of the program within a formula."""

    @abstractmethod
    def statement(self, text: str) -> str:
        """An equation or inequality as the scene writes it, within a sentence."""

    @abstractmethod
    def unit(self, text: str) -> str:
        """A unit, within a sentence."""

    @abstractmethod
    def value(self, number: float, literal: str | None = None) -> str:
        """A value, as the scene wrote it if that is known."""

    @abstractmethod
    def at_least(self, of: str) -> str:
        """``of ≥ 0``."""

    @abstractmethod
    def differential(self, of: str) -> str:
        """A total time derivative as one fraction."""

    @abstractmethod
    def size(self, of: str) -> str:
        """The magnitude of a vector."""
