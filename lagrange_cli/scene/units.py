"""Dimensions and units of the names of a scene as texts, for labels.

No number is converted: a scene whose declared units are those of the SI has all its numbers in
them, and one that declares none leaves its units open.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TypeAlias

from lagrange_cli.scene.dimensions import ENERGY, Exponent, dimensions
from lagrange_cli.scene.language.expression import Name
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.reading.declarations import AXES
from lagrange_cli.scene.unit_table import BASES, UnknownUnitError, unit_powers

_Exponents: TypeAlias = tuple[Exponent, ...]

#: Exponents of mass, length and time that have a unit of their own.
_NAMED: dict[tuple[int, ...], str] = {(1, 2, -2): "J", (1, 1, -2): "N", (1, 2, -3): "W"}

_LENGTH: _Exponents = (0, 1, 0)


@dataclass(frozen=True)
class Units:
    """Units of names of a scene, ``dot(NAME)``, ``t`` and ``energy`` among them.

    Attributes
    ----------
    dimensions
        Name → its dimension, written as the unit of the SI, ``""`` for a plain number; a name is
        missing if its dimension is not known.
    units
        Name → unit of its numbers; missing if the scene does not determine it.
    """

    dimensions: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)


def units(scene: Scene, angles: Collection[str], names: Iterable[str]) -> Units:
    """Find the units of names of a scene and of their rates.

    Parameters
    ----------
    angles
        Coordinates that are angles: their numbers are radians in any scene.
    names
        Coordinates, Cartesian names and outputs.
    """
    dimension_texts = _dimensions(scene, angles, names)
    declared = {c.name: c.unit for c in scene.coordinates or () if c.unit}
    declared |= {s.name: s.unit for s in scene.states if s.unit}
    texts = [*declared.values(), *(p.unit for p in scene.parameters if p.unit)]
    stated = bool(texts) and all(map(_is_of_the_si, texts))
    known = {name: text for name, text in dimension_texts.items() if stated or text == "rad"}
    return Units(dimension_texts, known | declared)


def _is_of_the_si(text: str) -> bool:
    """Tell if numbers in a unit fit together with those in kg, m and s."""
    try:
        return all(key in BASES for key in unit_powers(text))
    except UnknownUnitError:
        return False


def _is_mechanical(text: str) -> bool:
    """Tell if a unit is one of masses, lengths and times, or unknown."""
    try:
        return all(key not in BASES or key in ("kg", "m", "s") for key in unit_powers(text))
    except UnknownUnitError:
        return True


def _dimensions(scene: Scene, angles: Collection[str], names: Iterable[str]) -> dict[str, str]:
    scales = dimensions(scene)
    expressions = {term.name: term.expression for term in scene.definitions}
    expressions |= {term.name: term.expression for term in scene.outputs}
    lengths = frozenset(_components(scene))
    texts = {"t": "s"}
    if scales.complete:
        texts["energy"] = _text(scales.exponents_of(ENERGY))
    electric = {s.name for s in scene.states if s.unit and not _is_mechanical(s.unit)}
    for name in names:
        if name in electric:
            continue
        exponents = _LENGTH if name in lengths else None
        if scales.complete and exponents is None:
            expression = expressions.get(name)
            exponents = (
                scales.exponents_of(name)
                if expression is None
                else scales.exponents_of_value(expression)
            )
        if name in angles and not any(exponents or ()):
            texts |= {name: "rad", f"dot({name})": "rad/s"}
        elif exponents is not None:
            *others, time = exponents
            texts |= {name: _text(exponents), f"dot({name})": _text((*others, time - 1))}
    return texts


def _components(scene: Scene) -> Iterator[str]:
    """Yield names that are Cartesian components, and so lengths whatever else is known."""
    positions = {particle.name: particle.position for particle in scene.particles}
    positions |= {point.name: point.position for point in scene.points}
    for name, position in positions.items():
        for axis, entry in zip(AXES, position, strict=True):
            yield f"{axis}_{name}"
            if isinstance(entry.node, Name):
                yield entry.node.name


def _text(exponents: _Exponents) -> str:
    """Write a product of powers of kg, m and s; ``""`` for a plain number."""
    named = _NAMED.get(tuple(int(e) if e.denominator == 1 else 0 for e in exponents))
    if named is not None:
        return named
    powers = list(zip(("kg", "m", "s"), exponents, strict=True))
    above = " ".join(_power(symbol, e) for symbol, e in powers if e > 0)
    below = [_power(symbol, -e) for symbol, e in powers if e < 0]
    if not below:
        return above
    return f"{above or 1}/" + (below[0] if len(below) == 1 else f"({' '.join(below)})")


def _power(symbol: str, exponent: Exponent) -> str:
    if exponent == 1:
        return symbol
    return f"{symbol}^{exponent}" if exponent.denominator == 1 else f"{symbol}^({exponent})"
