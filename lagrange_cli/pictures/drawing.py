"""Registry: the picture of a value by its type, and its file by the file's ending."""

from __future__ import annotations

import os
from functools import singledispatch
from importlib import import_module
from typing import TypeAlias

from lagrange_cli.files import ending_of, write_file
from lagrange_cli.pictures.by_matplotlib import draw, draw_map
from lagrange_cli.pictures.by_pgfplots import pgfplots_text
from lagrange_cli.pictures.picture import Picture, PlaneMap

#: A picture before it is written.
Drawing: TypeAlias = Picture | PlaneMap

#: Ending of files for pgfplots, which need no matplotlib.
TEX = "tex"

#: Name of a class → module of :mod:`.drawn` that registers its picture, imported when a value is
#: drawn: a trajectory is drawn without what draws equilibria.
_HOMES = {
    "Trajectory": "motions",
    "Family": "families",
    "Section": "sections",
    "Paths": "paths",
    "Trade": "tradeoffs",
    "Fit": "fits",
    "EffectivePotential": "potentials",
    "Analysis": "branches",
    "MovingPictures": "modes",
}


@singledispatch
def picture_of(value: object, asked: str | None = None) -> Drawing:
    """Return the picture of a value; a picture is its own.

    Parameters
    ----------
    value
        A value of a type that a module of :mod:`.drawn` registers.
    asked
        The curves, where there is a choice.

    Raises
    ------
    InputError
        The value has nothing to draw, or nothing has a name that is asked for.
    TypeError
        Nothing draws values of this type.
    """
    if isinstance(value, Picture | PlaneMap):
        return value
    kind = type(value)
    homes = [_HOMES[c.__name__] for c in kind.__mro__ if c.__name__ in _HOMES]
    if not homes:
        raise TypeError(f"nothing draws a {kind.__name__}")
    import_module(f"{__package__}.drawn.{homes[0]}")
    if picture_of.dispatch(kind) is picture_of.dispatch(object):
        raise TypeError(f"nothing draws a {kind.__name__}")
    return picture_of(value, asked)


def drawn(picture: Drawing, ending: str) -> bytes:
    """Return the bytes of a file of an ending.

    Raises
    ------
    InputError
        matplotlib is not installed, or it cannot write such a file.
    """
    if isinstance(picture, PlaneMap):
        return draw_map(picture, ending)
    return pgfplots_text(picture).encode() if ending == TEX else draw(picture, ending)


def draw_into(path: str | os.PathLike[str], value: object, asked: str | None = None) -> None:
    """Draw a value into a file; refuse as :func:`picture_of` and :func:`drawn`."""
    write_file(path, drawn(picture_of(value, asked), ending_of(path).lstrip(".")))
