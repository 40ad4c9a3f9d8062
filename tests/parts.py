"""Equations by the names of their fields, whichever part these stand in."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

from lagrange_cli.mechanics.equations import Derivation, Equations, Presentation
from lagrange_cli.mechanics.system import System

PARTS = {"system": System, "derivation": Derivation, "presentation": Presentation}


def _by_part(values: dict[str, Any]) -> dict[str, dict[str, Any]]:
    names = {part: {f.name for f in fields(kind)} for part, kind in PARTS.items()}
    assert set(values) <= set().union(*names.values())
    return {part: {k: v for k, v in values.items() if k in names[part]} for part in PARTS}


def assembled(**values: Any) -> Equations:
    """Return equations with these fields."""
    parts = _by_part(values)
    return Equations(*(kind(**parts[part]) for part, kind in PARTS.items()))


def changed(equations: Equations, **values: Any) -> Equations:
    """Return the equations with these fields in place of theirs."""
    parts = _by_part(values)
    return Equations(*(replace(getattr(equations, part), **parts[part]) for part in PARTS))
