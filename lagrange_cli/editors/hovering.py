"""Texts about what stands at a place of a scene: a key, a function, a name, an equation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from lagrange_cli.editors.completion import described
from lagrange_cli.editors.outline import Outline, Place, Symbol, plain_value, words_of
from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import FUNCTIONS

#: Most characters of an equation.
_LONGEST = 2000

#: Section → what a name that it declares is.
_KINDS = {
    "sizes": "size",
    "parameters": "parameter",
    "inputs": "input",
    "states": "state of first order",
    "controllers": "memory of a controller",
    "functions": "function",
    "particles": "particle",
    "frames": "frame",
    "bodies": "rigid body",
    "points": "point",
    "coordinates": "generalized coordinate",
    "definitions": "definition",
    "constraints": "constraint",
    "potentials": "potential energy",
    "kinetic": "kinetic energy",
    "forces": "force",
    "dissipation": "dissipation",
    "outputs": "output",
    "position": "Cartesian name",
}


def hover_text(
    outline: Outline, line: int, column: int, derived: Mapping[str, Any] | None
) -> tuple[str, Mark] | None:
    """Return Markdown about a place, and the mark that it is about; None if there is nothing.

    Parameters
    ----------
    derived
        The answer to ``derived`` for this text; None if it is not derived.
    """
    occurrence = outline.symbol_at(line, column)
    if occurrence is not None:
        text = "\n\n".join(_about_name(outline, occurrence.symbol, derived))
        return text, occurrence.mark
    place = outline.place_at(line, column)
    if place is None:
        return None
    if place.kind == "key":
        return _about_key(place, derived), place.scalar.mark
    return _about_function(place, column)


def _about_name(
    outline: Outline, symbol: Symbol, derived: Mapping[str, Any] | None
) -> Iterator[str]:
    """Yield paragraphs about a name: what it is, its value, its equation."""
    declared = outline.declarations[symbol]
    yield f"**{symbol.name}**: {_KINDS.get(declared.section, declared.section)}"
    value = None if declared.value is None else plain_value(declared.value)
    if isinstance(value, dict):
        yield _code("\n".join(f"{key}: {entry}" for key, entry in value.items()))
    elif value not in (None, ""):
        yield _code(f"{symbol.name} = {value}")
    start = _start_of(outline, symbol.name)
    if start:
        yield f"At the start {start}."
    equations = (derived or {}).get("equations", {})
    if symbol.namespace == "value" and symbol.name in equations:
        yield "Equation of motion:"
        yield _code(equations[symbol.name])


def _start_of(outline: Outline, name: str) -> str:
    """Return the initial values of a name and its rate, as text."""
    values = [] if outline.scene is None else outline.scene.initial
    texts = {0: name, 1: f"dot({name})"}
    return ", ".join(
        f"{texts[v.order]} = {v.value.text}" for v in values if v.name == name and v.order in texts
    )


def _about_key(place: Place, derived: Mapping[str, Any] | None) -> str:
    """Return the description of a key; of ``coordinates`` all equations, too."""
    text = f"**{place.path[-1]}**: {described(place.schemas)}"
    page = (derived or {}).get("page")
    return f"{text}\n\n{_code(page)}" if page and place.path == ("coordinates",) else text


def _about_function(place: Place, column: int) -> tuple[str, Mark] | None:
    """Return the number of arguments of a function at a place of an expression."""
    scalar = place.scalar
    for word, offset, _ in words_of(scalar.text) if scalar.exact else ():
        start = scalar.mark.column + offset
        if word in FUNCTIONS and start <= column <= start + len(word):
            number = FUNCTIONS[word]
            arguments = "one or more arguments" if number is None else f"{number} argument"
            text = f"**{word}**: function of {arguments}{'s' if (number or 0) > 1 else ''}"
            return text, replace(scalar.mark, column=start, length=len(word))
    return None


def _code(text: str) -> str:
    """Return a block of code, which shows a text as it is; long ones are cut."""
    shown = text if len(text) <= _LONGEST else f"{text[:_LONGEST]} ..."
    return f"```\n{shown.replace('```', '')}\n```"
