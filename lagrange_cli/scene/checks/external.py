"""Checks of inputs and states where rates would have to be known, inputs that have two, and inputs
that controllers hold."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from lagrange_cli.errors import Mark
from lagrange_cli.scene.checks.dependencies import NONSMOOTH, ExpressionTraits
from lagrange_cli.scene.checks.uses import Use, uses
from lagrange_cli.scene.declared_numbers import DeclaredInput
from lagrange_cli.scene.language.expression import (
    TIME_DERIVATIVES,
    Call,
    Node,
    Number,
    names_in,
    walk,
)
from lagrange_cli.scene.language.problems import Problems, shown, suggestion
from lagrange_cli.scene.model import Scene


def check_inputs(
    use: Use, names: Mapping[str, ExpressionTraits], scene: Scene, problems: Problems
) -> None:
    """Refuse inputs where their rates are needed, but those that have two."""
    whole = [
        n
        for n in walk(use.expression.node)
        if isinstance(n, Call) and n.function in TIME_DERIVATIVES
    ]
    for node in whole if use.place.inputs else [use.expression.node]:
        for name in names_in(node):
            first_input = names.get(name.name, ExpressionTraits()).first_input
            reason = without_rate(scene, first_input) if first_input else ""
            if reason:
                where = f"dot(...) in {use.what}" if use.place.inputs else use.what
                problems.add(
                    f"the input '{first_input}' cannot stand in {where}",
                    use.expression.mark(name.span),
                    hint=f"its rates are needed; {reason}",
                    rule="misplaced-input",
                )
                return


def check_states(use: Use, names: dict[str, ExpressionTraits], problems: Problems) -> None:
    """Refuse states where their rates, or momenta with them, would be needed."""
    whole = [
        n
        for n in walk(use.expression.node)
        if isinstance(n, Call) and n.function in TIME_DERIVATIVES
    ]
    for node in whole if use.place.states else [use.expression.node]:
        for name in names_in(node):
            first_state = names.get(name.name, ExpressionTraits()).first_state
            if first_state:
                where = f"dot(...) in {use.what}" if use.place.states else use.what
                problems.add(
                    f"the state '{first_state}' cannot stand in {where}",
                    use.expression.mark(name.span),
                    hint="its rate is what 'states' says: write that"
                    if use.place.states
                    else "states stand in forces, potentials, dissipation, outputs and rates:"
                    " positions, constraints and masses do not follow them",
                    rule="misplaced-state",
                )
                return
    if not use.place.switches:
        _check_switches(use, names, problems)


def _check_switches(use: Use, names: dict[str, ExpressionTraits], problems: Problems) -> None:
    """Refuse states with two values in an energy, which would jump without work."""
    for name in names_in(use.expression.node):
        first_switch = names.get(name.name, ExpressionTraits()).first_switch
        if first_switch:
            problems.add(
                f"the state '{first_switch}' has two values and cannot stand in {use.what}",
                use.expression.mark(name.span),
                hint="energy would jump where it switches: write a force, as"
                f" {{on: x, force: -k*x*{first_switch}}}",
                rule="misplaced-state",
            )
            return


def check_controllers(scene: Scene, problems: Problems) -> None:
    """Refuse what controllers hold if it is no input, has a value, or is held twice."""
    inputs = {u.name: u for u in scene.inputs}
    first: dict[str, Mark] = {}
    for controller in scene.controllers:
        for setting in controller.held_inputs:
            declared = inputs.get(setting.name)
            if declared is None:
                problems.add(
                    f"a controller holds {shown(setting.name)}, which is no input",
                    setting.mark,
                    hint=suggestion(setting.name, inputs, f"inputs: [{setting.name}] declares it"),
                    rule="unknown-name",
                )
            elif not _is_free(declared):
                problems.add(
                    f"a controller holds '{setting.name}', which has a value of its own",
                    setting.mark,
                    hint=f"inputs: [{setting.name}] declares it without one",
                    rule="clash",
                )
            elif setting.name in first:
                problems.add(
                    f"'{setting.name}' is held twice",
                    setting.mark,
                    hint=f"it is held first on line {first[setting.name].line}",
                    rule="duplicate",
                )
            first.setdefault(setting.name, setting.mark)


def _is_free(declared: DeclaredInput) -> bool:
    """Tell whether an input is 0 unless something gives it a value."""
    expression = declared.expression
    return (
        expression is not None and isinstance(expression.node, Number) and not expression.node.value
    )


def without_rate(scene: Scene, name: str) -> str:
    """Say why an input has no two rates, and what does; empty if it has."""
    if any(u.name == name for c in scene.controllers for u in c.held_inputs):
        return "held by a controller it jumps at each sample"
    declared = next(u for u in scene.inputs if u.name == name)
    if declared.recording is not None:
        if declared.recording.interpolation == "cubic":
            return ""
        kind = declared.recording.interpolation
        return f"rows joined with 'interpolation: {kind}' have none: write 'interpolation: cubic'"
    assert declared.expression is not None
    for part in walk(declared.expression.node):
        if isinstance(part, Call) and part.function in NONSMOOTH:
            return f"{part.function}(...) has none everywhere: a smooth function of t does"
    return ""


def rated_inputs(scene: Scene, cartesian: Iterable[str]) -> frozenset[str]:
    """Names of the inputs that stand where their rates are needed, and have them.

    Those are positions, constraints, ``dot(...)`` and the kinetic energy.
    """
    known = {u.name for u in scene.inputs}
    if not known:
        return frozenset()
    meanings = {d.name: d.expression for d in scene.definitions}
    named: set[str] = set()
    pending: list[Node] = []
    kinetic = {id(term.expression) for term in scene.kinetic}
    for use in uses(scene, cartesian):
        is_whole = not use.place.inputs and use.place.names == "all"
        if is_whole or id(use.expression) in kinetic:
            pending.append(use.expression.node)
        elif use.place.names == "all":
            pending += [
                n
                for n in walk(use.expression.node)
                if isinstance(n, Call) and n.function in TIME_DERIVATIVES
            ]
    while pending:
        for name in {n.name for n in names_in(pending.pop())} - named:
            named.add(name)
            if name in meanings:
                pending.append(meanings[name].node)
    return frozenset(name for name in named & known if not without_rate(scene, name))
