"""Reports in every format, one after the other in one text, without what differs between runs."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from lagrange_cli.report import Page
from lagrange_cli.report.formats import FORMATS

#: Writes a report in a format and a language.
Write = Callable[[str, str], object]

#: English in every format; other languages as text and in one document.
EVERY = [
    *((format_, "en") for format_ in FORMATS),
    *((format_, code) for code in ("de", "fr") for format_ in ("text", "markdown")),
]

#: English in every format that is light, other languages as text: for long reports.
LIGHT = [
    *((format_, "en") for format_ in FORMATS if format_ not in ("html", "json")),
    *(("text", code) for code in ("de", "fr")),
]

#: Name of a field → what stands in its place: measured values, and rounding errors, of which the
#: digits depend on the processor.
_MEASURED: dict[str, Any] = {
    **dict.fromkeys(("estimated", "energy_drift", "constraint_drift", "conserved_drift"), 1e-12),
    **dict.fromkeys(("steps", "rhs_evaluations", "runs"), 100),
    **dict.fromkeys(("mismatch", "error"), 1e-12),
    **dict.fromkeys(("seconds",), 0.1),
    "method": "Taylor",
    "implementation": "compiled C",
}

#: Least size of a number that is told from none.
_LEAST = 1e-10

#: Decimals of values of motions, which are accurate to more of them whatever method runs.
_DECIMALS = 6


def settled(value: Any, name: str = "") -> Any:
    """Return a value with all that is measured replaced, in the values within it too."""
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return tuple(map(settled, value))
    if isinstance(value, Mapping):
        return {key: settled(entry, name) for key, entry in value.items()}
    if name in _MEASURED and isinstance(value, np.ndarray):
        return np.full_like(value, _MEASURED[name])
    if name in _MEASURED and isinstance(value, int | float | str):
        return _MEASURED[name]
    if isinstance(value, np.ndarray) and value.dtype == float:
        return np.round(value, _DECIMALS) + 0.0
    if isinstance(value, float):
        return float(f"{value:.{_DECIMALS}g}") if abs(value) >= _LEAST else 0.0
    if is_dataclass(value) and not isinstance(value, type):
        known = {field.name: getattr(value, field.name) for field in fields(value)}
        return replace(value, **{key: settled(entry, key) for key, entry in known.items()})
    return value


def _rounded(value: Any) -> Any:
    """Return a JSON value with numbers of nine digits."""
    if isinstance(value, dict):
        return {key: _rounded(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_rounded(entry) for entry in value]
    return float(f"{value:.9g}") if isinstance(value, float) else value


def _lines(values: Any) -> Iterator[str]:
    """Yield JSON with an entry of the outermost object a line."""
    yield "{"
    yield from (
        f"  {json.dumps(k)}: {json.dumps(v, ensure_ascii=False)}," for k, v in values.items()
    )
    yield "}"


def _plain(format_: str, written: object) -> str:
    """Return a text without what all of a format have in common."""
    text = written.text(80) if isinstance(written, Page) else str(written)
    if format_ == "json":
        return "\n".join(_lines(_rounded(json.loads(text)))) + "\n"
    if format_ == "html":
        text = re.sub(r".*<main>\n|</main>.*", "", text, flags=re.DOTALL)
        return text.replace(' xmlns="http://www.w3.org/1998/Math/MathML"', "")
    if format_ == "latex":
        return re.sub(r".*\\begin\{document\}\n+|\\end\{document\}\n", "", text, flags=re.DOTALL)
    return (
        re.sub(r".*#set text\(lang[^\n]*", "", text, flags=re.DOTALL)
        if format_ == "typst"
        else text
    )


def in_formats(write: Write, chosen: list[tuple[str, str]] | None = None) -> str:
    """Return a report in formats and languages, each below a line with its name."""
    return "".join(
        headed(f"{format_}, {code}", _plain(format_, write(format_, code)))
        for format_, code in chosen or EVERY
    )


def headed(title: str, *texts: str) -> str:
    """Return texts below a line that is nowhere else in them."""
    return "\n".join([f"{f' {title} ':=^80}", *(text.strip("\n") for text in texts), "", ""])


def compared(text: str, path: Path, updates: bool) -> None:
    """Compare a text with the file that was approved, or write it."""
    if updates:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")
