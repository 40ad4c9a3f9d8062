"""Trade-offs: seconds and right-hand sides of runs over their errors, with the fronts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from lagrange_cli.pictures.drawing import picture_of
from lagrange_cli.pictures.picture import NO_LABEL, Axis, Line, Panel, Picture, Style, latex_digits
from lagrange_cli.simulate.model.labels import Label
from lagrange_cli.studies.tradeoff.result import Trade
from lagrange_cli.studies.tradeoff.runs import WorkPrecisionPoint

#: Largest error that is drawn, relative to scales.
_LARGEST = 1.0

_ERROR = Axis(
    Label("largest error over its scale", "largest error over its scale"),
    is_log=True,
    is_reversed=True,
)


@picture_of.register
def picture_of_trade(trade: Trade, asked: str | None = None) -> Picture:
    """Draw a panel for each cost."""
    until = Label(f"$t \\leq {latex_digits(trade.until)}$", f"t ≤ {trade.until:.6g}")
    if not any(map(_is_drawn, trade.points)):
        empty = Panel((), Axis(NO_LABEL), Axis(NO_LABEL))
        return Picture(trade.name, (empty,), caption=Label("no run to draw", "no run to draw"))
    seconds = _panel(trade, "seconds", lambda p: p.median, lambda p: p.pareto)
    evaluations = _panel(
        trade, "right-hand sides", lambda p: float(p.evaluations), lambda p: p.pareto_evaluations
    )
    return Picture(
        trade.name,
        (seconds, replace(evaluations, has_legend=False)),
        is_stacked=True,
        caption=until,
    )


def _is_drawn(point: WorkPrecisionPoint) -> bool:
    return bool(point.seconds) and 0 < point.distance <= _LARGEST


def _panel(
    trade: Trade,
    name: str,
    cost: Callable[[WorkPrecisionPoint], float],
    on_front: Callable[[WorkPrecisionPoint], bool],
) -> Panel:
    lines = tuple(_lines(trade, cost, on_front))
    return Panel(lines, _ERROR, Axis(Label(name, name), is_log=True), height=1.7)


def _lines(
    trade: Trade,
    cost: Callable[[WorkPrecisionPoint], float],
    on_front: Callable[[WorkPrecisionPoint], bool],
) -> Iterator[Line]:
    """Yield the front, a line for each method, and crosses for ``auto``."""
    drawn = [point for point in trade.points if _is_drawn(point)]

    def line(name: str, points: list[WorkPrecisionPoint], style: Style) -> Line:
        places = np.array([(p.distance, cost(p)) for p in points]).reshape(-1, 2)
        return Line(Label(name, name), places[:, 0], places[:, 1], style)

    front = sorted((p for p in drawn if on_front(p)), key=lambda p: p.distance)
    yield line("front", front, "band")
    costs = np.array([cost(p) for p in drawn])
    ends = costs[[costs.argmin(), costs.argmax()]]
    label = Label("reference's error", "reference's error")
    yield Line(label, np.repeat(trade.reference.error, 2), ends, "rule")
    for name in dict.fromkeys(p.setting.method for p in drawn):
        yield line(name, [p for p in drawn if p.setting.method == name], "marked")
    automatic = [ratios.point for ratios in trade.automatic if _is_drawn(ratios.point)]
    if automatic:
        yield line("auto", automatic, "crosses")
