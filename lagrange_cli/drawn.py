"""Values that the rooms of pictures and of reports show, which stand above them.

A value has :meth:`Drawn.plot` and what notebooks ask for, and imports nothing that draws or writes:
registries, which know values by their types, are called by their names.
"""

from __future__ import annotations

import os
from importlib import import_module

#: The room above all values, in which pictures are registered by type.
_PICTURES = "lagrange_cli.pictures"

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
