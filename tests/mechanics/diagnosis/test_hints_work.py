"""Hints that propose lines of a scene work where they are pasted."""

from __future__ import annotations

import re
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text

generated = settings(deadline=None, derandomize=True, max_examples=20)

P = "particles: {p: {mass: 1, position: [x, y, z]}}\n"
WHEEL = (
    "parameters: {m: 1, J: 2, R: 0.5, M: 1}\nparticles: {c: {mass: m, position: [s, 0, 0]}}\n"
    "coordinates: [s, psi]\nkinetic: {spin: J/2*dot(psi)^2}\n"
)
ROLLED = WHEEL.replace("[s, psi]", "[s]")
ROD = (
    "parameters: {m: 1, r: 0.4}\ncoordinates: [x, y, q1]\n"
    "particles: {centre: {mass: m, position: [x + r*cos(q1), y + r*sin(q1), 0]}}\n"
)
ARM = "particles: {p: {mass: 1, position: [r*sin(theta), 0, -r*cos(theta)]}}\n"

#: Scenes that are refused, by the rule; what their hints propose is accepted at once.
REFUSED = {
    "rolling": (WHEEL + "constraints: {rolling: s = R*psi}\n", "too-many"),
    "rolling, started": (
        WHEEL + "constraints: {rolling: s = R*psi}\ninitial: {s: 1, psi: 2, dot(psi): 3}\n",
        "too-many",
    ),
    "rolling, driven at the wheel": (
        WHEEL + "constraints: {rolling: s = R*psi}\nforces: {motor: {on: psi, force: M}}\n",
        "too-many",
    ),
    "rolling, driven at the centre": (
        WHEEL + "constraints: {rolling: s = R*psi}\nforces: {push: {on: s, force: M}}\n",
        "too-many",
    ),
    "rolling, as a square": (
        WHEEL + "constraints: {rolling: (s - R*psi)^2 = 0}\ninitial: {s: 1, psi: 2}\n",
        "singular",
    ),
    "rolling, either way": (WHEEL + "constraints: {rolling: s^2 = R^2*psi^2}\n", "ambiguous"),
    "rolling, or at rest": (WHEEL + "constraints: {rolling: s*(s - R*psi) = 0}\n", "ambiguous"),
    "rolling, either way, the angle not declared": (
        ROLLED + "constraints: {rolling: s^2 = R^2*psi^2}\n",
        "ambiguous",
    ),
    "rolling, as a square, the angle not declared": (
        ROLLED + "constraints: {rolling: (s - R*psi)^2 = 0}\n",
        "singular",
    ),
    "rolling, started elsewhere": (
        ROLLED + "constraints: {rolling: s = R*psi}\ninitial: {s: 1, psi: 0, dot(psi): 1}\n",
        "initial",
    ),
    "turning, the angle not declared": (
        ROLLED + "constraints: {rolling: s = R*sin(psi)}\n",
        "ambiguous",
    ),
    "no inertia of its own": (ROD, "dependent"),
    "no inertia, started": (ROD + "initial: {x: 1, y: 2, q1: 0.3, dot(q1): 1}\n", "dependent"),
    "no inertia, turned": (ROD + "forces: {t: {on: q1, force: 1}}\n", "dependent"),
    "no inertia, near": (ROD + "near: {x: 1, q1: 0.3}\n", "dependent"),
    "no inertia, elastic": (
        ROD + "potentials: {s: q1^2}\ndissipation: {d: dot(q1)^2}\noutputs: {o: sin(q1)}\n",
        "dependent",
    ),
    "fixed": (
        ARM + "coordinates: [r, theta]\nconstraints: {c: theta = 1}\ninitial: {theta: 1, r: 2}\n",
        "too-many",
    ),
    "spiral": (
        ARM + "coordinates: [r, theta]\nconstraints: {c: r = 2 + theta^2}\n"
        "initial: {r: 2.25, theta: 0.5}\n",
        "too-many",
    ),
    "rates": (P + "coordinates: [x, y, z]\nconstraints: {a: dot(x) = y, b: dot(x) = z}\n", "incon"),
    "rates, undeclared": (P + "constraints: {a: dot(x) = y, b: dot(x) = z}\n", "incon"),
    "squares": (P + "coordinates: [x, y, z]\nconstraints: {c: x^2 + (y - z)^2 = 0}\n", "singular"),
    "few": (P + "constraints: {plane: y = 0}\ncoordinates: [x]\n", "too-few"),
    "few, of which one follows": (
        P + "constraints: {w: y + y^5 = x}\ncoordinates: [x]\n",
        "too-few",
    ),
    "few of many": (
        "particles: {p: {mass: 1, position: [x, y, z]}, q: {mass: 1, position: [u, v, w]}}\n"
        "constraints: {w: y + y^5 = x, k: u + sin(u) + z = w}\ncoordinates: [x]\n",
        "too-few",
    ),
    "sum": (
        "coordinates: [a, b]\nparticles: {p: {mass: 1, position: [a + b, 0, 0]}}\n"
        "initial: {a: 1, b: 2, dot(a): 3}\n",
        "dependent",
    ),
}


def refusal(text: str) -> Problem | None:
    try:
        derive(read_text("name: s\n" + text))
    except InputError as error:
        return error.problems[0]
    return None


def proposed(hint: str) -> dict[str, Any]:
    """The sections and constraints that the lines of a hint give."""
    found: dict[str, Any] = {}
    for line in hint.splitlines():
        if re.match(r"\w+: [^ ]", line):
            found |= yaml.load(line, yaml.BaseLoader)
    return found


def pasted(scene: str, lines: dict[str, Any]) -> str:
    tree = yaml.load(scene, yaml.BaseLoader)
    for key, value in lines.items():
        (tree["constraints"] if key in tree.get("constraints", {}) else tree)[key] = value
    return yaml.safe_dump(tree, sort_keys=False, width=10000)


@pytest.mark.slow
@pytest.mark.parametrize("name", REFUSED)
def test_what_is_proposed_is_accepted(name: str) -> None:
    scene, rule = REFUSED[name]
    problem = refusal(scene)
    assert problem is not None
    assert problem.rule.startswith(rule)
    lines = proposed(problem.hint)
    assert lines
    assert refusal(pasted(scene, lines)) is None


@pytest.mark.parametrize(
    "scene",
    [
        WHEEL + "constraints: {rolling: s = R*psi}\n"
        "forces: {motor: {on: psi, force: M}, push: {on: s, force: M}}\n",
        WHEEL + "constraints: {rolling: s = R*psi}\nexpect: {cyclic: [s, psi]}\n",
        "coordinates: [a, b]\nparticles: {p: {mass: 1, position: [a + b, 0, 0]}}\n"
        "forces: {f: {on: a, force: 1}, g: {on: b, force: 1}}\n",
    ],
)
def test_no_lines_are_proposed_that_would_not_do(scene: str) -> None:
    """Where a force acts on each of the coordinates, none can be left out just so."""
    problem = refusal(scene)
    assert problem is not None
    assert problem.hint
    assert proposed(problem.hint) == {}


CONSTRAINTS = {
    "a = 2*b": {"a": "2", "b": "1"},
    "a = b^2 + 1": {"a": "2", "b": "1"},
    "b = 1": {"b": "1"},
    "(a - 2*b)^2 = 0": {"a": "2", "b": "1"},
    "a*(a - 2*b) = 0": {"a": "2", "b": "1"},
    "exp(a) = 2 + b": {"a": "log(3)", "b": "1"},
    "": {"a": "2", "b": "1"},
}
#: A particle that both coordinates move, in one way or in two, or one of them alone.
PLACES = ("[a, 0, 0]", "[a + b, 0, 0]", "[a*cos(b), a*sin(b), 0]", "[sin(a), cos(b), 0]")
USES = {
    "kinetic": ("kinetic", "{k: dot(b)^2}"),
    "potential": ("potentials", "{v: b^2 + a}"),
    "dissipation": ("dissipation", "{d: dot(a)^2}"),
    "output": ("outputs", "{o: a*dot(b)}"),
    "force on a": ("forces", "{f: {on: a, force: 1}}"),
    "force on b": ("forces", "{f: {on: b, force: -b}}"),
    "abbreviation": ("definitions", "{w: dot(b)}"),
}


@pytest.mark.slow
@generated
@given(
    st.sampled_from(sorted(CONSTRAINTS)),
    st.sampled_from(PLACES),
    st.sets(st.sampled_from(sorted(USES)), max_size=4),
    st.sampled_from(["", "initial", "near"]),
)
def test_pasting_leads_to_a_scene_that_works(
    constraint: str, place: str, uses: set[str], section: str
) -> None:
    """Within three pastes, each of another problem, or to a hint in words."""
    sections = {"coordinates": "[a, b]", "particles": f"{{p: {{mass: 1, position: {place}}}}}"}
    if constraint:
        sections["constraints"] = f"{{c: '{constraint}'}}"
    sections |= dict(USES[use] for use in sorted(uses))
    if section:
        given = ", ".join(f"{k}: {v}" for k, v in CONSTRAINTS[constraint].items())
        sections[section] = f"{{{given}}}"
    scene = "".join(f"{name}: {text}\n" for name, text in sections.items())
    seen = set[str]()
    for _ in range(3):
        problem = refusal(scene)
        if problem is None or not proposed(problem.hint):
            break
        assert problem.message not in seen
        seen.add(problem.message)
        scene = pasted(scene, proposed(problem.hint))
    else:
        assert refusal(scene) is None
    if seen and problem is not None:
        assert problem.rule in ("no-inertia", "too-many-coordinates", "dependent-coordinates")
