"""Helpers of interactions: attraction of masses and charges, drag, dampers.

Like other helpers they are written out as expressions that a user could have written. The parts
that all helpers share stand here too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import Call, Equation, Expression, Name, Number
from lagrange_cli.scene.language.families import written_equation, written_expression
from lagrange_cli.scene.language.grammar import parse_equation, parse_expression
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.language.templates import is_template, with_names_of, with_zero_indices
from lagrange_cli.scene.model import Force, Link, Particle, Point
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

#: The point that helpers may name without declaring it.
ORIGIN = "origin"

#: Names and numbers of the potential of one pair.
_TERMS_OF_PAIR = 16


def body_pair(node: SourceNode, helper: str, what: str, reading: Reading) -> tuple[str, str] | None:
    """Read two different particles or points."""
    wanted = "two particles or points [A, B]"
    sequence = reading.items(node, f"'{helper}'", wanted)
    if sequence is None:
        return None
    ends = [item for item in sequence.items if isinstance(item, Scalar)]
    if len(ends) != 2 or len(sequence.items) != 2:
        reading.expected(wanted, f"'{helper}'", sequence)
        return None
    first, second = (known_body(end, what, helper, reading) for end in ends)
    if first is None or second is None:
        return None
    if first == second:
        reading.problems.add(f"'{helper}' needs two different ends", ends[1].mark, rule="shape")
        return None
    return first, second


def known_body(end: Scalar, what: str, helper: str, reading: Reading) -> str | None:
    """Return the particle or point that a helper names; None if it is unknown."""
    name = reading.reference(end)
    if name == ORIGIN and name not in reading.bodies and reading.knows_bodies:
        zero = parse_expression("0", end.mark, exact=False)
        reading.add_point(Point(ORIGIN, end.mark, (zero, zero, zero)))
    if name is not None and name not in reading.bodies:
        if reading.may_be_a_body(name):
            return None
        place = f" of {what}" if reading.in_family else ""
        reading.problems.add(
            f"unknown particle or point {shown(name)} in '{helper}'{place}",
            end.mark,
            hint=suggestion(name, {*reading.bodies, ORIGIN}),
            rule="unknown-name",
        )
        return None
    return name


def differences(first: str, second: str) -> tuple[str, ...]:
    """Write the components of one position minus another."""
    return tuple(f"{component(a, first)} - {component(a, second)}" for a in AXES)


def helper_part(node: SourceNode, key: str, what: str, reading: Reading) -> Expression | None:
    """Read an expression that is given to the helper of ``what`` at ``key``."""
    expression = reading.expression(node, f"'{key}' of {what}")
    if expression:
        reading.helper_parts.append((expression, what))
    return expression


def charge_helper(terms: int, mark: Mark, reading: Reading) -> None:
    """Count names and numbers that a helper is written out to, before that is done.

    Raises
    ------
    InputError
        All together would be more than a scene may be written out to.
    """
    at = Expression(Name("", (0, 0)), "", mark, exact=False)
    with reading.writing_out(at, 0, ""):
        reading.budget.charge(terms, (0, 0))


def helper_expression(text: str, mark: Mark, reading: Reading) -> Expression:
    """Parse the expression that a helper at ``mark`` stands for; texts of one shape once."""
    key = with_zero_indices(text)
    template = reading.helper_templates.get(key)
    if template is not None:
        return Expression(with_names_of(template, text), text, mark, exact=False)
    functions = reading.functions
    parsed = parse_expression(text, mark, exact=False, limited=False, functions=functions)
    if is_template(parsed.node, text, reading.indices):
        reading.helper_templates[key] = parsed.node
    return written_expression(parsed, reading.indices, reading.budget)


def helper_equation(text: str, mark: Mark, reading: Reading) -> Equation:
    """Parse the equation that a helper at ``mark`` stands for."""
    functions = reading.functions
    parsed = parse_equation(text, mark, exact=False, limited=False, functions=functions)
    return written_equation(parsed, reading.indices, reading.budget)


def unknown_helper(node: Mapping, what: str, known: tuple[str, ...], reading: Reading) -> None:
    """Record a mapping that is no helper."""
    if not node.entries:
        reading.expected("an expression or a helper", what, node)
        return
    key = node.entries[0][0]
    hint = suggestion(key.text, known, f"known are {', '.join(known)}")
    reading.problems.add(
        f"unknown helper {shown(key.text)} in {what}", key.mark, hint=hint, rule="unknown-key"
    )


def flat(expression: Expression) -> str:
    """Return an expression's text on one line."""
    return " ".join(expression.text.split())


def as_factor(expression: Expression) -> str:
    """Return an expression's text, in parentheses unless it is a single term."""
    single = isinstance(expression.node, Number | Name | Call)
    return flat(expression) if single else f"({flat(expression)})"


def place_of(node: Mapping) -> Mark:
    """Return the place at which a helper is reported: its first key."""
    return node.entries[0][0].mark if node.entries else node.mark


def newton(node: Mapping, what: str, reading: Reading) -> str | None:
    """Write out V = −G m₁ m₂/r over all pairs, or one; ``masses`` are those of points."""
    fields = reading.fields(node, what, ("newton", "between", "masses"))
    strength = helper_part(fields["newton"], "newton", what, reading)
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
    """Write out V = k q₁ q₂/r over all pairs of charged particles and points."""
    fields = reading.fields(node, what, ("coulomb", "charges"), required=("coulomb", "charges"))
    strength = helper_part(fields["coulomb"], "coulomb", what, reading)
    charges = dict(_amounts(fields.get("charges"), "charges", what, reading))
    return _over_pairs(node, "", strength, charges, what, reading)


def _particles(reading: Reading) -> tuple[Particle, ...]:
    particles: tuple[Particle, ...] = reading.values.get("particles", ())
    return particles


def _amounts(
    node: SourceNode | None, key: str, what: str, reading: Reading
) -> list[tuple[str, Expression]]:
    """Read masses or charges of bodies by name, families written out."""
    if node is None:
        return []
    mapping = reading.mapping(node, f"'{key}' of {what}", "a mapping of particles and points")
    amounts = []
    for name, value in mapping.entries if mapping else ():
        for element in reading.elements(name):
            body = known_body(element, what, key, reading)
            amount = helper_part(value, key, what, reading)
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
    """Write the potential of all pairs with a particle; two points do not move each other."""
    if strength is None:
        return None
    moving = {p.name for p in _particles(reading)}
    pairs = len(amounts) * (len(amounts) - 1) // 2
    charge_helper(_TERMS_OF_PAIR * pairs, place_of(node), reading)
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
    """Write out a force −c v on a body, or −c q̇ on a coordinate."""
    fields = reading.fields(node, what, ("drag", "on"), required=("drag", "on"))
    coefficient = helper_part(fields["drag"], "drag", what, reading)
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
    """Write out forces ∓c ṡ along the line between two bodies, s their distance.

    They are written as −c (d·ḋ) d/d², which has no root and on a line is −c ḋ.
    """
    fields = reading.fields(
        node, what, ("damper", "coefficient"), required=("damper", "coefficient")
    )
    pair = body_pair(fields["damper"], "damper", what, reading)
    coefficient = None
    if "coefficient" in fields:
        coefficient = helper_part(fields["coefficient"], "coefficient", what, reading)
    if pair is None or coefficient is None:
        return ()
    along = differences(*pair)
    reading.links.append(Link("damper", pair, coefficient))
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
    components = tuple(helper_expression(part, place_of(node), reading) for part in parts)
    return Force(key.text, key.mark, on, at.mark, components)
