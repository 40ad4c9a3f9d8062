"""Shapes of MJCF → mass, centre and tensor of inertia, of uniform density.

Lengths are halves of those of the body: ``size`` has radii and half lengths. A capsule is a
cylinder and two half spheres, whose centres of mass are at 3 R/8 from their flat sides.
"""

from __future__ import annotations

from decimal import Decimal

from lagrange_cli.robots.mjcf_settings import Settings
from lagrange_cli.robots.quantities import (
    PI,
    ZERO,
    Vector,
    added,
    is_square,
    number_text,
    rotation,
    scaled,
    turn_between,
)
from lagrange_cli.robots.robot import Inertial, Tensor
from lagrange_cli.robots.tensors import in_turned_axes
from lagrange_cli.robots.xml_reader import Element

#: Numbers that ``size`` needs; one less where ``fromto`` gives the length.
_SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
_ALONG = ("capsule", "cylinder", "ellipsoid", "box")

#: Density of water in kg/m³, the default of the format.
_DENSITY = "1000"

#: Shapes without mass: infinite ones, and those of terrain.
_MASSLESS = ("plane", "hfield")

_Moments = tuple[Decimal, Decimal, Decimal]


def inertial_of(geom: Element, settings: Settings) -> Inertial | None:
    """Return the inertia of a shape in the axes of its body; None if it has no mass.

    Raises
    ------
    InputError
        Located: its mass is that of a mesh, or its size is missing.
    """
    kind = geom.attributes.get("type", "sphere")
    if "mesh" in geom.attributes and "type" not in geom.attributes:
        kind = "mesh"
    mass_given = geom.number("mass") if "mass" in geom.attributes else None
    density = geom.number("density", _DENSITY)
    if kind in _MASSLESS or mass_given == 0 or (mass_given is None and density == 0):
        return None
    if kind not in _SIZES:
        hint = "give the body its mass, centre and inertia by <inertial>"
        geom.refuse(f"the mass of a shape of type '{kind}' is not known", "type", hint)
    if geom.attributes.get("shellinertia", "false") == "true":
        geom.refuse("shells are not read", "shellinertia")
    centre, size, turns = _geometry(geom, kind, settings)
    if any(part <= 0 for part in size):
        geom.refuse("a size is positive", "size")
    volume, moments = _solid(kind, size)
    mass = mass_given if mass_given is not None else density * volume
    x, y, z = (mass * moment for moment in moments)
    matrix = rotation(turns)
    tensor: Tensor = (x, y, z, ZERO, ZERO, ZERO)
    shape = _shape(kind, size) if is_square(matrix) else None
    if turns and kind != "sphere":
        shape = _turned_shape(kind, size, matrix) if shape is not None else None
    return Inertial(mass, centre, in_turned_axes(tensor, matrix), geom.mark, shape)


def _geometry(geom: Element, kind: str, settings: Settings):  # type: ignore[no-untyped-def]
    count = _SIZES[kind]
    numbers = geom.some_numbers("size")
    if "fromto" in geom.attributes and kind in _ALONG:
        ends = geom.numbers("fromto", 6)
        first, last = _vector(ends[:3]), _vector(ends[3:])
        along = added(last, scaled(first, Decimal(-1)))
        if not any(along):
            geom.refuse("'fromto' has no length", "fromto")
        half = sum((part * part for part in along), ZERO).sqrt() / 2
        # The format turns the z axis the other way: no matter, shapes are symmetric.
        turns = turn_between((ZERO, ZERO, Decimal(1)), along)
        centre = scaled(added(first, last), Decimal("0.5"))
        wide = (numbers * 2)[: count - 1] if len(numbers) < count - 1 else numbers[: count - 1]
        return centre, (*wide, half), turns
    if len(numbers) < count:
        geom.refuse(f"the size of a {kind} is {count} numbers, found {len(numbers)}", "size")
    placement = settings.placement(geom)
    return placement.at, numbers[:count], placement.turns


def _vector(numbers: tuple[Decimal, ...]) -> Vector:
    x, y, z = numbers
    return x, y, z


def _solid(kind: str, size: tuple[Decimal, ...]) -> tuple[Decimal, _Moments]:
    """Return the volume, and the moments of a unit of mass about the centre."""
    if kind in ("sphere", "ellipsoid"):
        a, b, c = size * 3 if kind == "sphere" else size
        return 4 * PI * a * b * c / 3, (
            (b * b + c * c) / 5,
            (a * a + c * c) / 5,
            (a * a + b * b) / 5,
        )
    if kind == "box":
        a, b, c = size
        return 8 * a * b * c, ((b * b + c * c) / 3, (a * a + c * c) / 3, (a * a + b * b) / 3)
    radius, half = size
    cylinder = 2 * PI * radius**2 * half
    across, along = radius**2 / 4 + half**2 / 3, radius**2 / 2
    if kind == "cylinder":
        return cylinder, (across, across, along)
    balls = 4 * PI * radius**3 / 3
    volume = cylinder + balls
    ball = 2 * radius**2 / 5
    # Of two half spheres about the centre of the capsule, by the theorem of parallel axes.
    ball_across = ball + half**2 + 3 * half * radius / 4
    together = (cylinder * across + balls * ball_across) / volume
    return volume, (together, together, (cylinder * along + balls * ball) / volume)


def _shape(kind: str, size: tuple[Decimal, ...]) -> str | None:
    """Return the shape in the language of scenes, its axis along z; None if that has none."""
    if kind == "sphere":
        return f"{{sphere: {number_text(size[0])}}}"
    if kind == "cylinder":
        return f"{{cylinder: [{number_text(size[0])}, {number_text(2 * size[1])}]}}"
    if kind == "box":
        return f"{{box: [{', '.join(number_text(2 * part) for part in size)}]}}"
    return None


def _turned_shape(kind: str, size: tuple[Decimal, ...], matrix: tuple[Decimal, ...]) -> str | None:
    """Return the shape where the turns of its frame only exchange axes."""
    order = [next(k for k in range(3) if matrix[3 * i + k]) for i in range(3)]
    if kind == "box":
        return _shape(kind, tuple(size[k] for k in order))
    shape = _shape(kind, size)
    if shape is None or kind != "cylinder" or order[2] == 2:
        return shape
    return f"{shape[:-1]}, axis: {'xyz'[order.index(2)]}}}"
