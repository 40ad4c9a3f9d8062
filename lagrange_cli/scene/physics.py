"""Reading the sections of mechanics: constraints, potentials, kinetic, forces, dissipation,
outputs."""

from __future__ import annotations

from lagrange_cli.scene.expression import Equation, Expression
from lagrange_cli.scene.helpers import read_constraint_helper, read_potential_helper
from lagrange_cli.scene.interactions import damper, drag
from lagrange_cli.scene.model import Constraint, Force, Term
from lagrange_cli.scene.shapes import Reading
from lagrange_cli.scene.source import Mapping, Scalar, Sequence, SourceNode

__all__ = [
    "read_constraints",
    "read_dissipation",
    "read_forces",
    "read_kinetic",
    "read_outputs",
    "read_potentials",
]

_FORCES = {"drag": drag, "damper": damper}


def read_constraints(node: SourceNode, reading: Reading) -> tuple[Constraint, ...]:
    found = []
    for key, value in reading.named(node, "constraints", symbols=False):
        equations = _equations(value, f"constraint '{key.text}'", reading)
        if equations:
            found.append(Constraint(key.text, key.mark, equations))
    return tuple(found)


def _equations(node: SourceNode, what: str, reading: Reading) -> tuple[Equation, ...] | None:
    if isinstance(node, Mapping):
        return read_constraint_helper(node, what, reading)
    items = node.items if isinstance(node, Sequence) else (node,)
    if not items:
        reading.expected("an equation", what, node)
    read = [reading.equation(item, what) for item in items]
    return tuple(equation for equation in read if equation)


def read_potentials(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    found = []
    for key, value in reading.named(node, "potentials", symbols=False):
        what = f"potential '{key.text}'"
        expression: Expression | None
        if isinstance(value, Mapping):
            expression = read_potential_helper(value, what, reading)
        else:
            expression = reading.expression(value, what)
        if expression:
            found.append(Term(key.text, key.mark, expression))
    return tuple(found)


def read_kinetic(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "kinetic", "kinetic energy", reading)


def read_dissipation(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "dissipation", "dissipation", reading)


def read_outputs(node: SourceNode, reading: Reading) -> tuple[Term, ...]:
    return _terms(node, "outputs", "output", reading, symbols=True)


def _terms(
    node: SourceNode, section: str, word: str, reading: Reading, *, symbols: bool = False
) -> tuple[Term, ...]:
    found = []
    for key, value in reading.named(node, section, symbols=symbols):
        expression = reading.expression(value, f"{word} '{key.text}'")
        if expression:
            found.append(Term(key.text, key.mark, expression))
    return tuple(found)


def read_forces(node: SourceNode, reading: Reading) -> tuple[Force, ...]:
    found: list[Force] = []
    for key, value in reading.named(node, "forces", symbols=False):
        found += _forces(key, value, reading)
    return tuple(found)


def _forces(key: Scalar, node: SourceNode, reading: Reading) -> tuple[Force, ...]:
    """The force of an entry; a damper is two."""
    what = f"force '{key.text}'"
    mapping = reading.mapping(node, what, "a mapping {on, force}")
    if mapping is None:
        return ()
    for name, _ in mapping.entries:
        if name.text in _FORCES:
            return _FORCES[name.text](key, mapping, what, reading)
    fields = reading.fields(mapping, what, ("on", "force"), required=("on", "force"))
    if len(fields) < 2:
        return ()
    on = fields["on"]
    components = _components(fields["force"], what, reading)
    if not isinstance(on, Scalar):
        reading.expected("a particle, point or coordinate", f"'on' of {what}", on)
        return ()
    target = reading.reference(on)
    if components is None or target is None:
        return ()
    return (Force(key.text, key.mark, target, on.mark, components),)


def _components(node: SourceNode, what: str, reading: Reading) -> tuple[Expression, ...] | None:
    """Three components of a Cartesian force, or one of a generalized force."""
    if not isinstance(node, Sequence):
        single = reading.expression(node, what)
        return (single,) if single else None
    read = [reading.expression(item, what) for item in node.items]
    if len(read) != 3:
        reading.expected("an expression or a list of three", what, node)
        return None
    components = tuple(part for part in read if part)
    return components if len(components) == 3 else None
