"""Registry: the document and the JSON of a value by its type."""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch
from importlib import import_module
from typing import Any

from lagrange_cli.report.tree import Document

#: Name of a class → module of :mod:`.contents` that registers its report, imported when a value is
#: reported: a fit is reported without what reports checks.
_HOMES = {
    "Equations": "derivation.documents",
    "Analysis": "analysis.documents",
    "Lyapunov": "analysis.studies",
    "LinearMotion": "analysis.studies",
    "FrequencyResponse": "analysis.studies",
    "Trade": "tradeoff",
    "Fit": "fit",
    "Simulated": "simulate",
    "Trajectory": "simulate",
    "SimulatedMembers": "ensemble",
    "Ensemble": "ensemble",
    "FoundSection": "section",
    "Section": "section",
    "Paths": "path",
    "Stress": "stress",
    "Report": "check",
    "CacheView": "listings",
    "FormatList": "listings",
}


@singledispatch
def contents_of(value: object) -> Document:
    """Return what a person reads of a value.

    Raises
    ------
    TypeError
        Nothing reports values of this type.
    """
    document: Document = _registered(value, contents_of.dispatch)(value)
    return document


contents_of.register(Document, lambda document: document)


@singledispatch
def json_of(value: object) -> Any:
    """Return the JSON value that programs read of a value; refuse as :func:`contents_of`."""
    return _registered(value, json_of.dispatch)(value)


def _registered(value: object, dispatch: Callable[[type], Callable[..., Any]]) -> Any:
    """Return what the module of a value's type registers."""
    kind = type(value)
    for base in kind.__mro__:
        if home := _HOMES.get(base.__name__):
            import_module(f"{__package__}.contents.{home}")
    registered = dispatch(kind)
    if registered is dispatch(object):
        raise TypeError(f"nothing reports a {kind.__name__}")
    return registered
