"""The lecture that the project starts from, row by row: commands, and results by other means."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.cli.terminal import succeed
from tests.systems.shipped import SYSTEMS


def scene(name):
    (path,) = SYSTEMS.glob(f"*/{name}.yaml")
    return str(path)


def report(command, name, *words):
    return json.loads(succeed(command, scene(name), *words, "--json"))


def test_bead_on_the_parabola_has_the_boards_lines():
    text = succeed("derive", scene("bead_on_parabola"), "--steps")
    assert "3N = 3, K = 2, DOF = 1" in text
    assert "L = T - V = ½ m (1 + 4 a² x²) ẋ² - m g a x²" in text
    assert "(1 + 4 a² x²) ẍ + 4 a² x ẋ² + 2 a g x = 0" in text
    assert "and, divided by m," in text


def test_masses_through_the_hole_reduce_to_one():
    text = succeed("derive", scene("masses_through_hole"), "--steps")
    assert "L = T - V = ½ M (ṙ² + r² θ̇²) + ½ m ṙ² - m g (r - l)" in text
    assert "p_θ is the angular momentum about the z axis." in text
    assert "3N = 6, K = 4, DOF = 2" in text
    assert "(M + m) r̈ - M r θ̇² + m g = 0" in text
    assert "θ is cyclic" in text
    reduced = report("derive", "masses_through_hole", "--form", "routhian")
    assert reduced["ignored"] == ["theta"]
    # θ̇ = R² ω₀ / r² along a motion.
    moved = report("simulate", "masses_through_hole", "--accuracy", "1e-10", "--until", "1")
    start = {r["coordinate"]: r["start"] for r in reduced["recovered"]}["theta"]
    state, mass = moved["state"], 2.0
    assert mass * state["r"] ** 2 * state["dot(theta)"] == pytest.approx(start, rel=1e-8)


def test_a_start_in_letters_gives_the_angular_velocity_in_letters():
    written = Path(scene("masses_through_hole")).read_text(encoding="utf-8")
    for number, letters in (
        ("l: 2.0}", "l: 2.0, R: 1.0, omega0: 3.0}"),
        ("r: 1.0,", "r: R,"),
        ("dot(theta): 3.0", "dot(theta): omega0"),
    ):
        written = written.replace(number, letters)
    text = succeed("derive", "-", "--form", "routhian", input=written)
    assert "At the start p_θ = M R² ω0." in text
    assert "θ̇ = p_θ / (M r²) = R² ω0 / r²" in text


@pytest.mark.parametrize(
    ("name", "rheonomic"),
    [
        ("bead_on_parabola", False),
        ("masses_through_hole", False),
        ("particle_on_sphere", False),
        ("bead_on_rotating_wire", True),
        ("pendulum_driven_support", True),
    ],
)
def test_constraints_are_scleronomic_or_rheonomic(name, rheonomic):
    facts = report("derive", name)["facts"]
    assert facts["rheonomic"] == rheonomic
    page = succeed("derive", scene(name))
    assert ("holonomic, rheonomic" in page) == rheonomic
    assert rheonomic or "holonomic, scleronomic" in page


@pytest.mark.parametrize("start", [0.1, 0.2, 0.5])
def test_the_particle_leaves_the_sphere_at_two_thirds(start):
    run = report("simulate", "particle_leaving_sphere", "-p", f"theta0={start}", "--until", "3")
    (event,) = run["events"]
    assert event["name"] == "release:sphere"
    angle = math.atan2(event["state"]["x"], event["state"]["z"])
    assert math.cos(angle) == pytest.approx(2 / 3 * math.cos(start), rel=1e-8)
    # Free flight after: z by the fall's formula.
    t = run["t"] - event["t"]
    fallen = event["state"]["z"] + event["state"]["dot(z)"] * t - 9.81 * t**2 / 2
    assert run["state"]["z"] == pytest.approx(fallen, rel=1e-8)


def test_the_azimuth_on_the_sphere_is_cyclic():
    (cyclic,) = report("derive", "particle_on_sphere")["cyclic"]
    assert [c["name"] for c in report("derive", "particle_on_sphere")["conserved"]] == [
        f"p_{cyclic}",
        "energy",
    ]


def test_the_balance_rests_where_its_torques_cancel():
    found = report("analyze", "balance", "--equilibria")
    stable, unstable = found["equilibria"]
    assert (stable["stability"], unstable["stability"]) == ("stable", "unstable")
    # Torques about the fulcrum: (m2 - m1) g l cos φ = M g h sin φ.
    balanced = (0.502 - 0.5) * 0.15 / (0.2 * 0.01)
    assert math.tan(stable["at"]["phi"]) == pytest.approx(balanced, rel=1e-9)
    assert found["complete"]


def test_the_lever_rests_under_archimedes_law():
    text = succeed("analyze", scene("lever"), "--equilibria")
    assert "θ any where m g a = b F" in text


@pytest.mark.slow
def test_virtual_work_of_d_alembert_is_certified():
    for name in ("bead_on_parabola", "masses_through_hole", "particle_on_sphere"):
        seal = report("derive", name)["certificate"]
        assert seal["points"] >= 8
        assert seal["mismatch"] < 1e-28
        steps = succeed("derive", scene(name), "--by", "dalembert")
        assert "Σ_i (F_i - m_i r̈_i) · δr_i = 0" in steps


def test_a_force_on_the_pendulum_is_a_torque():
    text = succeed("derive", scene("pendulum_with_force"))
    assert "Q_θ = l F0 cos θ cos(Ω t)" in text


def test_velocities_by_the_chain_rule_are_shown_for_each_particle():
    text = succeed("derive", scene("masses_through_hole"), "--steps", "--format", "latex")
    assert r"\dot{x}_{1} & = \dot{r} \cos \theta - r \dot{\theta} \sin \theta" in text
    assert r"\dot{y}_{1} & = \dot{r} \sin \theta + r \dot{\theta} \cos \theta" in text
    assert r"\dot{z}_{2} & = \dot{r}" in text


@pytest.mark.slow
def test_the_action_of_the_actual_path_is_stationary(tmp_path):
    ends = "--from", "x=0,z=0,t=0", "--to", "x=4,z=0,t=1"
    picture = tmp_path / "paths.tex"
    words = "path", scene("thrown_ball"), *ends, "--starts", "2", "--json", "--plot", str(picture)
    found = json.loads(succeed(*words))
    t, z = np.array(found["t"]), np.array(found["path"]["z"])
    assert z == pytest.approx(9.81 / 2 * t * (1 - t), abs=1e-8)
    assert found["kind"] == "minimum"
    # The integral of T - V over this second, of half a kilogram.
    assert found["action"] == pytest.approx(0.5 * (4**2 / 2 - 9.81**2 / 24), rel=1e-8)
    # The path, and several that are varied beside it.
    assert picture.read_text().count(r"\addplot") > 4


def test_newton_gives_the_same_with_constraint_forces():
    text = succeed("derive", scene("bead_on_parabola"), "--forces")
    # At the lowest point the wire bears the weight and what bends the path: m (2 a ẋ² + g).
    assert "λ_wire = m (2 a ẋ² + g) / (1 + 4 a² x²)" in text


def test_hamiltons_equations_are_there():
    text = succeed("derive", scene("masses_through_hole"), "--form", "hamiltonian")
    assert "H = p_r² / (2 (M + m)) + p_θ² / (2 M r²) + m g (r - l)" in text
