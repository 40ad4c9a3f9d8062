"""Work–precision pictures, by matplotlib if it is installed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from lagrange_cli.simulate.results.plot import new_figure, picture_bytes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from lagrange_cli.studies.tradeoff.measure import Trade
    from lagrange_cli.studies.tradeoff.runs import WorkPrecisionPoint

_MARKERS = "os^vDP*Xph"

#: Largest error that is drawn, relative to scales.
_LARGEST = 1.0


def draw_trade(trade: Trade, ending: str) -> bytes:
    """Draw seconds and right-hand sides over the error, with the fronts; return the file's bytes.

    Raises
    ------
    InputError
        matplotlib is not installed, or does not know the ending.
    """
    figure = new_figure((11, 5.5), ending)
    left, right = figure.subplots(1, 2)
    for axes, cost, front, label in (
        (left, _seconds, lambda p: p.pareto, "seconds"),
        (right, _evaluations, lambda p: p.pareto_evaluations, "right-hand sides"),
    ):
        if not any(map(_drawn, trade.points)):
            axes.set_title("no run to draw")
            continue
        _lines(axes, trade, cost)
        _front(axes, trade, cost, front)
        axes.set(xscale="log", yscale="log", ylabel=label)
        axes.set_xlabel("largest error over its scale")
        axes.invert_xaxis()
        axes.grid(visible=True, alpha=0.3)
        axes.axvline(trade.reference.error, color="grey", linestyle=":", label="reference's error")
    right.legend(*right.get_legend_handles_labels(), fontsize="small")
    # Text of a scene is text, not mathematics to be parsed.
    figure.suptitle(f"{trade.name}, until t = {trade.until:.6g}", parse_math=False)
    return picture_bytes(figure, ending)


def _seconds(point: WorkPrecisionPoint) -> float:
    return point.median


def _evaluations(point: WorkPrecisionPoint) -> float:
    return float(point.evaluations)


def _drawn(point: WorkPrecisionPoint) -> bool:
    return bool(point.seconds) and 0 < point.distance <= _LARGEST


def _lines(axes: Axes, trade: Trade, cost: Callable[[WorkPrecisionPoint], float]) -> None:
    """Draw a line for each method, and crosses for ``auto``."""
    names = dict.fromkeys(p.setting.method for p in trade.points)
    for number, name in enumerate(names):
        mine = [p for p in trade.points if p.setting.method == name and _drawn(p)]
        (line,) = axes.plot([p.distance for p in mine], [cost(p) for p in mine], label=name)
        line.set(marker=_MARKERS[number % len(_MARKERS)], markersize=4, linewidth=1)
    automatic = [ratios.point for ratios in trade.automatic if _drawn(ratios.point)]
    if automatic:
        crosses = [(p.distance, cost(p)) for p in automatic]
        axes.plot(*zip(*crosses, strict=True), "k+", ms=12, label="auto")


def _front(
    axes: Axes,
    trade: Trade,
    cost: Callable[[WorkPrecisionPoint], float],
    on_front: Callable[[WorkPrecisionPoint], bool],
) -> None:
    """Draw the Pareto front."""
    best = sorted((p.distance, cost(p)) for p in trade.points if _drawn(p) and on_front(p))
    axes.plot(*zip(*best, strict=True), color="black", lw=5, alpha=0.15, label="front")
