"""Values that the rooms of pictures and of reports show, which stand above them.

A value has :meth:`Drawn.plot` and what notebooks ask for, and imports nothing that draws or writes:
registries, which know values by their types, are called by their names.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module

#: The room above all values, in which pictures are registered by type.
_PICTURES = "lagrange_cli.pictures"

_MOVING = f"{_PICTURES}.moving"

#: The formats of reports, whose contents are registered by type.
_FORMATS = "lagrange_cli.report.formats"


class Drawn:
    """A value with a picture."""

    def plot(self, path: str | os.PathLike[str]) -> None:
        """Draw the value into a file: a picture by matplotlib, or ``.tex`` for pgfplots.

        Raises
        ------
        InputError
            matplotlib is not installed, or it cannot write such a file.
        """
        draw_into(path, self)


class Reported:
    """A value with a report, which notebooks show."""

    #: The language of its words.
    language: str = "en"

    @property
    def reported(self) -> object:
        """The value whose report it is, of a type that the registry has."""
        return self

    def _repr_html_(self) -> str:
        return str(import_module(_FORMATS).notebook_text(self, "html"))

    def _repr_latex_(self) -> str:
        return str(import_module(_FORMATS).notebook_text(self, "latex"))


def draw_into(path: str | os.PathLike[str], value: object, asked: str | None = None) -> None:
    """Draw a value, of which ``asked`` says the curves, into a file.

    Raises
    ------
    InputError
        As :meth:`Drawn.plot`; nothing has a name that is asked for.
    """
    import_module(_PICTURES).draw_into(path, value, asked)


@dataclass(frozen=True)
class Film:
    """Motions beside each other, which notebooks play.

    Attributes
    ----------
    equations
        The equations that they are of.
    motions
        Title and trajectory of each.
    speed
        Units of time in a second of the film; None for the usual.
    """

    equations: object
    motions: Sequence[tuple[str, object]]
    speed: float | None = None

    def _repr_html_(self) -> str:
        moving = import_module(_MOVING)
        return bytes(moving.animated(self._pictures(), "svg")).decode("utf-8")

    def write(self, path: str | os.PathLike[str]) -> None:
        """Write ``.svg``, ``.gif`` or ``.mp4``.

        Raises
        ------
        InputError
            As :meth:`.Derivation.animate`.
        """
        import_module(_MOVING).write_film(path, self._pictures())

    def _pictures(self) -> object:
        pictures: object = import_module(_MOVING).motion_pictures(
            self.equations, self.motions, self.speed
        )
        return pictures
