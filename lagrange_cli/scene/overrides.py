"""Values given beside the scene: ``-p NAME=VALUE`` and ``-i NAME=VALUE``."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from lagrange_cli.errors import Mark
from lagrange_cli.scene.conditions import initial_name
from lagrange_cli.scene.expression import Expression
from lagrange_cli.scene.grammar import parse_expression
from lagrange_cli.scene.model import InitialValue, Scene
from lagrange_cli.scene.problems import Problems, shown, suggestion

__all__ = ["override_initial", "override_parameters"]


def override_parameters(scene: Scene, values: Mapping[str, str], problems: Problems) -> Scene:
    """Replace the values of parameters."""
    known = {parameter.name: parameter for parameter in scene.parameters}
    for name, text in values.items():
        expression, mark = _given("-p", name, text, problems)
        if name not in known:
            hint = suggestion(name, known)
            problems.add(f"unknown parameter {shown(name)}", mark, hint=hint, rule="unknown-name")
        elif expression:
            known[name] = replace(known[name], value=expression)
    return replace(scene, parameters=tuple(known.values()))


def override_initial(scene: Scene, values: Mapping[str, str], problems: Problems) -> Scene:
    """Replace or add initial values; a name may be ``dot(x)``."""
    if not values:
        return scene
    found = {(value.name, value.order): value for value in scene.initial}
    for key, text in values.items():
        expression, mark = _given("-i", key, text, problems)
        if expression:
            name, order = initial_name(key)
            found[name, order] = InitialValue(name, order, mark, expression)
    return replace(scene, initial=tuple(found.values()))


def _given(option: str, name: str, text: str, problems: Problems) -> tuple[Expression | None, Mark]:
    """The expression of ``NAME=VALUE`` and the place of ``NAME``."""
    shown = f"{name}={text}"
    mark = Mark(f"{option} {name}", 1, 1, shown, max(1, len(name)))
    with problems.collect():
        return parse_expression(text, replace(mark, column=len(name) + 2)), mark
    return None, mark
