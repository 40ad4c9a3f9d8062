"""Answers to exercises: any form of what is right passes, and what is wrong is told by its term."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.terminal import lagrange
from tests.systems.shipped import SCENES

HOLE = SCENES["masses_through_hole"]


def judged(folder: Path, answers: str, scene: Path = HOLE) -> tuple[int, list[str]]:
    """Return the exit code and the messages about some answers."""
    path = folder / "answers.yaml"
    path.write_text(answers, encoding="utf-8")
    done = lagrange("check", str(scene), "--answers", str(path), "--json")
    (report,) = json.loads(done.stdout)["scenes"]
    return done.returncode, [problem["message"] for problem in report["problems"]]


RIGHT = {
    "as shown": ["(M + m)*ddot(r) - M*r*dot(theta)^2 + m*g = 0", "dot(M*r^2*dot(theta)) = 0"],
    "solved, and divided": [
        "ddot(r) = (M*r*dot(theta)^2 - m*g)/(M + m)",
        "ddot(theta) = -2*dot(r)*dot(theta)/r",
    ],
    "mixed with each other": [
        "M*r^2*ddot(theta) + 2*M*r*dot(r)*dot(theta) = 0",
        "-(M + m)*ddot(r) + M*r*dot(theta)^2 - m*g + r*ddot(theta) + 2*dot(r)*dot(theta) = 0",
    ],
}


@pytest.mark.parametrize("form", RIGHT)
def test_any_form_of_right_equations_passes(form: str, tmp_path: Path) -> None:
    assert judged(tmp_path, json.dumps({"equations": RIGHT[form]})) == (0, [])


def test_coupled_equations_pass_solved(tmp_path: Path) -> None:
    accelerations = (
        "ddot(x) = (m2*l*dot(phi)^2*sin(phi) + m2*g*sin(phi)*cos(phi))/(m1 + m2*sin(phi)^2)",
        "ddot(phi) = -((m1 + m2)*g*sin(phi) + m2*l*dot(phi)^2*sin(2*phi)/2)"
        "/(l*(m1 + m2*sin(phi)^2))",
    )
    right = json.dumps({"dof": 2, "cyclic": ["x"], "equations": accelerations})
    assert judged(tmp_path, right, SCENES["pendulum_on_cart"]) == (0, [])
    wrong = right.replace("-((m1", "((m1")
    code, messages = judged(tmp_path, wrong, SCENES["pendulum_on_cart"])
    assert code == 1
    assert len(messages) == 1


@pytest.mark.parametrize(
    ("answers", "messages"),
    [
        ("dof: 3", ["3 degrees of freedom are 1 too many"]),
        ("cyclic: [r]", ["'r' is not cyclic", "'theta' is cyclic, too"]),
        ("lagrangian: (M + m)*dot(r)^2/2 + M*r^2*dot(theta)^2/2 - m*g*r", []),
        (
            "lagrangian: (M + m)*dot(r)^2/2 + M*r^2*dot(theta)^2 - m*g*r",
            [
                "this is no Lagrangian of the system: the term M*r^2*dot(theta)^2 lacks the"
                " factor 1/2; the term m*g*l is missing"
            ],
        ),
        (
            "equations: [2*(M + m)*ddot(r) = 2*M*r*dot(theta)^2 + 2*m*g, ddot(theta) = 0]",
            [
                "in the equation of 'r' the term 2*m*g has the wrong sign",
                "in the equation of 'theta' the term 2*dot(r)*dot(theta)/r is missing on the left",
            ],
        ),
        (
            "equations: ['(M + m)*ddot(r) - M*dot(theta)^2 + m*g = 0']",
            [
                "in the equation of 'r' the term M*dot(theta)^2 lacks the factor r",
                "there is no equation of motion of 'theta'",
            ],
        ),
        ("equations: [0 = 0]", ["this does not hold along the motion"]),
        ("conserved: [r^2*dot(theta), energy]", []),
        ("conserved: [p_theta]", ["'energy' is conserved, too"]),
        ("conserved: [p_theta, energy, p_r]", ["'p_r' is not conserved"]),
        (
            "conserved: [p_theta, (M + m)*dot(r)^2 + M*r^2*dot(theta)^2 - 2*m*g*r]",
            [
                "this is not conserved; of 'energy' the term 2*m*g*r has the wrong sign",
                "'energy' is conserved, too",
            ],
        ),
    ],
)
def test_what_is_wrong_is_told_by_its_term(
    answers: str, messages: list[str], tmp_path: Path
) -> None:
    code, told = judged(tmp_path, answers)
    assert told[: len(messages)] == messages
    assert code == bool(messages)
    assert bool(told) == bool(messages)


@pytest.mark.parametrize(
    ("answers", "place"),
    [
        ("equations: [ddot(rho) = 0]", "1:18: unknown name 'rho'"),
        ("equations: [ddot(r)]", "1:13: expected an equation"),
        ("cyclic: [rho]", "1:10: 'rho' is no coordinate"),
        ("eqations: [ddot(r) = 0]", "1:1: unknown key 'eqations' in answers"),
        ("{}", "1:1: there are no answers"),
        ("dof: [", "expected"),
    ],
)
def test_answers_that_cannot_be_read_are_told_with_their_place(
    answers: str, place: str, tmp_path: Path
) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text(answers, encoding="utf-8")
    done = lagrange("check", str(HOLE), "--answers", str(path))
    assert done.returncode == 2
    assert place in done.stdout


def test_answers_are_to_one_scene_and_take_no_options_of_many(tmp_path: Path) -> None:
    path = tmp_path / "answers.yaml"
    path.write_text("dof: 2", encoding="utf-8")
    for words in ([str(HOLE), str(HOLE)], [str(HOLE.parent)], [str(HOLE), "--simulate"]):
        done = lagrange("check", *words, "--answers", str(path))
        assert done.returncode == 2
        assert "--answers" in done.stderr


def test_several_files_are_judged_at_once(tmp_path: Path) -> None:
    for name, dof in (("right", 2), ("wrong", 1)):
        (tmp_path / name).write_text(f"dof: {dof}", encoding="utf-8")
    files = [word for name in ("right", "wrong") for word in ("--answers", str(tmp_path / name))]
    done = lagrange("check", str(HOLE), *files)
    assert done.returncode == 1
    assert "2 scenes: 1 pass, 1 fail" in done.stdout


RING = SCENES["oscillator_ring"]


def test_families_of_equations_are_answers(tmp_path: Path) -> None:
    right = "dof: n\nequations:\n  motion[i=1..n]: m*ddot(x[i]) = K*(x[i-1] - 2*x[i] + x[i+1])\n"
    assert judged(tmp_path, right, RING) == (0, [])


def test_a_family_that_is_wrong_is_told_once(tmp_path: Path) -> None:
    wrong = (
        "equations:\n  motion[i=1..n]: m*ddot(x[i]) = K*(x[i-1] + 2*x[i] + x[i+1])\n"
        'cyclic: ["x[i=1..n]"]\n'
    )
    code, told = judged(tmp_path, wrong, RING)
    assert code == 1
    assert told == [
        "'x[1]' is not cyclic",
        "in the equation of 'x[1]' the term 2*K*x[1] has the wrong sign",
    ]
