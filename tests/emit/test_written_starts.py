"""A start that the scene writes in its parameters stays so in print."""

from __future__ import annotations

import pytest

from lagrange_cli import loads

HOLE = """
parameters: {{M: {{value: 2, positive: true}}, m: 1, g: 9.81, l: 2, R: 1.5, omega0: 3}}
particles:
  puck: {{mass: M, position: [r*cos(theta), r*sin(theta), 0]}}
  weight: {{mass: m, position: [0, 0, r - l]}}
coordinates: [r, theta]
potentials: {{weight: {{gravity: g}}}}
initial: {initial}
"""

WRITTEN = "{r: R, theta: 0, dot(theta): omega0}"


def text(initial: str = WRITTEN, **options: object) -> str:
    return loads(HOLE.format(initial=initial)).derive().text(width=120, **options)


def test_momenta_and_energy() -> None:
    assert "At the start p_θ = M R² ω0, E = ½ M R² ω0² - m g (l - R)." in text()


@pytest.mark.parametrize("valued", [True, False])
def test_routhian(valued: bool) -> None:
    scene = HOLE.format(initial=WRITTEN)
    if not valued:
        scene = scene.replace("R: 1.5, omega0: 3", "R: {}, omega0: {}")
    shown = loads(scene).derive().text(form="routhian", width=120)
    assert "At the start p_θ = M R² ω0.\n" in shown
    assert "θ̇ = p_θ / (M r²) = R² ω0 / r²\n" in shown
    assert "ℛ = ½ (M + m) ṙ² - V_eff" in shown


def test_a_scene_without_r_has_the_routhian_r() -> None:
    scene = HOLE.format(initial="{r: l, theta: 0, dot(theta): 1}").replace("R: 1.5, ", "")
    assert "R = ½ (M + m) ṙ² - V_eff" in loads(scene).derive().text(form="routhian", width=120)


def test_initial_values() -> None:
    whole = text(sections="initial")
    assert "r = R" in whole
    assert "θ̇ = ω0" in whole


@pytest.mark.parametrize(
    "initial",
    ["{r: 1.5, theta: 0, dot(theta): 3}", "{r: R, x_puck: R}"],
)
def test_numbers_and_other_names_are_numbers(initial: str) -> None:
    shown = text(initial)
    assert "At the start" not in shown
    assert loads(HOLE.format(initial=initial)).derive().equations.derivation.start == ()


def test_a_start_that_closures_may_change_is_not_written() -> None:
    scene = """
parameters: {m: 1, l: 1, g: 9.81, a: 0.6}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: g}}
initial: {x: a, z: -0.8}
"""
    derivation = loads(scene).derive(formulation="multiplier")
    assert derivation.equations.derivation.start == ()


@pytest.mark.parametrize("form", ["latex", "markdown", "typst"])
def test_documents(form: str) -> None:
    derivation = loads(HOLE.format(initial=WRITTEN)).derive()
    parts = "equations,conserved,initial"
    (written,) = derivation.emit(form, form="routhian", sections=parts).values()
    assert "At the start" in written
    assert ("\\mathcal{R}" in written) == (form != "typst")
