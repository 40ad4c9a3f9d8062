"""A potential that no motion changes is told, with the axes along which something moves."""

from __future__ import annotations

import pytest

from lagrange_cli import loads
from lagrange_cli.mechanics import reduce
from lagrange_cli.mechanics.dynamics.idle_potentials import idle_potential_warnings

SCENE = """
parameters: {{m: 1, M: 2, l: 1, g: 9.81}}
{plane}
particles: {{P: {{mass: m, position: {place}}}}}
coordinates: [{q}]
potentials: {{weight: "{weight}"}}
"""

PENDULUM = {"plane": "plane: xy", "place": "[l*sin(q), -l*cos(q), z]", "q": "q"}


def told(text: str) -> list[tuple[str, str]]:
    return [(p.message, p.hint) for p in idle_potential_warnings(reduce(loads(text).scene))]


def scene(weight: str, **changed: str) -> str:
    text = SCENE.format(**PENDULUM | {"weight": weight} | changed)
    return text.replace('"{', "{").replace('}"', "}")


@pytest.mark.parametrize("weight", ["{gravity: g}", "m*g*z", "m*g*(z + l)"])
def test_gravity_across_the_plane(weight: str) -> None:
    ((message, hint),) = told(scene(weight))
    assert message == "no motion changes potential 'weight'"
    assert hint == (
        "it acts along z; the particles move along x and y; gravity along -y is\n"
        "weight: {gravity: g, direction: [0, -1, 0]}"
    )
    assert not told(scene("{gravity: g, direction: [0, -1, 0]}"))


@pytest.mark.parametrize(
    ("weight", "hint"),
    [
        ("m*g*(x_P^2 + y_P^2)/2", "it has the same value at all positions"),
        ("m*g*sin(l*t)", "it holds neither a coordinate nor a velocity"),
        ("0", "it holds neither a coordinate nor a velocity"),
        ("m*g*z^2", "it acts along z; the particles move along x and y"),
    ],
)
def test_other_constants(weight: str, hint: str) -> None:
    assert [h for _, h in told(scene(weight))] == [hint]


@pytest.mark.parametrize("weight", ["m*g*y_P", "m*dot(q)*t", "m*(x_P^2 + 2*y_P^2)", "abs(x_P)"])
def test_what_moves_is_no_constant(weight: str) -> None:
    assert not told(scene(weight))


def test_an_upward_y_without_a_plane() -> None:
    ((_, hint),) = told(scene("{gravity: g}", plane="", place="[0, q, 0]"))
    assert hint.endswith("weight: {gravity: g, direction: [0, -1, 0]}")


def test_a_family_is_told_once_and_only_if_all_members_are_idle() -> None:
    text = """
sizes: {n: 3}
parameters: {k: 1}
particles: {"b[i=1..n]": {mass: 1, position: ["x[i]", 0, 0]}}
coordinates: ["x[i=1..n]"]
potentials: {"V[i=1..n]": "TERM"}
"""
    assert len(told(text.replace("TERM", "k*z_b[i]"))) == 1
    assert not told(text.replace("TERM", "k*x[i]^2*(i - 1)"))


def test_the_derivation_warns() -> None:
    derivation = loads(scene("{gravity: g}")).derive()
    known = {p.rule: p for p in derivation.equations.derivation.warnings}
    warning = known["idle-potential"]
    assert warning.severity == "warning"
    assert warning.mark is not None
    assert warning.mark.line == 6
