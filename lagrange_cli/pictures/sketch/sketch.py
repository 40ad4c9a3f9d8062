"""A picture as a frozen value: dots, strokes and labels in centimetres, y upwards."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Place: TypeAlias = tuple[float, float]
"""A place in the picture: to the right and up, in centimetres."""

StrokeKind: TypeAlias = Literal[
    "rod",
    "radius",
    "rope",
    "spring",
    "damper",
    "curve",
    "hatch",
    "ground",
    "wheel",
    "body",
    "angle",
    "reference",
    "axis",
    "gravity",
    "force",
]
"""Meaning of a stroke, from which printers take its style."""

DotKind: TypeAlias = Literal["mass", "joint", "origin"]
"""Meaning of a dot: a particle, a moving point, the origin."""


@dataclass(frozen=True, slots=True)
class Caption:
    """A text of a picture.

    Attributes
    ----------
    latex
        In math mode of LaTeX.
    plain
        In Unicode.
    """

    latex: str
    plain: str


@dataclass(frozen=True, slots=True)
class Stroke:
    """A polyline.

    Attributes
    ----------
    kind
        Its meaning.
    points
        Two or more places.
    closed
        True if it returns to its beginning, which is not repeated.
    name
        Name of what it shows in the scene, or empty.
    """

    kind: StrokeKind
    points: tuple[Place, ...]
    closed: bool = False
    name: str = ""


@dataclass(frozen=True, slots=True)
class Dot:
    """A body.

    Attributes
    ----------
    kind
        Its meaning.
    at
        Its place.
    radius
        In centimetres.
    name
        Its name in the scene, or empty.
    """

    kind: DotKind
    at: Place
    radius: float
    name: str = ""


@dataclass(frozen=True, slots=True)
class Label:
    """A caption, centred at a place."""

    caption: Caption
    at: Place


@dataclass(frozen=True, slots=True)
class Sketch:
    """A picture of a system.

    Attributes
    ----------
    name, title
        Those of the scene; None if it has no title.
    remarks
        Sentences on what is drawn.
    strokes, dots, labels
        What is drawn, in this order.
    low, high
        Corners of a box around everything.
    """

    name: str
    title: str | None
    remarks: tuple[str, ...]
    strokes: tuple[Stroke, ...]
    dots: tuple[Dot, ...]
    labels: tuple[Label, ...]
    low: Place
    high: Place
