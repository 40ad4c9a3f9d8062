"""Scenes that say how constraints, multipliers, particles, points and definitions print."""

from __future__ import annotations

import re

import pytest

from lagrange_cli import loads

SCENE = r"""
parameters: {m: 1, l: {value: 2, latex: "\\ell"}, g: 9.81}
plane: xz
points: {pivot: {position: [0, 0, 0], latex: A}}
particles:
  bob: {mass: m, position: [x, y_bob, z], latex: B}
  "p[i=1..2]": {mass: m, latex: P}
constraints:
  rod: {distance: [pivot, bob], equals: l, latex: "1", multiplier: N}
  wire: {equation: ["x_p[1]^2 + z_p[1]^2 = l^2", "x_p[2]^2 + z_p[2]^2 = l^2"], latex: w}
  "floor[i=1..2]": {unilateral: "z_p[i] >= -5*l", latex: f}
definitions: {r2: {equals: x^2 + z^2, latex: "\\rho"}}
potentials: {weight: {gravity: g}, core: m*g*(x^2 + z^2)^2}
initial: {x: 0, z: -2, "x_p[1]": 2, "z_p[1]": 0, "x_p[2]": -2, "z_p[2]": 0}
"""


def page(to: str, **options: object) -> str:
    derived = loads(SCENE).derive(**options)
    return "\n".join(derived.emit(to).values())


@pytest.mark.parametrize("to", ["latex", "markdown"])
def test_formulas_hold_the_symbols_of_the_scene(to: str) -> None:
    text = page(to)
    for symbol in (r"{N}", r"{\lambda_{w,1}}", r"{\lambda_{w,2}}", r"{\lambda_{f,1}}", r"{\ell}"):
        assert symbol in text
    for symbol in ("{x_{{P}_{1}}}", r"\dot{x}_{{P}_{2}}", r"{\rho}", "bob (${B}$)"):
        assert symbol in text
    # Nothing prints in two ways.
    for symbol in (r"\lambda_{\mathrm", r"\mathrm{bob}", r"\mathrm{pivot}", " l^"):
        assert symbol not in text


def test_typst_has_the_same_symbols() -> None:
    text = page("typst")
    for symbol in (r"lambda_(w \, 1)", r"lambda_(f \, 1)", "bob ($B$)", "rho", "y_B"):
        assert symbol in text
    for symbol in ('lambda_"', '"bob"', '_"pivot"'):
        assert symbol not in text


def test_the_list_of_constraints_holds_them_too() -> None:
    text = page("latex")
    assert r"rod: $({x_{A}} - {x_{B}})^{2}" in text
    assert r"= {\ell}^{2}$" in text


def test_steps_hold_them() -> None:
    text = page("latex", steps="lagrange")
    assert re.search(r"\\(var)?phi_\{w,1\}", text)
    assert r"\mathrm{wire}" not in text


def test_letters_of_quantities_make_way() -> None:
    scene = SCENE.replace("multiplier: N", "multiplier: T")
    text = "\n".join(loads(scene).derive().emit("latex").values())
    assert r"T_{\mathrm{kin}}" in text


def test_points_of_a_sketch_have_their_symbols() -> None:
    pendulum = """
parameters: {m: 1, l: 2, g: 9.81}
plane: xz
points: {pivot: {position: [0, 0, 0], latex: A}, far: {position: [1, 0, 0], latex: F}}
particles:
  bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)], latex: B}
  ball: {mass: m, position: [1 + l*sin(phi), 0, -l*cos(phi)], latex: C}
coordinates: [theta, phi]
potentials: {weight: {gravity: g}, spring: {spring: [bob, far], stiffness: g, length: l}}
initial: {theta: 0.4, phi: 0.5}
"""
    drawn = "\n".join(loads(pendulum).derive().emit("tikz").values())
    for symbol in ("${B}$", "${C}$"):
        assert symbol in drawn
    assert "bob" not in drawn.replace("% bob", "")


def test_other_formats_keep_the_names() -> None:
    derived = loads(SCENE).derive()
    assert "lambda_rod" in derived.text(ascii=True)
    assert "y_bob" in derived.text()
    assert derived.report()["multipliers"][0] == "lambda_rod"
