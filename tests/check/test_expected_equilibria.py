"""``check`` finds equilibria and frequencies that are not as expected."""

from __future__ import annotations

from pathlib import Path

import pytest

from lagrange_cli.check.check import check_scene

PENDULUM = """\
name: pendulum
parameters: {l: {value: 2, positive: true}, g: 9.81}
particles: {bob: {mass: 3, position: [x, 0, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
potentials: {weight: {gravity: g}}
initial: {theta: 0.1}
"""


def checked(tmp_path: Path, expect: str, scene: str = PENDULUM) -> list[str]:
    path = tmp_path / "scene.yaml"
    path.write_text(f"{scene}expect:\n{expect}")
    report = check_scene(str(path))
    assert report.outcome == ("fail" if report.problems else "pass"), report
    assert all(p.mark is not None for p in report.problems)
    return [p.message for p in report.problems]


@pytest.mark.parametrize(
    "expect",
    [
        "  equilibria: [{theta: 0, stability: stable}, {theta: pi, stability: unstable}]\n",
        "  equilibria: [{theta: -pi}]\n",
        "  equilibria: [{x: 0, z: -l}]\n",
        "  frequencies: [sqrt(g/l)]\n",
    ],
)
def test_what_is_so_passes(tmp_path, expect):
    assert checked(tmp_path, expect) == []


@pytest.mark.parametrize(
    ("expect", "message"),
    [
        ("  equilibria: [{theta: 1e-6}]\n", "this equilibrium is not found"),
        (
            "  equilibria: [{theta: pi, stability: stable}]\n",
            "expected 'stable', found: unstable",
        ),
        ("  equilibria: [{theta: pi, stability: steady}]\n", "there is no stability 'steady'"),
        (
            "  equilibria: [{phi: 0}]\n",
            "'phi' is no coordinate and no Cartesian name",
        ),
        (
            "  equilibria: []\n",
            "expected no equilibrium; found: theta = 0; theta = 3.14159265",
        ),
        (
            "  frequencies: [sqrt(g/l) + 1e-6]\n",
            "expected the frequencies 2.21472445904; found: 2.21472345904",
        ),
        ("  frequencies: []\n", "expected the frequencies none; found: 2.21472345904"),
    ],
)
def test_what_is_not_so_is_said(tmp_path, expect, message):
    assert checked(tmp_path, expect) == [message]


def test_no_equilibrium_where_none_is_found(tmp_path):
    falling = PENDULUM.replace("[x, 0, z]", "[0, 0, h]").replace("[theta]", "[h]")
    falling = falling.replace("definitions: {x: l*sin(theta), z: -l*cos(theta)}\n", "")
    falling = falling.replace("{theta: 0.1}", "{h: 0}")
    assert checked(tmp_path, "  equilibria: []\n", falling) == []
    assert checked(tmp_path, "  frequencies: [1]\n", falling) == ["there is no equilibrium"]


LEVER = """\
name: lever
parameters: {m: 2, a: {value: 1, positive: true}, b: {value: 4, positive: true}, F: 1, g: 9.81}
plane: xz
points: {grip: [b*cos(theta), 0, b*sin(theta)]}
particles: {load: {mass: m, position: [-a*cos(theta), 0, -a*sin(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
forces: {effort: {on: grip, force: [0, 0, -F]}}
"""


@pytest.mark.parametrize(
    ("law", "messages"),
    [
        ("m*g*a = b*F", []),
        ("[m*g*a = b*F]", []),
        ("m*g*a = 2*b*F", ["the forces do not balance wherever this holds"]),
        (
            "[m*g*a = b*F, theta = 1]",
            ["this does not hold all along a branch of the equilibria"],
        ),
    ],
)
def test_a_law_of_equilibrium_is_one_of_symbols(tmp_path, law, messages):
    """The values of the scene do not obey the law."""
    assert checked(tmp_path, f"  equilibrium: {law}\n", LEVER) == messages


def test_the_hint_has_the_law(tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text(f"{LEVER}expect: {{equilibrium: m = F}}\n")
    (problem,) = check_scene(str(path)).problems
    assert "theta any where m*g*a = b*F" in problem.hint


def test_what_a_controller_holds_has_a_value_at_rest(tmp_path):
    """θ = 1/2 is held by m g l sin θ, which is what the controller sets."""
    scene = PENDULUM.replace(
        "initial: {theta: 0.1}",
        """\
inputs: {tau: {}}
forces: {motor: {on: theta, force: tau}}
controllers: {every: 0.01, hold: {tau: 3*g*l*sin(1/2) - 90*(theta - 1/2) - 9*dot(theta)}}
""",
    )
    assert checked(tmp_path, "  equilibria: [{theta: 1/2, tau: 3*g*l*sin(1/2)}]\n", scene) == []
    messages = checked(tmp_path, "  equilibria: [{theta: 1/2, tau: 0}]\n", scene)
    assert messages == ["this equilibrium is not found"]


def test_states_with_two_values_are_no_numbers_of_an_equilibrium(tmp_path):
    scene = """\
coordinates: [x]
kinetic: {block: dot(x)^2/2}
states: {r: {on: x <= -1, off: x >= 1}}
forces: {push: {on: x, force: 2*r - x}}
initial: {x: 0, r: 0}
"""
    assert checked(tmp_path, "  equilibria: [{x: 0}]\n", scene) == []
    assert checked(tmp_path, "  equilibria: [{x: 1/2}]\n", scene) == [
        "this equilibrium is not found"
    ]
