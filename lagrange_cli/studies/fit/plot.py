"""Pictures of fits: measurements, the fitted motion, and what is left between them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.simulate.results.plot import new_figure, picture_bytes

if TYPE_CHECKING:
    from lagrange_cli.studies.fit.fit import Fit

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
        rest = column.measured - column.fitted
        lower.errorbar(column.times, rest, column.deviations, fmt=".", markersize=4)
        lower.axhline(0, linewidth=1)
        lower.set_ylabel("residual")
        for axes in (upper, lower):
            axes.grid(visible=True, alpha=0.3)
    panels[0][0].legend(loc="best", frameon=False)
    panels[-1][0].set_xlabel("t")
    values = ", ".join(f"{v.name} = {v.value:.6g}" for v in fit.values)
    figure.suptitle(f"{fit.name}: {values}", parse_math=False)
    return picture_bytes(figure, ending)
