"""Report of ``lagrange analyze``: text, documents, JSON, and the matrices as NumPy arrays."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

from lagrange_cli.cli.reports.tables import json_text
from lagrange_cli.cli.terminal.output import can_encode
from lagrange_cli.notation.page import Page

if TYPE_CHECKING:
    from lagrange_cli.api.analyzed import Analyzed

#: Option of a format → its value.
Options: TypeAlias = Mapping[str, str | bool]


def _text(analysis: Analyzed, chosen: Options, ascii_only: bool, encoding: str) -> Page:
    """Write an analysis as text, in ASCII where the encoding has no more."""
    from lagrange_cli.emit.analysis.text import analysis_page

    code = str(chosen.get("language", "en"))
    written = analysis_page(analysis, ascii=ascii_only, code=code)
    if ascii_only or can_encode(written.text(), encoding):
        return written
    return analysis_page(analysis, ascii=True, code=code)


def _document(to: str) -> Callable[[Analyzed, Options, bool, str], str]:
    """Write an analysis as a document."""

    def written(analysis: Analyzed, chosen: Options, _ascii_only: bool, _encoding: str) -> str:
        (text,) = analysis.emit(to, **chosen).values()
        return text

    return written


def _json(analysis: Analyzed, _chosen: Options, _ascii_only: bool, _encoding: str) -> str:
    return analysis_json(analysis.report())


#: Name of a format → what writes it, with options of the format, in plain ASCII or in what an
#: encoding has.
FORMATS: Mapping[str, Callable[[Analyzed, Options, bool, str], str | Page]] = {
    "text": _text,
    "latex": _document("latex"),
    "markdown": _document("markdown"),
    "typst": _document("typst"),
    "json": _json,
}


#: Name of a format → ending of its files.
ENDINGS = {"text": ".txt", "latex": ".tex", "markdown": ".md", "typst": ".typ", "json": ".json"}


def analysis_json(report: dict[str, Any]) -> str:
    """Return the text of a report as JSON."""
    return json_text(report)


#: Names in a response.
_NAMED = ("inputs", "outputs")


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

    from lagrange_cli.emit.analysis.report import linearization_arrays, response_arrays

    arrays: dict[str, Any] = {}
    if "along" in report:
        arrays = _along_arrays(report)
    elif report["linearization"] is not None:
        arrays = dict(linearization_arrays(report))
    if "response" in report:
        texts = {key: np.array(report["response"][key], dtype=str) for key in _NAMED}
        arrays = texts | arrays | response_arrays(report)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()
