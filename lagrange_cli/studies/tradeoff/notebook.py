"""A measured trade as a notebook shows it: the front, and what to take for an accuracy."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.notation.html import html_table, html_text

if TYPE_CHECKING:
    from lagrange_cli.studies.tradeoff.measure import Trade
    from lagrange_cli.studies.tradeoff.runs import WorkPrecisionPoint

_HEADS = ("method", "setting", "error", "seconds", "right-hand sides")


def trade_html(trade: Trade) -> str:
    """Two tables: runs on a front, and the run to take for each accuracy."""
    name = f"<b>{html_text(trade.name)}</b>"
    front = [p for p in trade.points if p.pareto or p.pareto_evaluations]
    caption = f"{name} until t = {trade.until:.9g}: best of {len(trade.points)} runs"
    taken = [[f"{r.accuracy:.0e}", *_row(r.point)] for r in trade.recommended]
    return "\n".join(
        [
            html_table(caption, _HEADS, map(_row, front), len(front)),
            html_table("Recommended", ("accuracy", *_HEADS), taken, len(taken)),
        ]
    )


def _row(point: WorkPrecisionPoint) -> list[str]:
    setting = point.setting
    is_adaptive = setting.rtol is not None
    return [
        html_text(setting.method),
        f"rtol {setting.rtol:.0e}" if is_adaptive else f"step {setting.step:.3g}",
        "" if point.error is None else f"{point.error:.1e}",
        f"{point.median:.2e}",
        f"{point.evaluations}",
    ]
