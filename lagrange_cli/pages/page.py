"""The HTML file of a moving system: emitted JavaScript, the page's own script, and its data.

The file loads nothing and runs nothing but its two scripts, whose hashes its
Content-Security-Policy names. Texts of the scene reach it as JSON, as text of HTML, or as comments
of the emitted module, escaped for each.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from html import escape
from pkgutil import get_data
from typing import TYPE_CHECKING, Any

from lagrange_cli.emit.languages.javascript import emit_javascript
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.notation.symbols import printable, text_prose
from lagrange_cli.pages.server import policy_hash
from lagrange_cli.pages.stage import drawn_equations, stage_of, with_held_states
from lagrange_cli.report.contents.derivation.documents import asked_document, titled
from lagrange_cli.report.document_options import DEFAULTS
from lagrange_cli.report.formats import spoken
from lagrange_cli.report.phrases.language import Language, language
from lagrange_cli.report.writers.html import STYLE, body_html
from lagrange_cli.simulate.model.labels import Labels, labels_of
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Parameter
    from lagrange_cli.simulate import Trajectory

#: The page's own script, in the order in which its files depend on each other.
_PARTS = (
    *("motion.js", "projection.js", "drawing.js", "plots.js", "dragging.js"),
    *("settings.js", "loop.js", "controls.js"),
)

#: Functions and constants of the emitted module that the page's script reads.
_EMITTED = ("rhs", "energy", "positions", "DEFAULTS", "INITIAL")

#: Those of contacts, of states with two values, and of both.
_EMITTED_OF_CONTACTS, _EMITTED_OF_SWITCHES = ("FLIGHT", "reset"), ("PLACES", "change")
_EMITTED_OF_EVENTS = ("falls", "first_due")

#: Those of them that take the values of inputs, where a scene has any.
_DRIVEN = ("rhs", "energy", "positions", "project", "reset", "change")

#: Most numbers of the simulated trajectory that a page holds, and its significant digits.
_MOST_NUMBERS, _DIGITS = 30_000, 12

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

#: Sections of the report that stand below the drawing.
_SECTIONS = "account,energies,equations,conserved"


def require_shown(equations: Equations) -> None:
    """Refuse equations that no page shows, before anything is simulated.

    Raises
    ------
    InputError
        The scene has no start.
    """
    if equations.system.initial is None:
        hint = "give the initial state in 'initial', and a value for every parameter"
        message = "a page shows a motion, and no start is known"
        raise InputError(Problem(message, hint=hint, rule="page"))


def page_of(equations: Equations, trajectory: Trajectory, code: str = "en") -> str:
    """Return the text of the HTML file.

    Parameters
    ----------
    equations
        Of a derivation, whose scene has a start.
    trajectory
        Of the scene's own parameters and start.
    code
        The language of the words.

    Raises
    ------
    InputError
        The scene has nothing that could be drawn, or JavaScript cannot hold it.
    """
    say = language(code)
    lines = ["<!DOCTYPE html>", *_head(equations, trajectory, say), "</html>"]
    return "\n".join(lines) + "\n"


def _head(equations: Equations, trajectory: Trajectory, say: Language) -> Iterator[str]:
    labels = labels_of(equations)
    drawn, samplers = with_held_states(drawn_equations(equations))
    style = STYLE + _resource("page.css")
    scripts = [_system(drawn), _script()]
    data = _json(_data(drawn, trajectory, labels, say, samplers, scripts[0]))
    policy = (
        f"default-src 'none'; script-src {' '.join(map(policy_hash, scripts))}; "
        f"style-src-elem {policy_hash(style)}; style-src-attr 'unsafe-inline'; "
        "base-uri 'none'; form-action 'none'"
    )
    yield f'<html lang="{say.code}">'
    yield "<head>"
    yield '<meta charset="utf-8">'
    yield f'<meta http-equiv="Content-Security-Policy" content="{policy}">'
    yield '<meta name="viewport" content="width=device-width, initial-scale=1">'
    yield '<meta name="generator" content="lagrange">'
    yield f"<title>{escape(text_prose(labels.title))}</title>"
    yield f"<style>{style}</style>"
    yield "</head>"
    yield "<body>"
    yield from _header(equations, say)
    yield _resource("page.html")
    yield f'<article id="report">\n{_report(equations, say)}\n</article>'
    yield f'<script type="application/json" id="data">{data}</script>'
    yield from (f'<script type="module">{script}</script>' for script in scripts)
    yield "</body>"


def _header(equations: Equations, say: Language) -> Iterator[str]:
    yield f"<header>\n{body_html(titled(equations), say)}\n</header>"


def _report(equations: Equations, say: Language) -> str:
    options = {**DEFAULTS, "sections": _SECTIONS, "language": say.code}
    document, _ = asked_document("html", equations, options, None)
    return body_html(replace(document, title="", description=""), say)


def _system(equations: Equations) -> str:
    """Return the emitted module, which hands its functions over to the page's script."""
    (module,) = emit_javascript(equations, {"jacobian": False}).values()
    system = equations.system
    exported = [*_EMITTED, *(["project"] if system.closures or system.contacts else [])]
    exported += _EMITTED_OF_CONTACTS if system.contacts else []
    exported += _EMITTED_OF_SWITCHES if system.switches else []
    exported += _EMITTED_OF_EVENTS if system.contacts or system.switches else []
    handed = [
        _with_inputs(name) if system.inputs and name in _DRIVEN else name for name in exported
    ]
    return f"\n{_within_html(module)}\nglobalThis.lagrangeSystem = {{ {', '.join(handed)} }};\n"


def _with_inputs(function: str) -> str:
    """Return a function that hands the scene's inputs to an emitted one, behind the parameters."""
    return f"{function}: (t, y, p, ...more) => {function}(t, y, p, inputs(t, y, p), ...more)"


def _within_html(module: str) -> str:
    """Return a module that no tag of HTML ends: only texts of the scene could hold one."""
    return re.sub(r"<(?=/script|script|!--)", r"\\u003c", module, flags=re.IGNORECASE)


def _script() -> str:
    return "\n" + "\n".join(map(_resource, _PARTS))


def _resource(name: str) -> str:
    data = get_data("lagrange_cli.pages", f"player/{name}")
    assert data is not None
    return data.decode("utf-8")


def _json(value: Any) -> str:
    """Return JSON that no tag of HTML ends."""
    text = json.dumps(value, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return text.replace("<", r"\u003c")


def _data(
    equations: Equations,
    trajectory: Trajectory,
    labels: Labels,
    say: Language,
    samplers: Sequence[dict[str, Any]],
    module: str,
) -> dict[str, Any]:
    system = equations.system
    sampling = {sampler["every"] for sampler in samplers if sampler["isParameter"]}
    sampled = {system.state_names[k] for sampler in samplers for k, _ in sampler["changes"]}
    held_names = {
        system.state_names[k]
        for sampler in samplers
        for k, _ in sampler["changes"][: sampler["held"]]
    }
    return {
        "energy": labels.energy,
        "coordinates": [
            {
                "name": c.name,
                "symbol": labels.symbol(c.name).plain,
                "rate": labels.symbol(f"dot({c.name})").plain,
                "isAngle": c.is_angle,
                "unit": _unit(labels, c.name),
                "rateUnit": _unit(labels, f"dot({c.name})"),
                "description": printable(c.description or ""),
                "scales": [trajectory.scales.get(n, 1.0) for n in (c.name, f"dot({c.name})")],
            }
            for c in system.coordinates
        ],
        "states": [
            {
                "name": state.name,
                "symbol": labels.symbol(state.name).plain,
                "unit": _unit(labels, state.name),
                "description": printable(state.description or ""),
                "scale": trajectory.scales.get(state.name, 1.0),
                "hasTwoValues": state.switch is not None,
                "isSampled": state.name in sampled,
                "isHeld": state.name in held_names,
            }
            for state in system.states
        ],
        "parameters": [
            _parameter(p, labels) | {"isRead": k in sampling or _reads(module, k)}
            for k, p in enumerate(system.parameters)
        ],
        "samplers": samplers,
        **_drawn(equations, say),
        "simulated": _simulated(trajectory, [state.name for state in system.states]),
        "words": _words(say),
    }


def _drawn(equations: Equations, say: Language) -> dict[str, Any]:
    """Return what is drawn, or why nothing is."""
    try:
        return {"stage": stage_of(equations)}
    except InputError as refusal:
        reason = "; ".join(spoken(problem.message, say.code) for problem in refusal.problems)
        return {"stage": None, "undrawn": reason}


def _parameter(parameter: Parameter, labels: Labels) -> dict[str, Any]:
    return {
        "name": parameter.name,
        "symbol": labels.symbol(parameter.name).plain,
        "unit": _unit(labels, parameter.name),
        "description": printable(parameter.description or ""),
        "isPositive": parameter.positive,
    }


def _reads(module: str, number: int) -> bool:
    """Say whether an emitted module reads a parameter; one of the start alone moves nothing."""
    by_name_alone = not re.search(r"\bp(?:\[(?!\d+\])|\.\w)", module)
    return not by_name_alone or f" p[{number}]" in module


def _unit(labels: Labels, name: str) -> str:
    """Return a unit as a person writes it: powers raised, factors with a dot between them."""
    unit = labels.unit(name)
    if unit is None:
        return ""
    raised = re.sub(r"\^(-?\d+)", lambda power: power[1].translate(_RAISED), unit.plain)
    return raised.replace("*", "·")


def _simulated(trajectory: Trajectory, states: Sequence[str]) -> dict[str, Any]:
    """Return samples of the trajectory, and what is said of it."""
    coordinates = trajectory.coordinates
    names = StateLayout(len(coordinates), len(states)).names(coordinates, states)
    apart = max(1, -(-len(trajectory.t) * len(names) // _MOST_NUMBERS))
    sampled = [*range(0, len(trajectory.t), apart)]
    if sampled[-1] != len(trajectory.t) - 1:
        sampled.append(len(trajectory.t) - 1)
    columns = [trajectory.t, *(trajectory.columns[name] for name in names)]
    return {
        "columns": [_numbers([float(column[k]) for k in sampled]) for column in columns],
        "reason": trajectory.reason,
    }


def _numbers(values: Sequence[float]) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def _words(say: Language) -> dict[str, str]:
    """Return key of the page's script → what it shows on buttons and in sentences."""
    return {
        "play": say("Play"),
        "pause": say("Pause"),
        "step": say("Step"),
        "reset": say("Reset"),
        "speed": say("Speed"),
        "time": say("Time"),
        "until": say("Until"),
        "trace": say("Traces"),
        "twin": say("Twin that starts 10⁻⁶ beside it"),
        "parameters": say("Parameters"),
        "start": say("Start"),
        "series": say("Coordinates over time"),
        "phase": say("Phase portrait"),
        "section": say("Poincaré section"),
        "sectionOf": say("where this coordinate passes its value upwards"),
        "noPassages": say("no passage so far"),
        "sectionAt": say("Value of the coordinate in the section"),
        "rateOf": say("rate of {name}", name="{name}"),
        "keys": say("Space plays and pauses, arrow keys step, Home returns to the start."),
        "turning": say("Shift with an arrow key turns the view."),
        "drift": say("Change of the energy"),
        "drawing": say("Drawing of the system; drag a body to a new start at rest"),
        "copied": say("The address of this page holds all settings."),
        "link": say("Link to these settings"),
        "method": say("This page integrates by Dormand and Prince's method of order 5."),
        "certified": say(
            "Largest difference from the simulated motion up to t = {t}: {size}.",
            t="{t}",
            size="{size}",
        ),
        "refined": say(
            "Largest difference from a run of a hundredth of the tolerance up to t = {t}: {size}.",
            t="{t}",
            size="{size}",
        ),
        "computing": say("The motion is being computed."),
        "failed": say("The motion ends here: its equations have no solution beyond this state."),
        "slow": say("The motion takes too many steps; it is shown up to here."),
        "unstarted": say(
            "No motion starts with these values: nothing near them satisfies the constraints."
        ),
        "recorded": say(
            "From t = {t} on the simulated motion is shown: that of this page ends or leaves it"
            " there, as where a body sticks.",
            t="{t}",
        ),
        "apart": say("Distance of the twins"),
    }
