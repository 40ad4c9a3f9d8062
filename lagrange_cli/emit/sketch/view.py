"""The plane of the picture: that of the motion, or an oblique view of space."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.emit.sketch.configurations import Configurations

    Array: TypeAlias = NDArray[np.float64]

#: Where an axis that comes towards the viewer goes in the picture (cabinet projection).
_TOWARDS_VIEWER = np.array([-0.38, -0.30])


@dataclass(frozen=True)
class View:
    """A linear map from space to the picture.

    Attributes
    ----------
    matrix
        Shape (2, 3): to the right, and up.
    axes
        Numbers of the axes that are shown: two of a plane, or three.
    """

    matrix: Array
    axes: tuple[int, ...]

    @property
    def is_flat(self) -> bool:
        return len(self.axes) == 2

    def project(self, places: Array) -> Array:
        """Project places, shape (..., 3), to the picture, shape (..., 2)."""
        projected: Array = places @ self.matrix.T
        return projected


def view_of(configurations: Configurations, down: Array | None, *lines: Array) -> View:
    """Choose the plane in which all bodies are and stay, or else an oblique view; down is down.

    ``lines`` are in the picture too, each of shape (P, 3).
    """
    places = np.concatenate([configurations.places.reshape(-1, 3), *lines])
    spread = np.ptp(places, axis=0)
    moving = [axis for axis in range(3) if spread[axis] > 1e-9 * configurations.size]
    vertical = _axis_of(down)
    if len(moving) == 3:
        return _oblique(vertical)
    return _flat(_plane(moving, vertical), vertical)


def _axis_of(down: Array | None) -> tuple[int, int] | None:
    """The axis along which gravity points and the sign of up; None if it is along none."""
    if down is None:
        return None
    axis = int(np.abs(down).argmax())
    across = np.delete(down, axis)
    alone = np.abs(across).max() <= 1e-9 * abs(down[axis])
    return (axis, -int(np.sign(down[axis]))) if alone else None


def _plane(moving: list[int], vertical: tuple[int, int] | None) -> tuple[int, int]:
    """Two axes: those of the motion, of gravity, then x with z."""
    wanted = [*moving, *([] if vertical is None else [vertical[0]]), 0, 2]
    first, second = sorted(list(dict.fromkeys(wanted))[:2])
    return first, second


def _flat(plane: tuple[int, int], vertical: tuple[int, int] | None) -> View:
    right, up = plane
    sign = 1
    if vertical is not None and vertical[0] in plane:
        up, sign = vertical
        right = plane[0] if up == plane[1] else plane[1]
    matrix = np.zeros((2, 3))
    matrix[0, right], matrix[1, up] = 1, sign
    return View(matrix, (right, up))


def _oblique(vertical: tuple[int, int] | None) -> View:
    """A right-handed picture: towards the viewer × right = up."""
    up, sign = vertical or (2, 1)
    towards, right = (up + 1) % 3, (up + 2) % 3
    if sign < 0:
        towards, right = right, towards
    matrix = np.zeros((2, 3))
    matrix[0, right], matrix[1, up] = 1, sign
    matrix[:, towards] = _TOWARDS_VIEWER
    return View(matrix, (towards, right, up))
