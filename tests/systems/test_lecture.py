"""The lecture that the project starts from, row by row: commands, and results by other means."""

from __future__ import annotations

import json
import math
import re
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


#: Rows of the lecture: a command, lines of its text, and lines of its LaTeX document.
ROWS = {
    "bead on the parabola": (
        "derive bead_on_parabola --steps",
        [
            "3N = 3, K = 2, DOF = 1",
            "plane y = 0 wire z = a x² (all) holonomic, scleronomic",
            "L = T - V = ½ m (1 + 4 a² x²) ẋ² - m g a x²",
            "and, divided by m, (1 + 4 a² x²) ẍ + 4 a² x ẋ² + 2 a g x = 0",
        ],
        [
            r"3N = 3,\quad K = 2,\quad \text{DOF} = 1",
            r"L = T - V = \frac{1}{2} m (1 + 4 a^{2} x^{2}) \dot{x}^{2} - m g a x^{2}",
            "and, divided by $m$,",
            r"(1 + 4 a^{2} x^{2}) \ddot{x} + 4 a^{2} x \dot{x}^{2} + 2 a g x = 0",
        ],
    ),
    "mass on the table": (
        "derive masses_through_hole --steps",
        [
            "3N = 6, K = 4, DOF = 2",
            "table z1 = 0 plumb x2 = 0, y2 = 0 rope r - z2 = l",
            "L = T - V = ½ M (ṙ² + r² θ̇²) + ½ m ṙ² - m g (r - l)",
            "(M + m) r̈ - M r θ̇² + m g = 0",
            "θ is cyclic, ∂L/∂θ = 0, and its momentum is conserved, p_θ = ∂L/∂θ̇ = M r² θ̇",
            "p_θ is the angular momentum about the z axis.",
        ],
        [
            r"3N = 6,\quad K = 4,\quad \text{DOF} = 2",
            r"\item plumb: $x_{2} = 0$, $y_{2} = 0$",
            r"\dot{x}_{1} & = \dot{r} \cos \theta - r \dot{\theta} \sin \theta",
            r"\dot{y}_{1} & = \dot{r} \sin \theta + r \dot{\theta} \cos \theta",
            r"\dot{z}_{2} & = \dot{r}",
            r"L = T - V = \frac{1}{2} M (\dot{r}^{2} + r^{2} \dot{\theta}^{2})"
            r" + \frac{1}{2} m \dot{r}^{2} - m g (r - l)",
            r"(M + m) \ddot{r} - M r \dot{\theta}^{2} + m g = 0",
            r"$\theta$ is cyclic",
            r"$p_{\theta}$ is the angular momentum about the $z$ axis.",
        ],
    ),
    "three particles at fixed distances": (
        "derive rigid_triangle",
        ["3N = 9, K = 3, DOF = 6", "rod12 (x1 - x2)² + (y1 - y2)² + (z1 - z2)² = c²"],
        [r"3N = 9,\quad K = 3,\quad \text{DOF} = 6"],
    ),
    "four particles at fixed distances": (
        "derive rigid_tetrahedron",
        ["3N = 12, K = 6, DOF = 6"],
        [r"3N = 12,\quad K = 6,\quad \text{DOF} = 6"],
    ),
    "a fifth particle with a redundant rod": (
        "derive rigid_tetrahedron_centre",
        [
            "3N = 15, K = 9, DOF = 6",
            "spoke4 (x_four - x_five)² + (y_four - y_five)² + (z_four - z_five)² = (√6 c / 4)²"
            " (redundant, implied by rod12, rod13, rod14, rod23, rod24, rod34, spoke1, spoke2,"
            " spoke3)",
        ],
        [
            r"3N = 15,\quad K = 9,\quad \text{DOF} = 6",
            "(redundant, implied by rod12, rod13, rod14, rod23, rod24, rod34, spoke1, spoke2,"
            " spoke3)",
        ],
    ),
    "particle on the sphere": (
        "derive particle_on_sphere",
        [
            "3N = 3, K = 1, DOF = 2",
            "φ d/dt (m a² φ̇ sin²θ) = 0",
            "φ is cyclic; angular momentum about the z axis",
        ],
        [r"\text{DOF} = 2", r"$\phi$ is cyclic, so $p_{\phi}$ is conserved"],
    ),
    "particle that leaves the sphere": (
        "analyze particle_leaving_sphere --contacts",
        [
            "λ_sphere = m g (3 z - 2 R cos θ0) / (2 R²)",
            "lost only where z = ⅔ R cos θ0 = 0.653378, that is cos θ = ⅔ cos θ0",
        ],
        [
            r"\lambda_{\mathrm{sphere}} = \frac{m g (3 z - 2 R \cos \theta_{0})}{2 R^{2}}",
            r"that is $\cos \theta = \frac{2}{3} \cos \theta_{0}$",
        ],
    ),
    "wire that turns": (
        "derive bead_on_rotating_wire --steps",
        [
            "table z = 0 (holonomic, scleronomic)",
            "y cos(ω t) = x sin(ω t) (satisfied by the definitions; holonomic, rheonomic)",
            "ṙ_i = Σ_k ∂r_i/∂q_k q̇_k + ∂r_i/∂t",
            "∂x/∂t = -ω r sin(ω t)",
            "ẋ = ṙ cos(ω t) - ω r sin(ω t)",
        ],
        [
            r"$y \cos(\omega t) = x \sin(\omega t)$"
            " (satisfied by the definitions; holonomic, rheonomic)",
            r"\dot{q}_{k} + \frac{\partial \mathbf{r}_i}{\partial t}",
            r"\dot{x} & = \dot{r} \cos(\omega t) - \omega r \sin(\omega t)",
        ],
    ),
    "support that is driven": (
        "derive pendulum_driven_support",
        ["plane y_bob = 0 (holonomic, scleronomic)", "holonomic, rheonomic)"],
        ["(holonomic, scleronomic)", "holonomic, rheonomic)"],
    ),
    "constraint on velocities": (
        "derive rolling_disk",
        [
            "ẋ = R ψ̇ cos φ, ẏ = R ψ̇ sin φ (nonholonomic, scleronomic)",
            "1 constraint built into the positions; holonomic, scleronomic",
        ],
        [r"(nonholonomic, scleronomic)", "holonomic, scleronomic"],
    ),
    "d'Alembert's principle": (
        "derive bead_on_parabola --by dalembert",
        [
            "Σ_i (F_i - m_i r̈_i) · δr_i = 0",
            "δz = 2 a x δx",
            "Σ_i m_i r̈_i · ∂r_i/∂x = m (1 + 4 a² x²) ẍ + 4 m a² x ẋ²",
            "Evaluated from L at 8 random states in 30 digits, these differ from the coefficients",
        ],
        [
            r"\sum_{i} (\mathbf{F}_i - m_{i} \, \ddot{\mathbf{r}}_i) \cdot"
            r" \delta \mathbf{r}_i = 0",
            r"\delta z = 2 a x \delta x",
        ],
    ),
    "force of a pendulum as a torque": (
        "derive pendulum_with_force --steps",
        [
            "Q_j = Σ_i F_i · ∂r_i/∂q_j",
            "Q_θ = F_x ∂x/∂θ = l F0 cos θ cos(Ω t)",
            "Q_θ is a torque: θ is an angle.",
        ],
        [
            r"l F_{0} \cos \theta \, \cos(\Omega t)",
            r"$Q_{\theta}$ is a torque: $\theta$ is an angle.",
        ],
    ),
    "constraint forces of Newton's laws": (
        # At the lowest point the wire bears the weight and what bends the path: m (2 a ẋ² + g).
        "derive bead_on_parabola --forces",
        ["λ_wire = m (2 a ẋ² + g) / (1 + 4 a² x²)"],
        [
            r"\lambda_{\mathrm{wire}} & = \frac{m}{1 + 4 a^{2} x^{2}} (2 a \dot{x}^{2} + g)",
        ],
    ),
    "Hamilton's equations": (
        "derive masses_through_hole --form hamiltonian",
        [
            "H = p_r² / (2 (M + m)) + p_θ² / (2 M r²) + m g (r - l)",
            "ṙ = p_r / (M + m)",
            "ṗ_r = p_θ² / (M r³) - m g",
        ],
        [
            r"H = \frac{p_{r}^{2}}{2 (M + m)} + \frac{p_{\theta}^{2}}{2 M r^{2}} + m g (r - l)",
            r"\dot{q}_{j} = \frac{\partial H}{\partial p_{j}},\quad"
            r" \dot{p}_{j} = -\frac{\partial H}{\partial q_{j}}",
        ],
    ),
}


def lines(command, *more, **options):
    """The text that a command prints, with single spaces; the scene is its second word."""
    kind, name, *words = command.split()
    source = name if name == "-" else scene(name)
    return " ".join(succeed(kind, source, *words, *more, **options).split())


@pytest.mark.parametrize("row", list(ROWS))
def test_a_row_of_the_lecture_in_text_and_latex(row):
    command, text, document = ROWS[row]
    for written, expected in (
        (lines(command), text),
        (lines(command, "--format", "latex"), document),
    ):
        for line in expected:
            assert line in written


#: Scenes of statics: the work in a displacement, and the law that follows, in text and in LaTeX.
STATICS = {
    "lever": (
        "Q_θ = Σ_i K_i · ∂r_i/∂θ = (m g a - b F) cos θ = 0",
        "any θ where m g a = b F",
        "m g a = b F",
    ),
    "balance": (
        "= -(m1 - m2) g l cos φ - M g h sin φ = 0",
        "φ = -atan((m1 - m2) l / (M h))",
        r"\phi & = -\arctan\left( \frac{(m_{1} - m_{2}) l}{M h} \right)",
    ),
    "two_blocks_on_wedge": (
        "= m1 g sin α - m2 g sin β = 0",
        "any s1 where m1 sin α = m2 sin β",
        r"m_{1} \sin \alpha = m_{2} \sin \beta",
    ),
    "ladder_held_by_rope": (
        "= l F sin θ - ½ m g l cos θ = 0",
        "θ = atan(m g / (2 F))",
        r"\theta & = \arctan\left( \frac{m g}{2 F} \right)",
    ),
    "atwood": ("= (m1 - m2) g = 0", "any x where m1 = m2", "m_{1} = m_{2}"),
}


def without_values(name):
    """The text of a scene whose parameters have no values, and which has no start."""
    written = Path(scene(name)).read_text(encoding="utf-8").partition("\ninitial:")[0] + "\n"
    return re.sub(r"\{value: [^,]*, ", "{", written)


@pytest.mark.parametrize("name", list(STATICS))
def test_virtual_work_gives_the_law_of_statics(name):
    work, law, typeset = STATICS[name]
    for more in ((f"derive {name}", {}), ("derive -", {"input": without_values(name)})):
        command, given = more
        text = lines(f"{command} --by virtual-work", **given)
        assert work in text
        assert law in text
        assert "δq_j = 0" in text
        assert "λ" not in text
    document = lines(f"derive {name} --by virtual-work", "--format", "latex")
    assert typeset in document
    assert r"\sum_{j} Q_{j} \, \delta q_{j} = 0" in document


def test_masses_through_the_hole_reduce_to_one():
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
    document = succeed("derive", "-", "--form", "routhian", "--format", "latex", input=written)
    assert r"At the start $p_{\theta} = M R^{2} \omega_{0}$." in document
    assert r"\frac{p_{\theta}}{M r^{2}} = \frac{R^{2} \omega_{0}}{r^{2}}" in document


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
