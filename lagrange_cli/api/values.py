"""Values that the methods take: numbers and expressions by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

GivenValues = Mapping[str, "float | str"]
"""Name → a number, or the text of an expression."""

DrivenInputs = Mapping[str, Callable[[float], float]]
"""Name of an input → a function of time."""


def text_of(value: float | str) -> str:
    """Write a number as the shortest text that reads back the same; keep an expression."""
    return value if isinstance(value, str) else repr(float(value))


def texts(values: GivenValues | None) -> dict[str, str]:
    """Write each value as a text; none are none."""
    return {name: text_of(value) for name, value in (values or {}).items()}
