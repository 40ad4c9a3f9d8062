"""Helpers of one line, written out as the expressions they stand for.

Each is turned into the text that a user could have written in the component
names ``x_NAME, y_NAME, z_NAME``, and parsed like any other; its parts are
reported at the helper.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction

from lagrange_cli.errors import Mark
from lagrange_cli.scene.joints import Joint
from lagrange_cli.scene.language.bounds import Extent, extent_of
from lagrange_cli.scene.language.expression import Equation, Expression, Neg, Node, Number, names_in
from lagrange_cli.scene.language.grammar import INEQUALITIES
from lagrange_cli.scene.language.tokens import ExpressionError
from lagrange_cli.scene.model import Constraint, Link, Particle
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.interactions import (
    as_factor,
    body_pair,
    charge_helper,
    coulomb,
    differences,
    flat,
    helper_equation,
    helper_expression,
    helper_part,
    newton,
    place_of,
    unknown_helper,
)
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

#: Terms that one particle's weight counts as if a family of potentials repeats it.
_TERMS_OF_WEIGHT = 20

#: Keys of every constraint that is a mapping: how it and its multiplier print.
NOTATION = ("latex", "multiplier")


@dataclass(frozen=True, slots=True)
class Written:
    """Equations that a constraint's helper is written out as, and the joint that it states."""

    equations: tuple[Equation, ...]
    joint: Joint | None = None


def distance(node: Mapping, what: str, reading: Reading) -> Written | None:
    """Write out ``{distance: [A, B], equals: l}``."""
    keys = ["distance", "equals"]
    fields = reading.fields(node, what, (*keys, *NOTATION), required=keys)
    pair = body_pair(fields["distance"], "distance", what, reading)
    length = None
    if "equals" in fields:
        length = helper_part(fields["equals"], "equals", what, reading)
    if pair is None or length is None:
        return None
    if _is_negative(length.node):
        reading.problems.add(
            f"a distance cannot be negative, found {length.text}", length.mark(), rule="distance"
        )
        return None
    squares = " + ".join(f"({d})^2" for d in differences(*pair))
    square = "1" if length.text.strip() == "1" else f"{as_factor(length)}^2"
    text = f"{squares} = {square}"
    reading.links.append(Link("distance", pair, length))
    return Written((helper_equation(text, place_of(node), reading),))


def read_unilateral(
    node: Mapping, what: str, reading: Reading
) -> tuple[Equation, Expression | None] | None:
    """Read ``{unilateral: z >= 0, restitution: 0.8}``: an inequality, and Newton's coefficient."""
    fields = reading.fields(node, what, ("unilateral", "restitution", *NOTATION))
    inequality = reading.equation(fields["unilateral"], what, INEQUALITIES)
    restitution = None
    if "restitution" in fields:
        restitution = reading.expression(fields["restitution"], f"'restitution' of {what}")
        if restitution is None:
            return None
        value = None
        with reading.problems.collect_at(restitution):
            value = extent_of(restitution.node, {}).value
        if value is not None and not 0 <= value <= 1:
            reading.problems.add(
                f"a restitution is from 0 to 1, found {restitution.text}",
                restitution.mark(),
                hint="0: contact is kept; 1: no energy is lost",
                rule="restitution",
            )
            return None
    return None if inequality is None else (inequality, restitution)


def _is_negative(node: Node) -> bool:
    """Say whether an expression is a negative number as it stands, without parameters."""
    return isinstance(node, Neg) and isinstance(node.operand, Number) and node.operand.value != 0


def read_potential_helper(node: Mapping, what: str, reading: Reading) -> Expression | None:
    """Write out a potential's helper, one of :data:`_POTENTIALS`."""
    keys = [key.text for key, _ in node.entries]
    name = next((name for name in _POTENTIALS if name in keys), None)
    if name is None:
        unknown_helper(node, what, tuple(_POTENTIALS), reading)
        return None
    text = _POTENTIALS[name](node, what, reading)
    return helper_expression(text, place_of(node), reading) if text else None


@dataclass(frozen=True, slots=True)
class PlaneSection:
    """The section ``plane``: its place, the number of the axis across it, and its constraint."""

    mark: Mark
    across: int
    constraint: Constraint | None


def read_plane(node: SourceNode, reading: Reading) -> PlaneSection | None:
    """Write out ``plane: xz``: every particle's coordinate across the plane is 0.

    Bodies are placed within it, and have no equation there.
    """
    text = node.text if isinstance(node, Scalar) else ""
    across = [axis for axis in AXES if axis not in text]
    if len(text) != 2 or len(across) != 1:
        reading.expected("xy, xz or yz", "'plane'", node)
        return None
    particles: tuple[Particle, ...] = reading.values.get("particles", ())
    equations = tuple(
        helper_equation(f"{component(across[0], p.name)} = 0", node.mark, reading)
        for p in particles
    )
    constraint = Constraint("plane", node.mark, equations) if equations else None
    return PlaneSection(node.mark, AXES.index(across[0]), constraint)


def _gravity(node: Mapping, what: str, reading: Reading) -> str | None:
    """Write out V = −m g·r for every particle; g points along −z, or along ``direction``."""
    fields = reading.fields(node, what, ("gravity", "direction"))
    strength = helper_part(fields["gravity"], "gravity", what, reading)
    down: tuple[str, ...] | None = ("", "", "-1")
    if "direction" in fields:
        down = _direction(fields["direction"], what, reading)
    particles: tuple[Particle, ...] = reading.values.get("particles", ())
    if not particles and reading.knows_bodies:
        reading.problems.add(f"gravity in {what} acts on no particle", node.mark, rule="missing")
    if strength is None or down is None or not particles:
        return None
    if reading.in_family:
        charge_helper(_TERMS_OF_WEIGHT * len(particles), place_of(node), reading)
    # Against an axis, V = + m g z is what a person writes.
    against = [part for part in down if part] == ["-1"]
    along = tuple(part.removeprefix("-") for part in down) if against else down
    terms = [
        f"{as_factor(p.mass)}*{as_factor(strength)}*{_projection(along, p.name)}" for p in particles
    ]
    return " + ".join(terms) if against else "-" + " - ".join(terms)


def _projection(direction: tuple[str, ...], name: str) -> str:
    """Write the component of a particle's position along a direction, as a factor."""
    parts = []
    for axis, factor in zip(AXES, direction, strict=True):
        if factor:
            coordinate = component(axis, name)
            parts.append(
                {"1": coordinate, "-1": f"-{coordinate}"}.get(factor, f"{factor}*{coordinate}")
            )
    return parts[0] if len(parts) == 1 else f"({' + '.join(parts)})"


def _direction(node: SourceNode, what: str, reading: Reading) -> tuple[str, ...] | None:
    """Return the unit vector of a direction, as texts; an empty text is a component 0."""
    wanted = "a list of three components"
    sequence = reading.items(node, f"'direction' of {what}", wanted)
    if sequence is None:
        return None
    parts = [helper_part(item, "direction", what, reading) for item in sequence.items]
    known = [part for part in parts if part is not None]
    if len(parts) != 3:
        reading.expected(wanted, f"'direction' of {what}", sequence)
    if len(parts) != 3 or len(known) != 3:
        return None
    constants = []
    for part in known:
        with reading.problems.collect_at(part):
            constants.append(extent_of(part.node, {}).value)
    if len(constants) != 3:
        return None
    exact = [c for c in constants if isinstance(c, Fraction)]
    length = _norm(exact)
    if len(exact) == 3 and length == 0:
        reading.problems.add("this direction has no length", sequence.mark, rule="direction")
        return None
    if len(exact) == 3 and length is not None:
        units = [c / length for c in exact]
        return tuple("" if u == 0 else f"{u}" if u.denominator == 1 else f"({u})" for u in units)
    unit = is_unit([part.node for part in known])
    norm = "" if unit else f"/norm({', '.join(flat(part) for part in known)})"
    return tuple(
        "" if c == 0 else f"{as_factor(part)}{norm}"
        for c, part in zip(constants, known, strict=True)
    )


def is_unit(components: list[Node]) -> bool:
    """Say whether a vector has length 1 whatever its names stand for, such as (sin a, 0, cos a).

    It is tried at several points. Lengths are analytic in the names, so that
    one that is 1 at all of them is 1.
    """
    names = sorted({name.name for part in components for name in names_in(part)})
    for trial in range(5):
        values = {
            name: Extent(0.61803 + 0.31831 * trial + 0.43429 * i * (trial + 1))
            for i, name in enumerate(names)
        }
        try:
            lengths = [extent_of(part, values).value for part in components]
            length = math.hypot(*(math.nan if v is None else float(v) for v in lengths))
        except (ExpressionError, OverflowError):
            return False
        if not abs(length - 1) <= 1e-13:
            return False
    return True


def _norm(components: list[Fraction]) -> Fraction | None:
    """Return the length of a vector if it is rational, else None."""
    square = sum((c * c for c in components), Fraction(0))
    root = Fraction(math.isqrt(square.numerator), math.isqrt(square.denominator))
    return root if root * root == square else None


def _spring(node: Mapping, what: str, reading: Reading) -> str | None:
    """Write out V = ½ k (|r_A − r_B| − l0)²; l0 is 0 if not given."""
    fields = reading.fields(
        node, what, ("spring", "stiffness", "length"), required=("spring", "stiffness")
    )
    pair = body_pair(fields["spring"], "spring", what, reading)
    stiffness = length = None
    if "stiffness" in fields:
        stiffness = helper_part(fields["stiffness"], "stiffness", what, reading)
    if "length" in fields:
        length = helper_part(fields["length"], "length", what, reading)
        if length is None:
            return None
    if pair is None or stiffness is None:
        return None
    along = differences(*pair)
    reading.links.append(Link("spring", pair, stiffness))
    if length is None:
        stretch = f"({' + '.join(f'({d})^2' for d in along)})"
    else:
        stretch = f"(norm({', '.join(along)}) - {as_factor(length)})^2"
    return f"1/2*{as_factor(stiffness)}*{stretch}"


#: Helpers of ``potentials`` by their keys: the potential as text of the scene language, or None
#: where a problem was recorded. docs/scene-language.md explains each to users.
_POTENTIALS: dict[str, Callable[[Mapping, str, Reading], str | None]] = {
    "gravity": _gravity,
    "spring": _spring,
    "newton": newton,
    "coulomb": coulomb,
}
