"""Parts of one-line helpers: their bodies, differences of positions, factors."""

from __future__ import annotations

from lagrange_cli.errors import Mark
from lagrange_cli.scene.language.expression import Call, Expression, Name, Number
from lagrange_cli.scene.language.grammar import parse_expression
from lagrange_cli.scene.language.problems import shown, suggestion
from lagrange_cli.scene.model import Point
from lagrange_cli.scene.reading.declarations import AXES, component
from lagrange_cli.scene.reading.entries import Reading
from lagrange_cli.scene.reading.source import Mapping, Scalar, SourceNode

#: The point that helpers may name without declaring it.
ORIGIN = "origin"


def body_pair(node: SourceNode, helper: str, what: str, reading: Reading) -> tuple[str, str] | None:
    """Two different particles or points."""
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
    """A particle or point that a helper names."""
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
    """The components of one position minus another, as texts."""
    return tuple(f"{component(a, first)} - {component(a, second)}" for a in AXES)


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
    """An expression's text on one line."""
    return " ".join(expression.text.split())


def as_factor(expression: Expression) -> str:
    """An expression's text, in parentheses unless it is a single term."""
    single = isinstance(expression.node, Number | Name | Call)
    return flat(expression) if single else f"({flat(expression)})"


def place_of(node: Mapping) -> Mark:
    """The place at which a helper is reported: its first key."""
    return node.entries[0][0].mark if node.entries else node.mark
