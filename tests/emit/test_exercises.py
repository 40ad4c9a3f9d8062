"""Exercises hold the problem and nothing of its solution, which the other style holds."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.errors import InputError
from lagrange_cli.report.contents.derivation.exercises import problem_statement
from tests.emit.test_latex import compiled
from tests.systems.shipped import SYSTEMS, derived

#: Documents that hold no picture, and those that do.
FORMATS = {"latex": True, "markdown": False, "typst": False, "html": True}


def written(to: str, name: str, **options: str) -> str:
    equations = derived(name, steps="lagrange")
    (text,) = EMITTERS[to].emit(equations, {"style": "exercise", **options}).values()
    return text


@pytest.mark.parametrize("to", FORMATS)
def test_an_exercise_gives_the_problem_and_asks(to: str) -> None:
    text = written(to, "masses_through_hole")
    assert "Exercise: Mass on a table" in text
    assert text.index("Constraints") < text.index("potential weight")
    assert text.index("potential weight") < text.index("Count the degrees of freedom")
    assert text.index("Count the") < text.index("Derive the") < text.index("Name the cyclic")
    assert ("<svg" in text or "tikzpicture" in text) == FORMATS[to]
    assert not re.search(r"K = 4|ddot|overset|&#xA8;|¨|r̈", text), "an acceleration gives it away"


@pytest.mark.parametrize("to", FORMATS)
def test_a_solution_has_the_steps_and_not_the_problem(to: str) -> None:
    text = written(to, "masses_through_hole", style="solution")
    assert "Solution: Mass on a table" in text
    assert "Velocities" in text
    assert "Certificate" not in text
    assert "Parameter" not in text


def test_sections_say_what_is_asked() -> None:
    asked = written(
        "markdown", "masses_through_hole", sections="account,equations", form="routhian"
    )
    tasks = asked[asked.index("## Tasks") :].strip().splitlines()[2:]
    assert tasks == [
        "1. Count the degrees of freedom.",
        "2. Derive the equations of motion by Lagrange's equations.",
        "3. Eliminate the cyclic coordinates with Routh's function.",
    ]


def test_what_cannot_be_drawn_has_no_sketch() -> None:
    assert "tikzpicture" not in written("latex", "low_pass_filter")


def test_coordinates_that_the_program_chose_are_left_to_choose() -> None:
    text = written("markdown", "particle_leaving_sphere")
    assert "Choose generalized coordinates" in text
    assert "Generalized coordinate" not in text


def test_exercises_need_steps() -> None:
    with pytest.raises(InputError, match="steps were not derived"):
        EMITTERS["latex"].emit(derived("pendulum"), {"style": "exercise"})


@pytest.mark.latex
@pytest.mark.parametrize("language", ["en", "de", "fr"])
@pytest.mark.parametrize("style", ["exercise", "solution"])
def test_exercises_compile(language: str, style: str, tmp_path: Path) -> None:
    compiled(tmp_path, written("latex", "wheel_down_incline", style=style, language=language))


def test_names_are_escaped_once() -> None:
    assert r"\text{potential spring{[}1{]}}" in written("markdown", "oscillator_ring")


def test_the_problem_of_bodies_needs_no_steps(capsys) -> None:
    scene = str(SYSTEMS / "bodies/double_rod.yaml")
    assert run(["emit", scene, "--to", "markdown", "--style", "exercise"]) == 0
    text = capsys.readouterr().out
    assert "Rigid bodies: upper of mass" in text
    assert text.index("Count the") < text.index("Derive the") < text.index("Name the cyclic")
    assert r"\text{potential weight} & = m g z_{\mathrm{upper}}" in text
    assert run(["emit", scene, "--to", "markdown", "--style", "solution"]) == 0
    solution = capsys.readouterr().out
    assert "By König's theorem" in solution
    assert text.splitlines()[2] not in solution


PLATE = """
name: plate
description: A plate on a spring.
parameters: {m: 1, I: 1, k: 2, c: 3, l: 1, P: 4}
plane: xy
bodies:
  plate: {at: [x, 0, 0], turn: phi, mass: m, inertia: I}
points:
  corner: {on: plate, at: [l, 0, 0]}
  wall: [0, 0, 0]
coordinates: [x, phi]
potentials: {tie: {spring: [corner, wall], stiffness: k, length: l}}
dissipation: {brake: c*dot(phi)^2/2}
forces:
  motor: {on: plate, torque: [0, 0, P]}
  push: {on: corner, force: [0, P, 0]}
  pull: {on: x, force: P}
"""


def test_the_problem_of_bodies_states_springs_dampers_forces_and_torques() -> None:
    stepped, plain = (loads(PLATE).derive(steps=way).equations for way in ("lagrange", None))
    for equations in (stepped, plain):
        (text,) = EMITTERS["markdown"].emit(equations, {"style": "exercise"}).values()
        assert "A plate on a spring" in text
        for stated in (
            r"\text{potential tie} & = \frac{1}{2} k",
            r"D & = \frac{1}{2} c \dot{\phi}^{2}",
            "The torque motor on plate:",
            "The force push on corner:",
            r"F_{y_{\mathrm{corner}}} & = P",
            "The force pull on $x$:",
            "F_{x} & = P",
        ):
            assert stated in text, stated
        assert text.count(" & = P") == 3
    (solution,) = EMITTERS["markdown"].emit(stepped, {"style": "solution"}).values()
    assert "A plate on a spring" not in solution


def test_a_description_gives_no_result_away() -> None:
    text = written("markdown", "slack_rope")
    assert "A weight on a rope of length l starts at the lowest point" in text
    assert "goes slack" not in text
    assert "Timoshenko and Young" in text


@pytest.mark.parametrize(
    ("description", "problem"),
    [
        (
            "It falls at x = t^2. The energy is conserved. W. Weber (1846).",
            "It falls at x = t^2. W. Weber (1846).",
        ),
        ("It falls.\n\nIt falls faster.", "It falls."),
        ("", ""),
    ],
)
def test_a_problem_is_the_first_paragraph_or_sentences_without_results(description, problem):
    assert problem_statement(description) == problem
