"""Checks of inputs and states, which stand nowhere that their rates would have to be known."""

from __future__ import annotations

from lagrange_cli.scene.checks.dependencies import ExpressionTraits
from lagrange_cli.scene.checks.uses import Use
from lagrange_cli.scene.language.expression import TIME_DERIVATIVES, Call, names_in, walk
from lagrange_cli.scene.language.problems import Problems
from lagrange_cli.scene.model import Scene


def check_inputs(
    use: Use, names: dict[str, ExpressionTraits], scene: Scene, problems: Problems
) -> None:
    """Refuse inputs where their rates would be needed, which nothing gives."""
    whole = [
        n
        for n in walk(use.expression.node)
        if isinstance(n, Call) and n.function in TIME_DERIVATIVES
    ]
    for node in whole if use.place.inputs else [use.expression.node]:
        for name in names_in(node):
            first_input = names.get(name.name, ExpressionTraits()).first_input
            if first_input:
                where = f"dot(...) in {use.what}" if use.place.inputs else use.what
                problems.add(
                    f"the input '{first_input}' cannot stand in {where}",
                    use.expression.mark(name.span),
                    hint=f"its rate would be needed; {without_rate(scene, first_input)}",
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


def without_rate(scene: Scene, name: str) -> str:
    """Return advice on replacing an input whose rate would be needed."""
    declared = next(u for u in scene.inputs if u.name == name)
    if declared.recording is None:
        return "what is known in advance can be written as a definition in t"
    return (
        "it is not taken from files, but a force can follow the input:"
        f" {{on: x, force: c*({name} - dot(x))}}"
    )
