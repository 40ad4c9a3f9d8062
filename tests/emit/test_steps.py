"""Steps in all formats: documents that compile, letters with one meaning, escaped text."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.errors import InputError, Mark
from lagrange_cli.mechanics import derive, interpret
from lagrange_cli.mechanics.equations import Equations
from lagrange_cli.mechanics.step_values import Way
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.scene import parse_expression, read_text
from tests.emit.test_latex import compiled, logs_by_document, one_document, overfull
from tests.mechanics.steps.test_steps import FULL
from tests.systems import shipped
from tests.systems.shipped import APART, NARROW, SCENES, derived, sliced

#: Scenes that are tried in every run, with the others in long ones.
SLICE = (
    "bead_on_rotating_hoop",
    "charged_particle",
    "furuta_pendulum",
    "particle_leaving_sphere",
    "quadrotor",
    "rolling_disk",
    "spinning_top",
    "wheel_down_incline",
)

WAYS: tuple[Way, ...] = ("lagrange", "dalembert")

#: Scenes of statics, and the law that each has.
LAWS = {
    "lever": "m g a = b F",
    "two_blocks_on_wedge": "m1 sin α = m2 sin β",
    "compound_pulley": "M = 4 m",
    "balance": "φ = -atan((m1 - m2) l / (M h))",
    "ladder_held_by_rope": "θ = atan(m g / (2 F))",
    "toggle_press": "θ = atan(P / (2 R))",
}

#: Scenes whose steps nobody would read.
TOO_LONG = {"bicycle", "fput", "hanging_net", "net_of_rods_and_springs", "pleiades"}
TOO_LONG |= {"benchmark_bicycle", "bricards_linkage", "rattleback", "stewart_platform"}
TOO_LONG |= {"kuka_iiwa", "ur5"}

#: Scenes of a body by a quaternion, whose parts are no virtual displacements.
BY_QUATERNION = {"dzhanibekov"}


def stepped(name: str, way: Way) -> Equations:
    return derived(name, steps=way, forces=way == "dalembert")


def latex(equations: Equations, style: str = "document") -> str:
    (text,) = EMITTERS["latex"].emit(equations, {"style": style}).values()
    return text


def markdown(equations: Equations) -> str:
    (text,) = EMITTERS["markdown"].emit(equations, {}).values()
    return text


def printed(equations: Equations) -> list[str]:
    """The steps in every format."""
    text, ascii = derivation_text(equations), derivation_text(equations, ascii=True)
    assert ascii.isascii()
    assert max(map(len, ascii.splitlines())) < 260
    assert derivation_report(equations)["steps"]["bodies"] is not None
    (typst,) = EMITTERS["typst"].emit(equations, {}).values()
    documents = [latex(equations), latex(equations, "snippet"), markdown(equations), typst]
    return [text, ascii, *documents]


def is_certified(equations: Equations) -> bool:
    steps = equations.derivation.steps
    return steps is not None and steps.states == 8 and max(steps.mismatch, steps.difference) < 1e-25


@pytest.mark.slow
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", SLICE)
def test_steps_of_scenes_are_certified_and_printed(name: str, way: Way) -> None:
    equations = stepped(name, way)
    assert is_certified(equations)
    assert all("Cyclic coordinates, momenta and energy" in text for text in printed(equations))


@pytest.mark.slow
@sliced(sorted({*SCENES, *APART} - set(SLICE)), {*NARROW, "fput"})
def test_steps_of_all_other_scenes_are_certified_and_printed(name: str) -> None:
    for way in WAYS:
        if name in TOO_LONG or (name in BY_QUATERNION and way == "dalembert"):
            with pytest.raises(InputError, match=r"too long to be read|turns by a quaternion"):
                stepped(name, way)
        else:
            equations = stepped(name, way)
            assert is_certified(equations)
            assert all(printed(equations))


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize(
    ("name", "way"),
    [
        ("double_pendulum", "lagrange"),
        ("furuta_pendulum", "dalembert"),
        ("rolling_disk", "dalembert"),
        ("spinning_top", "dalembert"),
        ("coupled_pendulums", "lagrange"),
    ],
)
def test_documents_stay_on_the_page(name: str, way: Way, tmp_path: Path) -> None:
    log = compiled(tmp_path, latex(stepped(name, way)))
    assert [points for points in overfull(log) if points > 5] == []


@pytest.mark.slow
@pytest.mark.latex
def test_a_snippet_compiles_with_amsmath(tmp_path: Path) -> None:
    equations = derive(read_text(FULL), steps="dalembert", forces=True)
    snippet = latex(equations, "snippet")
    document = (
        "\\documentclass[11pt,a4paper]{article}\\usepackage{amsmath}"
        "\\usepackage[margin=25mm]{geometry}\\allowdisplaybreaks\\begin{document}\n"
        f"{snippet}\\end{{document}}\n"
    )
    assert "\\section" not in snippet
    log = compiled(tmp_path, document)
    assert [points for points in overfull(log) if points > 5] == []


@pytest.mark.slow
@pytest.mark.latex
@pytest.mark.parametrize(
    "names",
    [
        pytest.param({*SLICE, *shipped.SLICE}, id="slice"),
        pytest.param({*SCENES, *APART} - TOO_LONG, id="all", marks=pytest.mark.campaign),
    ],
)
def test_documents_of_scenes_stay_on_the_page(names: set[str], tmp_path: Path) -> None:
    pairs = [(name, way) for name in sorted(names) for way in WAYS]
    pairs = [pair for pair in pairs if pair[0] not in BY_QUATERNION or pair[1] == "lagrange"]
    scenes = {f"{name} {way}": stepped(name, way) for name, way in pairs}
    assert all(map(is_certified, scenes.values()))
    documents = {name: latex(equations) for name, equations in scenes.items()}
    logs = logs_by_document(compiled(tmp_path, one_document(documents)))
    wide = {name: [p for p in overfull(log) if p > 5] for name, log in logs.items()}
    assert wide == {name: [] for name in documents}


# -- the lecture: each statement has its line ---------------------------------------


def section(text: str, heading: str) -> str:
    found = re.search(rf"^{re.escape(heading)}\n(.*?)(?:\n\n|\Z)", text, re.MULTILINE | re.DOTALL)
    assert found is not None, heading
    return found[1]


def lines(capsys: pytest.CaptureFixture[str], words: list[str], heading: str) -> list[str]:
    assert run(["derive", *words, "-q"]) == 0
    return [line.strip() for line in section(capsys.readouterr().out, heading).splitlines()]


def test_velocity_by_the_chain_rule(capsys: pytest.CaptureFixture[str]) -> None:
    """v = Σ ∂r/∂q_k q̇_k + ∂r/∂t of a bead on a wire that turns."""
    written = lines(capsys, [str(SCENES["bead_on_rotating_wire"]), "--steps"], "Velocities")
    assert written[1] == "ṙ_i = Σ_k ∂r_i/∂q_k q̇_k + ∂r_i/∂t"
    assert written[3:6] == [
        "∂x/∂r = cos(ω t)",
        "∂x/∂t = -ω r sin(ω t)",
        "ẋ = ṙ cos(ω t) - ω r sin(ω t)",
    ]


def test_generalized_forces_by_virtual_work(capsys: pytest.CaptureFixture[str]) -> None:
    """The torque of a horizontal force on a pendulum."""
    scene = [str(SCENES["pendulum_with_force"]), "--steps"]
    written = lines(capsys, scene, "Generalized forces")
    assert written[1:3] == ["δW = Σ_i F_i · δr_i = Σ_j Q_j δq_j", "Q_j = Σ_i F_i · ∂r_i/∂q_j"]
    assert written[-2].startswith("Q_θ = F_x ∂x/∂θ = ")
    assert written[-1] == "Q_θ is a torque: θ is an angle."


def test_a_generalized_force_on_a_length_is_no_torque(capsys: pytest.CaptureFixture[str]) -> None:
    scene = [str(SCENES["inverted_pendulum_on_cart"]), "--steps"]
    written = lines(capsys, scene, "Generalized forces")
    assert any(line.startswith("Q_p = ") for line in written)
    assert not any("torque" in line for line in written)


def test_equilibrium_of_a_lever_by_virtual_work(capsys: pytest.CaptureFixture[str]) -> None:
    """The work of weight and effort, without the force of the fulcrum."""
    scene = [str(SCENES["lever"]), "--by", "dalembert"]
    written = lines(capsys, scene, "d'Alembert's principle")
    assert "Σ_i (K_i - m_i r̈_i) · δr_i = 0" in written
    assert "Σ_i K_i · ∂r_i/∂θ = (m g a - b F) cos θ" in written


@pytest.mark.slow
@pytest.mark.parametrize("name", LAWS)
def test_laws_of_equilibrium_by_virtual_work(name: str) -> None:
    equations = derived(name, steps="virtual-work")
    assert is_certified(equations)
    text, ascii, *documents = printed(equations)
    assert LAWS[name] in text
    assert all("Principle of virtual work" in page for page in (ascii, *documents))
    assert "Cyclic coordinates" not in text
    report = derivation_report(equations)["steps"]["equilibrium"]
    assert report["complete"]


def test_nothing_is_in_equilibrium_where_time_acts(capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(SCENES["pendulum_driven_support"])
    assert run(["derive", scene, "--by", "virtual-work"]) == 2
    assert "nothing stays at rest: the equations depend on t" in capsys.readouterr().err


def test_a_force_without_a_value_at_rest_is_refused_at_its_coordinate() -> None:
    text = """
    particles: {b: {mass: 1, position: [x, 0, z]}}
    coordinates: [x, z]
    forces: {fan: {on: z, force: 1/dot(z)}}
    """
    with pytest.raises(InputError, match="a force or constraint has no value at rest") as refused:
        derivation_text(derive(read_text(text), steps="virtual-work"))
    mark = refused.value.problems[0].mark
    assert mark is not None
    assert (mark.line, mark.column) == (3, 22)


def test_virtual_work_beside_moving_constraints_and_terms_in_coordinates() -> None:
    """Inertia of a rotating hoop, and a torsion spring that two particles share, take part."""
    hoop = """
    parameters: {m: {}, R: {positive: true}, g: {positive: true}, omega: {}}
    particles:
      bead:
        mass: m
        position: [R*sin(theta)*cos(omega*t), R*sin(theta)*sin(omega*t), -R*cos(theta)]
    coordinates: [theta]
    potentials: {weight: {gravity: g}}
    """
    text = derivation_text(derive(read_text(hoop), steps="virtual-work"))
    assert "Σ_i (F_i - m_i r̈_i) · δr_i = 0\n" in text
    assert "Coordinates stay constant while the constraints move" in text
    spring = """
    plane: xz
    parameters: {m: {}, l: {positive: true}, g: {}, k: {positive: true}}
    particles:
      a: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}
      b: {mass: m, position: [-l*sin(theta), 0, -2*l*cos(theta)]}
    coordinates: [theta]
    potentials: {weight: {gravity: g}, torsion: k*theta^2/2}
    """
    text = derivation_text(derive(read_text(spring), steps="virtual-work"))
    assert "Σ_i F_i · δr_i - Σ_j N_j δq_j = 0\n" in text


def test_states_have_their_values_at_rest_in_equilibria_by_virtual_work() -> None:
    motor = """
    plane: xz
    parameters: {m: {positive: true}, l: {positive: true}, g: {positive: true}, V: {}}
    particles: {bob: {mass: m, position: [l*sin(phi), 0, -l*cos(phi)]}}
    coordinates: [phi]
    states: {i: {rate: V - i - dot(phi)}}
    potentials: {weight: {gravity: g}}
    forces: {motor: {on: phi, force: i}}
    """
    equations = derive(read_text(motor), steps="virtual-work")
    assert "    i = V\n" in derivation_text(equations)
    points = derivation_report(equations)["steps"]["equilibrium"]["points"]
    assert all(point["exact"]["i"] == "V" for point in points)


@pytest.mark.slow
def test_multipliers_take_part_in_virtual_work(capsys: pytest.CaptureFixture[str]) -> None:
    scene = [str(SCENES["pendulum_in_cartesian_coordinates"]), "--by", "virtual-work"]
    written = lines(capsys, scene, "Principle of virtual work")
    assert "Q_j + Σ_k λ_k ∂φ_k/∂q_j = 0" in written
    found = lines(capsys, scene, "Equilibrium")
    assert "z = -l" in found


def test_the_same_as_lagrange_and_newton(capsys: pytest.CaptureFixture[str]) -> None:
    scene = [str(SCENES["bead_on_parabola"]), "--by", "dalembert", "--forces"]
    written = " ".join(lines(capsys, scene, "The same by Lagrange's equations"))
    found = re.search(r"differ from the coefficients above by (\S+) at most", written)
    assert found is not None
    assert 0 < float(found[1]) < 1e-25
    newton = lines(capsys, scene, "Newton's equations")
    assert newton[0] == "m_i r̈_i = F_i + f_i"
    assert newton[2:] == ["m z̈ = m (2 a x ẍ + 2 a ẋ²)", "F_z = -m g"]


def test_newton_of_a_body_without_constraint_forces(capsys: pytest.CaptureFixture[str]) -> None:
    scene = [str(SCENES["thrown_ball"]), "--by", "dalembert", "--forces"]
    assert lines(capsys, scene, "Newton's equations") == ["m_i r̈_i = F_i", "F_z = -m g"]


# -- letters and text of a scene -----------------------------------------------------


def test_a_letter_keeps_the_meaning_that_the_scene_gives_it() -> None:
    scene = """
name: letters
parameters: {F: 2, N: 3, phi: 1, m: 1, g: 9.81, T: 4}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = F^2}
potentials: {weight: m*g*z, bend: N*phi*x^2}
kinetic: {turning: T*dot(s)^2/2}
coordinates: [x, z, s]
initial: {x: 0, z: -2, s: 0}
"""
    text = derivation_text(derive(read_text(scene), steps="dalembert"))
    assert "Σ_i (K_i - m_i r̈_i) · δr_i - Σ_j S_j δq_j = 0" in text
    assert "K_z = -m g" in text
    assert "∂ψ_rod/∂x = 2 x" in text
    assert "S_s = T s̈" in text
    assert "T_kin = " in text


def test_text_of_a_scene_is_no_markup() -> None:
    scene = """
name: hostile
title: "<script>alert(1)</script> [a](javascript:b) $\\\\input{x}$ `c` *d* | e"
description: "# heading\\n\\n- item $$ \\\\write18{touch owned} &amp; ![i](j)"
parameters: {m: 1, F: 2}
particles: {bob: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
forces: {"push": {on: bob, force: [F, 0, 0]}}
"""
    text = markdown(derive(read_text(scene), steps="lagrange"))
    head = text.split("## ")[0]
    assert (
        r"\<script\>alert(1)\</script\> \[a\](javascript:b) \$\\input\{x\}\$ \`c\` \*d\* \| e"
        in head
    )
    assert r"\# heading - item \$\$ \\write18\{touch owned\} \&amp; \!\[i\](j)" in head
    assert not re.search(r"(?<!\\)[<`$]", head.replace("$x$.", ""))


def test_numbers_of_the_report_read_back() -> None:
    """Expressions of JSON are in the scene language: read, they are those of the steps."""
    equations = stepped("double_pendulum", "lagrange")
    steps = equations.derivation.steps
    assert steps is not None
    report = derivation_report(equations)["steps"]
    for shown, parts in zip(report["coordinates"], steps.coordinates, strict=True):
        for key, expression in (
            ("momentum", parts.momentum),
            ("lagrangian_slope", parts.slope),
        ):
            read = interpret(equations, parse_expression(shown[key], Mark("report", 1, 1)))
            assert (read - expression).expand() == 0


# -- options ---------------------------------------------------------------------------


def test_formats_without_steps_refuse_them(capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(SCENES["bead_on_parabola"])
    assert run(["emit", scene, "--to", "python", "--steps"]) == 2
    message = capsys.readouterr().err
    assert "format 'python' has no steps; --steps is for latex and markdown and typst" in message


def test_a_way_implies_the_steps(capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(SCENES["bead_on_parabola"])
    outputs = []
    for options in (["--steps"], ["--by", "lagrange"], ["--steps", "--by", "dalembert"], []):
        assert run(["derive", scene, *options, "-q"]) == 0
        outputs.append(capsys.readouterr().out)
    assert outputs[0] == outputs[1]
    assert len(set(outputs)) == 3


@pytest.mark.slow
def test_a_large_scene_is_refused_at_its_place(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["derive", str(SCENES["fput"]), "--steps"]) == 2
    message = capsys.readouterr().err
    assert "fput.yaml:1:1: the steps of this derivation are too long to be read" in message
    assert "-p n=2" in message
    assert run(["derive", str(SCENES["fput"]), "--steps", "-p", "n=4", "-q"]) == 0


def test_explicit_form_beside_the_steps(capsys: pytest.CaptureFixture[str]) -> None:
    scene = str(SCENES["bead_on_parabola"])
    assert run(["derive", scene, "--steps", "--form", "explicit", "-q"]) == 0
    text = capsys.readouterr().out
    assert "Equations of motion, solved for the accelerations" in text
    assert "ẍ = " in text


def test_an_unknown_potential_keeps_its_letter() -> None:
    """V(r) stays in every line, and V does not name the potential energy too."""
    scene = """
name: central
parameters: {m: {positive: true}}
functions: {V: r}
particles: {planet: {mass: m, position: [r*cos(theta), r*sin(theta), 0]}}
coordinates: [r, theta]
potentials: {central: V(r)}
initial: {r: 1}
"""
    text = derivation_text(derive(read_text(scene), steps="lagrange"))
    assert "V_pot = V(r)" in text
    assert "∂L/∂r = m r θ̇² - V′(r)" in text


# -- what constraints determine -------------------------------------------------------

ROLLING_SPHERE = """
parameters: {m: {positive: true}, R: {positive: true}, a: {positive: true}, g: {}}
plane: xz
particles: {centre: {mass: m, position: [(R - a)*sin(theta), 0, -(R - a)*cos(theta)]}}
coordinates: [theta]
constraints: {rolling: a*dot(phi) = (R - a)*dot(theta)}
kinetic: {spin: m*a^2/5*dot(phi)^2}
potentials: {weight: {gravity: g}}
"""


def test_the_rate_of_an_angle_that_rolls_is_said_before_it_is_put_in(tmp_path, capsys) -> None:
    """T = ½ m v² + ½ I φ̇² with the constraint beside it, then over the coordinate."""
    scene = tmp_path / "bowl.yaml"
    scene.write_text(ROLLING_SPHERE, encoding="utf-8")
    words = [str(scene), "--steps"]
    assert lines(capsys, words, "Positions")[-2:] == [
        "By the constraints",
        "φ = φ_0 + (R - a) (θ - θ_0) / a",
    ]
    assert lines(capsys, words, "Velocities")[-1] == "φ̇ = (R - a) θ̇ / a"
    assert lines(capsys, words, "Kinetic energy")[1:] == [
        "spin = ⅕ m a² φ̇² = ⅕ m (R - a)² θ̇²",
        "T = ½ m (ẋ_centre² + ż_centre²) + ⅕ m a² φ̇² = 7/10 m (R - a)² θ̇²",
    ]


def test_functions_print_in_steps_as_the_scene_says() -> None:
    scene = """
        parameters: {m: 1}
        functions: {V: {of: x, latex: "\\\\Phi"}}
        particles: {bead: {mass: m, position: [x, 0, 0]}}
        coordinates: [x]
        potentials: {field: V(x)}
    """
    text = latex(derive(read_text(scene, file="bead.yaml"), steps="lagrange"))
    assert text.count(r"{\Phi}(x)") == 3
    assert text.count(r"{\Phi}'(x)") == 2
    assert "V(x)" not in text
