"""Report of ``lagrange analyze``: text, JSON, and the matrices as NumPy arrays."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.reports.tables import TableColumn, table
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page, Row, page, words

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Analysis
    from lagrange_cli.studies.linear_motion import LinearMotion
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
    report = answer["report"] | {
        "lyapunov": {
            "exponents": list(found.exponents),
            "spreads": list(found.spreads),
            "from": found.start,
            "until": found.until,
        }
    }
    return {"report": report, "page": _with_rows(answer["page"], rows)}


def with_linear_motion(answer: dict[str, Any], found: LinearMotion) -> dict[str, Any]:
    """Add the linear system along a motion to the report and the page of an analysis."""
    span = f"{len(found.t)} times from t = {found.t[0]:.6g} to {found.t[-1]:.6g}"
    lines = [
        "d/dt dy = A(t) dy + B(t) du,  dz = C(t) dy + D(t) du",
        f"states   {', '.join(found.states)}",
        *([f"inputs   {', '.join(found.inputs)}"] if found.inputs else []),
        f"outputs  {', '.join(found.outputs)}",
        *(["E(t) dy = 0 are the changes that constraints allow"] if "E" in found.matrices else []),
        f"estimated error {found.estimated:.1e}, requested {found.requested:.0e}",
        *([found.reason] if found.reason else []),
        "The matrices are in the JSON, and in FILE.npz with -o FILE.npz.",
    ]
    rows = [
        Row("Along the motion", "   ", words(span), "heading"),
        *(Row("", "  ", words(line)) for line in lines),
    ]
    return {
        "report": answer["report"] | {"along": found.report},
        "page": _with_rows(answer["page"], rows),
    }


def _with_rows(written: Any, rows: Sequence[Row]) -> Any:
    """Add a section to a page, both as JSON values."""
    whole = Page.from_json(written)
    return Page((*whole.sections, *page([rows]).sections), whole.ascii).to_json()


def analysis_json(report: dict[str, Any]) -> str:
    """Return the text of a report as JSON."""
    return json_text(report)


def _along_arrays(report: dict[str, Any]) -> dict[str, Any]:
    """Return the linear system along a motion by name, as NumPy arrays for a file."""
    import numpy as np

    from lagrange_cli.studies.linear_motion import NAMES

    values = report["along"]
    texts = {key: np.array(values[key], dtype=str) for key in NAMES}
    numbers = values.keys() - NAMES - {"status", "reason", "accuracy"}
    return {key: np.array(values[key], dtype=float) for key in sorted(numbers)} | texts


def npz_of(report: dict[str, Any]) -> bytes:
    """Return the matrices of a report as the bytes of an ``.npz`` file."""
    import numpy as np

    from lagrange_cli.emit.analysis.report import linearization_arrays

    arrays = linearization_arrays(report) if "along" not in report else _along_arrays(report)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()
