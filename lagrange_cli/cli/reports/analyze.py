"""Report of ``lagrange analyze``: text, JSON, and the matrices as NumPy arrays."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.reports.json_text import json_text
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page

if TYPE_CHECKING:
    from lagrange_cli.analysis.values import Analysis


def analysis_text(analysis: Analysis, *, ascii: bool, encoding: str) -> Page:
    """Write an analysis as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.analysis.text import analysis_page

    written = analysis_page(analysis, ascii=ascii)
    if ascii or can_encode(written.text(), encoding):
        return written
    return analysis_page(analysis, ascii=True)


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
