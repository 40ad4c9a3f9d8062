"""Map of a number over a plane, as it is drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.model.labels import Label

#: Differences of distances between values that count as one distance, as a part of it.
_EVEN = 1e-6


@dataclass(frozen=True)
class PlaneMap:
    """A number at each pair of two values.

    Attributes
    ----------
    title
        Text of the scene without any mathematics.
    x, y
        Values that increase, at least two of each.
    values
        Shape (len(y), len(x)), NaN where there is none.
    x_label, y_label, label
        Of both axes and of the values.
    equal
        True if both axes are to have one scale.
    """

    title: str
    x: Array
    y: Array
    values: Array
    x_label: Label
    y_label: Label
    label: Label
    equal: bool

    @property
    def is_even(self) -> bool:
        """True if the values of both axes lie as far from each other everywhere."""
        distances = (np.diff(axis) for axis in (self.x, self.y))
        return all(np.ptp(d) <= _EVEN * abs(d.mean()) for d in distances)

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Left, right, lower and upper end, half a distance beyond the values."""
        half_x, half_y = (float(axis[1] - axis[0]) / 2 for axis in (self.x, self.y))
        x, y = (float(self.x[0]), float(self.x[-1])), (float(self.y[0]), float(self.y[-1]))
        return x[0] - half_x, x[1] + half_x, y[0] - half_y, y[1] + half_y
