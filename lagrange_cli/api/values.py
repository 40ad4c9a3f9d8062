"""Values that the methods take: numbers and expressions by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from lagrange_cli.files import can_encode

if TYPE_CHECKING:
    from lagrange_cli.report import Page

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


def page_in(encoding: str, write: Callable[[bool], Page], ascii: bool) -> Page:
    """Return a page in plain ASCII or not, the former too where an encoding has no more."""
    page = write(ascii)
    return page if ascii or can_encode(page.text(), encoding) else write(True)
