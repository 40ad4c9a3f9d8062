"""Texts and tokens of modules that languages share: projection, contacts, events, scripts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from lagrange_cli.emit.fixed_steps import FIXED_STEPS, FixedStep, step_lines
from lagrange_cli.emit.languages.printer import Language
from lagrange_cli.emit.template_files import filled, template
from lagrange_cli.program.lowered.routines.impacts import INSTANT
from lagrange_cli.program.lowered.routines.projection import START_TOLERANCE
from lagrange_cli.program.solvers.tolerances import MOST_EVENTS_A_STEP, MOST_REBOUNDS

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: Returns tokens of a language, for a method.
StepTokens: TypeAlias = Callable[[FixedStep], Mapping[str, str]]


def projection_text(
    language: Language, folder: str, name: str, positions: str, further: Mapping[str, str]
) -> str:
    """Return the function ``project`` from its templates; nothing of scenes without closures.

    ``further``: tokens of the language.
    """
    interface = language.interface
    projection = interface.projection
    if projection is None:
        return ""
    language.routines |= {"lead_velocities", *(["is_near"] if interface.closed else [])}
    if projection.positions:
        language.routines.add("lead_positions")
    leading = template(folder, positions).rstrip() if projection.positions else ""
    replacements = {
        "@POSITIONS@": leading,
        "@HANDED@": ", ".join(language.handed("closures")),
        "@M@": str(projection.positions),
        "@CLOSURES@": str(projection.closures),
        "@STATES@": "2 * N + M" if interface.states else "2 * N",
        **further,
    }
    return filled(template(folder, name), replacements)


def contact_tokens(language: Language) -> dict[str, str]:
    """Return the tokens that functions of contacts share, and note the routines that they call."""
    interface, contacts = language.interface, language.interface.contacts
    if contacts is None:
        return {}
    language.routines |= {"falling", "reset_contacts"}
    return {
        "@C@": str(contacts.count),
        "@TWICE@": str(2 * contacts.count),
        "@N@": str(len(interface.coordinates)),
        "@STATES@": str(interface.layout.size),
        "@CLOSURES@": str(contacts.closures),
        "@FORCES@": str(contacts.multipliers),
        "@CONSTRAINTS@": str(prod(contacts.public["constraints"].shape)),
        "@HANDED@": ", ".join(language.handed("contacts")),
        "@INSTANT@": repr(INSTANT),
    }


def switch_tokens(language: Language) -> dict[str, str]:
    """Return the tokens of functions of states with two values, and note the routine behind."""
    language.routines.add("change_values")
    interface = language.interface
    return {
        "@S@": str(len(interface.switches.names)),
        "@SIZE@": str(interface.layout.size),
        "@HANDED@": ", ".join(language.handed("relays")),
        "@PLACES@": ", ".join(map(str, interface.switches.places)),
    }


@dataclass(frozen=True)
class Steps:
    """Functions of fixed steps that a module is to hold: their names, and the errors measured."""

    equations: Equations
    names: Sequence[str]
    errors: Mapping[str, str]


def step_texts(
    language: Language, steps: Steps, text: str, failure: str, comment: str, further: StepTokens
) -> list[str]:
    """Return functions of fixed steps, and note the routines behind.

    Parameters
    ----------
    text
        Template of a function.
    failure
        What it gives where a step has no result.
    comment
        What begins each line of its documentation.
    further
        Returns tokens of the language, for the method.
    """
    texts = []
    for name in steps.names:
        method = FIXED_STEPS[name]
        language.routines.add(method.routine)
        lines = step_lines(steps.equations, name, steps.errors, failure, 100 - len(comment))
        tokens = {
            "@NOTES@": "\n".join(f"{comment}{line}" for line in lines),
            "@STEP@": name,
            "@ROUTINE@": method.routine,
            "@HANDED@": ", ".join(language.handed("dynamics")),
            "@SIZE@": str(language.interface.layout.size),
        }
        texts.append(filled(text, {**further(method), **tokens}).rstrip())
    return texts


#: Tokens of scripts that follow contacts.
SCRIPT_TOKENS = {
    "@EVENTS@": str(MOST_EVENTS_A_STEP),
    "@BOUNCES@": str(MOST_REBOUNDS),
    "@TOLERANCE@": repr(START_TOLERANCE),
}
