"""Helpers of what acts between bodies: attraction of masses and charges, drag, dampers.

Like the others they are written out as the expressions that a user could have
written.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.model import Force, Link, Particle
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.helper_terms import (
    as_factor,
    body_pair,
    differences,
    known_body,
    place_of,
)
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

#: Names and numbers of the potential of one pair.
_TERMS_OF_PAIR = 16


def newton(node: Mapping, what: str, reading: Reading) -> str | None:
    """V = −G m₁ m₂/r over all pairs of particles, or one pair; ``masses`` are those of points."""
    fields = reading.fields(node, what, ("newton", "between", "masses"))
    strength = reading.helpers.part(fields["newton"], "newton", what, reading)
    masses = {p.name: p.mass for p in _particles(reading)}
    for name, mass in _amounts(fields.get("masses"), "masses", what, reading):
        if name in masses:
            mark = fields["masses"].mark
            message = f"'{name}' in 'masses' of {what} has its mass as a particle"
            reading.problems.add(message, mark, rule="clash")
        masses[name] = mass
    if "between" in fields:
        pair = body_pair(fields["between"], "between", what, reading)
        for name in pair or ():
            if name not in masses:
                message = f"the mass of the point '{name}' in {what} is not given"
                hint = f"add masses: {{{name}: ...}}"
                reading.problems.add(message, fields["between"].mark, hint=hint, rule="missing")
                return None
        masses = {name: masses[name] for name in pair or ()}
    return _over_pairs(node, "-", strength, masses, what, reading)


def coulomb(node: Mapping, what: str, reading: Reading) -> str | None:
    """V = k q₁ q₂/r over all pairs of charged particles and points."""
    fields = reading.fields(node, what, ("coulomb", "charges"), required=("coulomb", "charges"))
    strength = reading.helpers.part(fields["coulomb"], "coulomb", what, reading)
    charges = dict(_amounts(fields.get("charges"), "charges", what, reading))
    return _over_pairs(node, "", strength, charges, what, reading)


def _particles(reading: Reading) -> tuple[Particle, ...]:
    particles: tuple[Particle, ...] = reading.values.get("particles", ())
    return particles


def _amounts(
    node: SourceNode | None, key: str, what: str, reading: Reading
) -> list[tuple[str, Expression]]:
    """Masses or charges of bodies by name, families written out."""
    if node is None:
        return []
    mapping = reading.mapping(node, f"'{key}' of {what}", "a mapping of particles and points")
    amounts = []
    for name, value in mapping.entries if mapping else ():
        for element in reading.elements(name):
            body = known_body(element, what, key, reading)
            amount = reading.helpers.part(value, key, what, reading)
            if body is not None and amount is not None:
                amounts.append((body, amount))
    return amounts


def _over_pairs(
    node: Mapping,
    sign: str,
    strength: Expression | None,
    amounts: dict[str, Expression],
    what: str,
    reading: Reading,
) -> str | None:
    """The potential of all pairs that hold a particle; two points do not move each other."""
    if strength is None:
        return None
    moving = {p.name for p in _particles(reading)}
    pairs = len(amounts) * (len(amounts) - 1) // 2
    reading.helpers.charge(_TERMS_OF_PAIR * pairs, place_of(node), reading)
    terms = [
        f"{as_factor(strength)}*{as_factor(amounts[a])}*{as_factor(amounts[b])}"
        f"/norm({', '.join(differences(a, b))})"
        for a, b in combinations(amounts, 2)
        if a in moving or b in moving
    ]
    if not terms and not reading.problems.errors:
        reading.problems.add(
            f"no two bodies act on each other in {what}", node.mark, rule="missing"
        )
    if not terms:
        return None
    return "-" + " - ".join(terms) if sign == "-" else " + ".join(terms)


def drag(key: Scalar, node: Mapping, what: str, reading: Reading) -> tuple[Force, ...]:
    """A force −c v on a body, or −c q̇ on a coordinate."""
    fields = reading.fields(node, what, ("drag", "on"), required=("drag", "on"))
    coefficient = reading.helpers.part(fields["drag"], "drag", what, reading)
    on = fields.get("on")
    if on is not None and not isinstance(on, Scalar):
        reading.expected("a particle, point or coordinate", f"'on' of {what}", on)
    name = reading.reference(on) if isinstance(on, Scalar) else None
    if on is None or coefficient is None or name is None:
        return ()
    is_body = name in reading.bodies
    moving = [component(axis, name) for axis in AXES] if is_body else [name]
    parts = [f"-{as_factor(coefficient)}*dot({one})" for one in moving]
    return (_force(key, name, on, parts, node, reading),)


def damper(key: Scalar, node: Mapping, what: str, reading: Reading) -> tuple[Force, ...]:
    """Forces ∓c ṡ along the line between two bodies, s their distance.

    They are written as −c (d·ḋ) d/d², which has no root and on a line is −c ḋ.
    """
    fields = reading.fields(
        node, what, ("damper", "coefficient"), required=("damper", "coefficient")
    )
    pair = body_pair(fields["damper"], "damper", what, reading)
    coefficient = None
    if "coefficient" in fields:
        coefficient = reading.helpers.part(fields["coefficient"], "coefficient", what, reading)
    if pair is None or coefficient is None:
        return ()
    along = differences(*pair)
    reading.helpers.links.append(Link("damper", pair, coefficient))
    rate = " + ".join(f"({d})*dot({d})" for d in along)
    square = " + ".join(f"({d})^2" for d in along)
    size = f"{as_factor(coefficient)}*({rate})"
    return tuple(
        _force(
            key,
            name,
            fields["damper"],
            [f"{sign}{size}*({d})/({square})" for d in along],
            node,
            reading,
        )
        for sign, name in zip(("-", ""), pair, strict=True)
    )


def _force(
    key: Scalar, on: str, at: SourceNode, parts: Sequence[str], node: Mapping, reading: Reading
) -> Force:
    components = tuple(reading.helpers.expression(part, place_of(node), reading) for part in parts)
    return Force(key.text, key.mark, on, at.mark, components)
