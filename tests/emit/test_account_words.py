"""Words of the lecture, each where it applies: kinds of constraints, the angular momentum."""

from __future__ import annotations

import pytest

from lagrange_cli import loads

POINT = """
parameters: {{m: 1, a: 0.5, w: 2, b: 0.3, g: 9.81}}
particles: {{P: {{mass: m, position: [x, y, z]}}}}
{rest}
"""


def shown(rest: str) -> str:
    derivation = loads(POINT.format(rest=rest)).derive()
    return derivation.text(width=140, sections="account,constraints")


@pytest.mark.parametrize(
    ("rest", "lines"),
    [
        ("constraints: {wire: 'z = a*x^2', plane: y = 0}", ["(all)   holonomic, scleronomic"]),
        ("constraints: {floor: z = a}", ["floor   z = a   (holonomic, scleronomic)"]),
        ("constraints: {lift: 'z = b*t^2'}", ["lift   z = b t²   (holonomic, rheonomic)"]),
        (
            "constraints: {lift: 'z = b*t', plane: y = 0}",
            ["lift    z = b t   (holonomic, rheonomic)", "y = 0   (holonomic, scleronomic)"],
        ),
        (
            "constraints: {skate: 'dot(y) = x*dot(z)'}",
            ["skate   ẏ = x ż   (nonholonomic, scleronomic)"],
        ),
        (
            "constraints: {skate: 'dot(y) = x*t*dot(z)'}",
            ["skate   ẏ = t x ż   (nonholonomic, rheonomic)"],
        ),
        (
            "constraints: {rail: 'dot(y) = a*dot(x)'}",
            ["rail   ẏ = a ẋ   (holonomic, scleronomic)"],
        ),
        ("constraints: {floor: z >= 0}", ["floor   z ≥ 0   (one-sided, scleronomic)"]),
        (
            "constraints: {lift: {unilateral: z >= b*t, restitution: b}}",
            ["lift   z ≥ b t   (one-sided, rheonomic; restitution b)"],
        ),
    ],
)
def test_kinds_of_constraints(rest: str, lines: list[str]) -> None:
    text = shown(rest)
    for line in lines:
        assert line in text


def test_constraints_of_positions() -> None:
    scene = """
parameters: {m: 1, R: 1, w: 2}
particles: {bead: {mass: m, position: [R*sin(q)*cos(w*t), R*sin(q)*sin(w*t), -R*cos(q)]}}
coordinates: [q]
"""
    text = loads(scene).derive().text(width=120)
    assert "2 constraints built into the positions; holonomic, rheonomic" in text


@pytest.mark.parametrize(
    ("place", "further", "axis"),
    [
        ("[r*cos(q), r*sin(q), 0]", "", "z"),
        ("[r*cos(q), 0, -r*sin(q)]", "", "y"),
        ("[r*cos(q), -r*sin(q), 0]", "", None),
        ("[b + r*cos(q), r*sin(q), 0]", "", None),
        ("[r*cos(q), r*sin(q), 0]", "kinetic: {spin: m*dot(q)^2}", None),
        ("[r*cos(q), r*sin(q), 0]", "potentials: {field: w*r^2*dot(q)}", None),
    ],
)
def test_the_angular_momentum(place: str, further: str, axis: str | None) -> None:
    scene = f"""
parameters: {{m: 1, b: 0.3, w: 2}}
particles: {{P: {{mass: m, position: {place}}}}}
coordinates: [r, q]
{further}
"""
    text = loads(scene).derive().text(width=120)
    assert "p_q = " in text or axis is None
    assert ("angular momentum" in text) == (axis is not None)
    assert axis is None or f"q is cyclic; angular momentum about the {axis} axis" in text


def test_steps_and_documents_say_it() -> None:
    scene = """
parameters: {m: 1}
particles: {P: {mass: m, position: [r*cos(q), r*sin(q), 0]}}
coordinates: [r, q]
"""
    derivation = loads(scene).derive(steps="lagrange")
    assert "p_q is the angular momentum about the z axis." in derivation.text()
    (latex,) = derivation.emit("latex").values()
    assert "$p_{q}$ is the angular momentum about the $z$ axis." in latex
    assert "holonomic, scleronomic" in latex
    german = loads(scene).derive().text(language="de", width=140)
    assert "holonom, skleronom" in german
    assert "Drehimpuls um die z-Achse" in german
