"""Fits as values: fitted values with their errors, columns with residuals, and their picture."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lagrange_cli.files import ending_of, write_file
from lagrange_cli.notation.html import html_table, html_text
from lagrange_cli.simulate.results.plot import new_figure, picture_bytes

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory


@dataclass(frozen=True)
class FittedValue:
    """A value that was fitted.

    Attributes
    ----------
    name
        Name of a parameter, or of a coordinate or its ``dot`` for its start.
    start, value
        The value of the scene, and the fitted one.
    error
        Its standard error; None if the measurements do not determine it.
    """

    name: str
    start: float
    value: float
    error: float | None


@dataclass(frozen=True)
class FittedColumn:
    """A measured column beside the motion that was fitted.

    Attributes
    ----------
    name
        The column.
    times, measured, fitted
        Times of the measurements, their values, and those of the motion.
    deviations
        Standard deviations of the measurements: given, or estimated as the one number that
        the residuals have.
    """

    name: str
    times: Array
    measured: Array
    fitted: Array
    deviations: Array

    @property
    def root_mean_square(self) -> float:
        """The root mean square of the residuals."""
        return float(np.sqrt(np.mean((self.measured - self.fitted) ** 2)))


@dataclass(frozen=True)
class Fit:
    """The result of a fit.

    Attributes
    ----------
    name
        Name of the scene.
    status
        ``ok``; ``undetermined``: other values fit as well; ``not_converged``.
    reason
        Words that say more, if the status is not ``ok``.
    values
        Fitted values, in the order that was asked for.
    columns
        The measured columns.
    correlation
        Correlation of the errors of the values, shape (values, values); NaN if undetermined.
    chi_squared
        Sum of the squares of residuals over deviations.
    degrees_of_freedom
        Measurements less values.
    given_deviations
        True if the file gave them; else they are estimated, and ``chi_squared`` means nothing.
    derivatives
        ``variational equations`` or ``differences``.
    runs
        Motions that were simulated.
    motion
        The fitted motion.
    """

    name: str
    status: Literal["ok", "undetermined", "not_converged"]
    reason: str
    values: tuple[FittedValue, ...]
    columns: tuple[FittedColumn, ...]
    correlation: Array
    chi_squared: float
    degrees_of_freedom: int
    given_deviations: bool
    derivatives: str
    runs: int
    motion: Trajectory

    @property
    def exit_code(self) -> int:
        """0 where the values are determined, else 1."""
        return 0 if self.status == "ok" else 1

    def plot(self, path: str | os.PathLike[str]) -> None:
        """Draw each measured column over its residuals; raises as :func:`draw_fit`."""
        write_file(path, draw_fit(self, ending_of(path).lstrip(".")))

    def __repr__(self) -> str:
        """Return one line for a terminal."""
        listed = ", ".join(f"{v.name} = {v.value:.6g}" for v in self.values)
        return f"<Fit of {self.name}: {listed}; {self.status}>"

    def _repr_html_(self) -> str:
        """Return a table of the values, which notebooks show."""
        rows = [
            [
                html_text(v.name),
                f"{v.value:.9g}",
                "" if v.error is None else f"{v.error:.2g}",
                f"{v.start:.6g}",
            ]
            for v in self.values
        ]
        reason = f": {html_text(self.reason)}" if self.reason else ""
        caption = f"<b>{html_text(self.name)}</b>: {self.status.replace('_', ' ')}{reason}"
        return html_table(caption, ("name", "value", "error", "start"), rows, len(rows))


# The picture.

#: Width and height in inches: of the picture, and of each column.
_WIDTH, _HEIGHT = 8.0, 3.0


def draw_fit(fit: Fit, ending: str) -> bytes:
    """Draw each measured column over its residuals; return the file's bytes.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    figure = new_figure((_WIDTH, _HEIGHT * len(fit.columns) + 1), ending)
    count = len(fit.columns)
    heights = [3, 1] * count
    panels = figure.subplots(2 * count, 1, sharex=True, height_ratios=heights, squeeze=False)
    for k, column in enumerate(fit.columns):
        (upper,), (lower,) = panels[2 * k], panels[2 * k + 1]
        shown = fit.motion.t >= min(fit.motion.t[0], column.times[0])
        motion = fit.motion.columns[column.name]
        upper.plot(fit.motion.t[shown], motion[shown], linewidth=1, label="fitted")
        upper.errorbar(
            column.times,
            column.measured,
            column.deviations,
            fmt=".",
            markersize=4,
            label="measured",
        )
        upper.set_ylabel(column.name, parse_math=False)
        residuals = column.measured - column.fitted
        lower.errorbar(column.times, residuals, column.deviations, fmt=".", markersize=4)
        lower.axhline(0, linewidth=1)
        lower.set_ylabel("residual")
        for axes in (upper, lower):
            axes.grid(visible=True, alpha=0.3)
    panels[0][0].legend(loc="best", frameon=False)
    panels[-1][0].set_xlabel("t")
    values = ", ".join(f"{v.name} = {v.value:.6g}" for v in fit.values)
    figure.suptitle(f"{fit.name}: {values}", parse_math=False)
    return picture_bytes(figure, ending)
