"""Values that the room of pictures draws, which stands above them and knows their types.

A value has :meth:`Drawn.plot` and imports nothing that draws: the registry is called by its name.
"""

from __future__ import annotations

import os
from importlib import import_module

#: The room above all values, in which pictures are registered by type.
_PICTURES = "lagrange_cli.pictures"


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


def draw_into(path: str | os.PathLike[str], value: object, asked: str | None = None) -> None:
    """Draw a value, of which ``asked`` says the curves, into a file.

    Raises
    ------
    InputError
        As :meth:`Drawn.plot`; nothing has a name that is asked for.
    """
    import_module(_PICTURES).draw_into(path, value, asked)
