"""Values given beside the scene: ``-p NAME=VALUE``, ``-i NAME=VALUE``, ``--until``, ``--from``."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from lagrange_cli.errors import InputError, Mark, Problem
from lagrange_cli.scene.conditions import InitialValue
from lagrange_cli.scene.language.expression import Expression
from lagrange_cli.scene.language.families import read_expression, whole_number
from lagrange_cli.scene.language.problems import Problems, shown, suggestion
from lagrange_cli.scene.model import Scene
from lagrange_cli.scene.unit_table import or_product, value_and_unit

_VELOCITY = re.compile(r"\s*dot\s*\(\s*(.*\S)\s*\)\s*")


def initial_name(text: str) -> tuple[str, int]:
    """Return the name and the order of ``x`` (0) or ``dot(x)`` (1)."""
    velocity = _VELOCITY.fullmatch(text)
    return (velocity[1], 1) if velocity else (text, 0)


def given_size(name: str, text: str, problems: Problems) -> int | None:
    """Read the value of a size that is given as ``-p NAME=VALUE``."""
    expression, _ = _given("-p", name, text, {}, problems)
    if expression is None:
        return None
    with problems.collect_at(expression):
        value = whole_number(expression.node, {}, f"size '{name}'")
        if value >= 0:
            return value
        problems.add(f"size '{name}' is negative", expression.mark(), rule="shape")
    return None


def override_parameters(scene: Scene, values: Mapping[str, str], problems: Problems) -> Scene:
    """Replace the values of parameters and of inputs; sizes were replaced when they were read."""
    known = {parameter.name: parameter for parameter in scene.parameters}
    inputs = {declared.name: declared for declared in scene.inputs}
    sizes = {size.name: size.value for size in scene.sizes}
    for key, text in values.items():
        if key in sizes:
            continue
        expression, mark = _given("-p", key, text, sizes, problems)
        name = _without_blanks(key)
        if name in inputs and expression:
            inputs[name] = replace(inputs[name], expression=expression, recording=None)
        elif name not in known:
            hint = suggestion(name, known)
            problems.add(f"unknown parameter {shown(name)}", mark, hint=hint, rule="unknown-name")
        elif expression:
            known[name] = replace(known[name], value=expression)
    parameters, driven = tuple(known.values()), tuple(inputs.values())
    return replace(scene, parameters=parameters, inputs=driven)


def override_initial(scene: Scene, values: Mapping[str, str], problems: Problems) -> Scene:
    """Replace or add initial values; a name may be ``dot(x)``."""
    if not values:
        return scene
    initial = {(value.name, value.order): value for value in scene.initial}
    sizes = {size.name: size.value for size in scene.sizes}
    for key, text in values.items():
        expression, mark = _given("-i", key, text, sizes, problems)
        if expression:
            name, order = initial_name(_without_blanks(key))
            initial[name, order] = InitialValue(name, order, mark, expression)
    return replace(scene, initial=tuple(initial.values()))


def override_times(scene: Scene, times: Mapping[str, str]) -> Scene:
    """Replace ``until`` and ``start`` of the section ``simulate``, by expressions.

    Raises
    ------
    InputError
        Located in the option.
    """
    values: dict[str, Any] = {
        name: read_expression(text, Mark(f"--{name.replace('start', 'from')}", 1, 1, text))
        for name, text in times.items()
    }
    return replace(scene, simulate=replace(scene.simulate, **values))


def _without_blanks(name: str) -> str:
    """Remove blanks from the name of a family's element: ``x[1,2]``."""
    return name.replace(" ", "") if "[" in name else name


def _given(
    option: str, name: str, text: str, sizes: Mapping[str, int], problems: Problems
) -> tuple[Expression | None, Mark]:
    """Parse ``NAME=VALUE``: its expression and the place of ``NAME``."""
    shown = f"{name}={text}"
    mark = Mark(f"{option} {name}", 1, 1, shown, max(1, len(name)))
    with problems.collect():
        origin = replace(mark, column=len(name) + 2, length=max(1, len(text)))
        if parts := value_and_unit(text):
            hint = (
                f"write {option} {name}={parts[0]}, in the units of the scene{or_product(*parts)}"
            )
            said = f"'{text}' is a number with a unit"
            raise InputError(Problem(said, origin, hint, "syntax"))
        return read_expression(text, origin, values=sizes), mark
    return None, mark
