"""Answers to an exercise: a YAML file with what somebody found of a scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from lagrange_cli.errors import Mark
from lagrange_cli.files import MAX_BYTES, read_bytes, too_large
from lagrange_cli.scene.language.expression import Equation, Expression
from lagrange_cli.scene.reading.entries import Reading, is_indexed
from lagrange_cli.scene.reading.source import Mapping as MappingNode
from lagrange_cli.scene.reading.source import Scalar, SourceNode, compose, decode

_KEYS = ("dof", "cyclic", "lagrangian", "equations", "conserved")


@dataclass(frozen=True)
class Answers:
    """Findings of somebody about a scene; keys that are absent are None.

    Attributes
    ----------
    dof
        Number of degrees of freedom.
    cyclic
        Names of the cyclic coordinates, each with its place.
    lagrangian
        L over coordinates and their rates.
    equations
        Equations of motion, in any form.
    conserved
        Names of conserved quantities, or expressions that are conserved.
    marks
        Key → its place.
    """

    dof: int | None
    cyclic: tuple[tuple[str, Mark], ...] | None
    lagrangian: Expression | None
    equations: tuple[Equation, ...] | None
    conserved: tuple[Expression, ...] | None
    marks: Mapping[str, Mark]


def read_answers(path: str, sizes: Mapping[str, int], functions: Mapping[str, int]) -> Answers:
    """Read answers to an exercise whose scene has these sizes and functions of its own.

    Raises
    ------
    InputError
        The file cannot be read, or is none of answers; every problem has its place.
    """
    data = read_bytes(path)
    if len(data) > MAX_BYTES:
        raise too_large(path)
    file = "<stdin>" if path == "-" else path
    # Sizes are indices with one value.
    reading = Reading(file, sizes=dict(sizes), indices=dict(sizes), functions=dict(functions))
    root = reading.mapping(compose(decode(data, file), file), "answers")
    nodes = {} if root is None else _fields(root, reading)
    answers = Answers(
        reading.integer(nodes["dof"], "'dof'") if "dof" in nodes else None,
        _names(nodes.get("cyclic"), reading),
        reading.expression(nodes["lagrangian"], "'lagrangian'") if "lagrangian" in nodes else None,
        _equations(nodes.get("equations"), reading),
        _quantities(nodes.get("conserved"), reading),
        {key: node.mark for key, node in nodes.items()},
    )
    reading.problems.raise_if_any()
    return answers


def _fields(root: MappingNode, reading: Reading) -> dict[str, SourceNode]:
    fields = reading.fields(root, "answers", _KEYS)
    if not fields and not reading.problems.errors:
        hint = f"known are {', '.join(_KEYS)}"
        reading.problems.add("there are no answers", root.mark, hint=hint, rule="shape")
    return fields


def _listed(
    node: SourceNode | None, what: str, wanted: str, reading: Reading
) -> tuple[SourceNode, ...] | None:
    sequence = None if node is None else reading.items(node, what, wanted)
    return None if sequence is None else sequence.items


def _names(node: SourceNode | None, reading: Reading) -> tuple[tuple[str, Mark], ...] | None:
    items = _listed(node, "'cyclic'", "a list of names", reading)
    if items is None:
        return None
    read = list[tuple[str, Mark]]()
    for item in items:
        if isinstance(item, Scalar) and is_indexed(item.text):
            read.extend((element.text, item.mark) for element in reading.elements(item))
        elif (text := reading.text(item, "'cyclic'")) is not None:
            read.append((text, item.mark))
    return tuple(read)


def _equations(node: SourceNode | None, reading: Reading) -> tuple[Equation, ...] | None:
    """Read a list of equations, or a mapping of names to equations, which may be families."""
    if isinstance(node, MappingNode):
        named = reading.named(node, "equations", symbols=False)
        read = [reading.equation(value, f"'{key.text}' of 'equations'") for key, value in named]
    else:
        items = _listed(node, "'equations'", "a list of equations", reading)
        if items is None:
            return None
        read = [reading.equation(item, "'equations'") for item in items]
    return tuple(equation for equation in read if equation is not None)


def _quantities(node: SourceNode | None, reading: Reading) -> tuple[Expression, ...] | None:
    items = _listed(node, "'conserved'", "a list of names or expressions", reading)
    if items is None:
        return None
    read = (reading.expression(item, "'conserved'") for item in items)
    return tuple(expression for expression in read if expression is not None)
