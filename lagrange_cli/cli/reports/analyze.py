"""Report of ``lagrange analyze``: text, JSON, and the matrices as NumPy arrays."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import TableColumn, table
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page, Row, page, words

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Analysis
    from lagrange_cli.studies.lyapunov import Lyapunov

_EXPONENTS = (TableColumn("exponent", align=">"), TableColumn("spread", align=">"))


def analysis_text(analysis: Analysis, *, ascii: bool, encoding: str) -> Page:
    """Write an analysis as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.analysis.text import analysis_page

    written = analysis_page(analysis, ascii=ascii)
    if ascii or can_encode(written.text(), encoding):
        return written
    return analysis_page(analysis, ascii=True)


def with_lyapunov(answer: dict[str, Any], found: Lyapunov) -> dict[str, Any]:
    """Add Lyapunov exponents to the report and the page of an analysis."""
    exponents = [
        [f"{x:.5g}", f"{spread:.2g}"]
        for x, spread in zip(found.exponents, found.spreads, strict=True)
    ]
    told = f"averaged from t = {found.start:.6g} to {found.until:.6g}"
    total = f"together {sum(found.exponents):.3g}"
    rows = [
        Row("Lyapunov exponents", "   ", words(told), "heading"),
        *table(_EXPONENTS, exponents),
        Row("", "  ", words(total)),
    ]
    added = page([rows])
    written = Page.from_json(answer["page"])
    whole = Page((*written.sections, *added.sections), written.ascii)
    report = answer["report"] | {
        "lyapunov": {
            "exponents": list(found.exponents),
            "spreads": list(found.spreads),
            "from": found.start,
            "until": found.until,
        }
    }
    return {"report": report, "page": whole.to_json()}


def analysis_json(report: dict[str, Any]) -> str:
    """Return the text of a report as JSON."""
    return json_text(report)


def npz_of(report: dict[str, Any]) -> bytes:
    """Return the matrices of a report as the bytes of an ``.npz`` file."""
    import numpy as np

    from lagrange_cli.emit.analysis.report import linearization_arrays

    stream = io.BytesIO()
    np.savez(stream, **linearization_arrays(report))
    return stream.getvalue()
