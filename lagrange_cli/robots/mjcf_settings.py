"""Settings of an MJCF file: defaults of classes, angles, orientations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import TypeVar

from lagrange_cli.robots.quantities import (
    AXES,
    ZERO,
    Angle,
    ConstantTurn,
    Vector,
    fewest_turns,
    in_degrees,
    in_radians,
    turn_about,
    turn_between,
    turn_of_axes,
    turn_of_quaternion,
)
from lagrange_cli.robots.robot import Placement
from lagrange_cli.robots.xml_reader import Element

_Value = TypeVar("_Value")

_ORIENTATIONS = ("quat", "axisangle", "euler", "xyaxes", "zaxis")


@dataclass(frozen=True)
class Settings:
    """Settings that hold for a whole file.

    Attributes
    ----------
    in_degrees
        True if angles are in degrees.
    sequence
        Axes of ``euler``, in capitals where they stay fixed.
    limits_by_range
        True if a range limits a joint unless it says otherwise.
    inertia_from_shapes
        True if shapes give the inertia also of bodies that have one of their own, False if they
        never do, None if they do for bodies without.
    total_mass
        Mass that all bodies are scaled to, None for no such scaling.
    classes
        Name of a class → tag → its attributes; the class without a name is that of all others.
    """

    in_degrees: bool
    sequence: str
    limits_by_range: bool
    inertia_from_shapes: bool | None
    total_mass: Decimal | None
    classes: Mapping[str, Mapping[str, Mapping[str, str]]]

    def resolved(self, element: Element, inherited: str) -> Element:
        """Return an element with the attributes of its class where it has none of its own."""
        name = element.attributes.get("class", inherited)
        if name not in self.classes:
            element.refuse(f"there is no default class '{name}'", "class")
        known = self.classes[name].get(element.tag, {})
        return replace(element, attributes={**known, **element.attributes})

    def angle(self, value: Decimal) -> Angle:
        return in_degrees(value) if self.in_degrees else in_radians(value)

    def placement(self, element: Element) -> Placement:
        """Return the place and the turns of an element."""
        x, y, z = element.numbers("pos", 3, "0 0 0")
        return Placement((x, y, z), self.turns(element))

    def turns(self, element: Element) -> tuple[ConstantTurn, ...]:
        """Return the turns of an element, in whichever of the ways it gives them."""
        ways = [way for way in _ORIENTATIONS if way in element.attributes]
        if not ways:
            return ()
        way = ways[-1]
        if way == "quat":
            parts = element.numbers(way, 4)
            self._require(any(parts), element, way)
            return fewest_turns(turn_of_quaternion(parts))
        if way == "axisangle":
            x, y, z, angle = element.numbers(way, 4)
            self._require(any((x, y, z)), element, way)
            return fewest_turns((turn_about((x, y, z), self.angle(angle)),))
        if way == "euler":
            return self._euler(element)
        if way == "zaxis":
            x, y, z = element.numbers(way, 3)
            self._require(any((x, y, z)), element, way)
            return turn_between((ZERO, ZERO, Decimal(1)), (x, y, z))
        numbers = element.numbers(way, 6)
        turn = turn_of_axes(_vector(numbers[:3]), _vector(numbers[3:]))
        self._require(turn is not None, element, way)
        assert turn is not None
        return turn

    def _require(self, has_length: bool, element: Element, way: str) -> None:
        if not has_length:
            element.refuse(f"'{way}' has no direction", way)

    def _euler(self, element: Element) -> tuple[ConstantTurn, ...]:
        angles = element.numbers("euler", 3)
        turns: tuple[ConstantTurn, ...] = ()
        for letter, value in zip(self.sequence, angles, strict=True):
            turn = ConstantTurn(letter.lower(), self.angle(value))
            # About axes that stay fixed each turn comes before those that are written before it.
            turns = (*turns, turn) if letter in AXES else (turn, *turns)
        return fewest_turns(turns)


def _vector(numbers: tuple[Decimal, ...]) -> Vector:
    x, y, z = numbers
    return x, y, z


def read_settings(root: Element) -> Settings:
    """Read the settings of a file.

    Raises
    ------
    InputError
        Located: a setting is unknown.
    """
    attributes: dict[str, str] = {}
    last = root
    for compiler in root.every("compiler"):
        attributes |= compiler.attributes
        last = compiler
    compiler = replace(last, attributes=attributes)
    if attributes.get("coordinate", "local") != "local":
        compiler.refuse("global coordinates are not read", "coordinate")
    sequence = attributes.get("eulerseq", "xyz")
    if len(sequence) != 3 or not set(sequence.lower()) <= set(AXES):
        compiler.refuse(f"'{sequence}' is not a sequence of three axes", "eulerseq")
    total = compiler.number("settotalmass", "-1")
    return Settings(
        choice(compiler, "angle", {"degree": True, "radian": False}, "degree"),
        sequence,
        choice(compiler, "autolimits", {"true": True, "false": False}, "true"),
        choice(compiler, "inertiafromgeom", {"true": True, "false": False, "auto": None}, "auto"),
        total if total > 0 else None,
        _classes(root),
    )


def choice(element: Element, name: str, choices: Mapping[str, _Value], default: str) -> _Value:
    """Return the meaning of an attribute that is one of some words."""
    text = element.attributes.get(name, default)
    if text not in choices:
        element.refuse(f"'{name}' is one of {', '.join(choices)}, not '{text}'", name)
    return choices[text]


def _classes(root: Element) -> dict[str, dict[str, dict[str, str]]]:
    classes: dict[str, dict[str, dict[str, str]]] = {"": {}}

    def read(element: Element, inherited: Mapping[str, Mapping[str, str]], name: str) -> None:
        merged = {tag: dict(values) for tag, values in inherited.items()}
        for child in element.children:
            if child.tag != "default":
                merged.setdefault(child.tag, {}).update(child.attributes)
        classes[name] = {**classes.get(name, {}), **merged}
        for child in element.every("default"):
            read(child, merged, child.required("class"))

    for element in root.every("default"):
        read(element, classes[""], "")
        classes[element.attributes.get("class", "main")] = classes[""]
    return {"main": classes[""], **classes}
