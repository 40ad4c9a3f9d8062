"""``lagrange analyze`` as a user runs it: text, JSON, files, refusals."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tests.cli.terminal import lagrange, succeed
from tests.systems.shipped import SYSTEMS

HOOP = str(SYSTEMS / "beads" / "bead_on_rotating_hoop.yaml")

SPRING = """\
name: spring
parameters: {k: 4}
inputs: [u]
particles: {ball: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k/2*x^2}
forces: {push: {on: x, force: u}}
initial: {x: 1}
"""


@pytest.mark.slow
def test_branches_in_text_json_and_a_picture(tmp_path):
    pytest.importorskip("matplotlib")
    over = ("analyze", HOOP, "--branches", "omega=0..sqrt(2*g/R)")
    files = ("--plot", str(tmp_path / "hoop.png"), "-o", str(tmp_path / "hoop.json"))
    shown = succeed(*over, *files)
    assert "1       pitchfork  5.71839138219" in shown
    assert (tmp_path / "hoop.png").read_bytes().startswith(b"\x89PNG")
    report = json.loads((tmp_path / "hoop.json").read_text())["branches"]
    assert report["to"] == pytest.approx((2 * 9.81 / 0.3) ** 0.5, rel=1e-15)
    assert json.loads(succeed(*over, "--json"))["branches"] == report
    # Again, from the cache, the picture too.
    (tmp_path / "hoop.png").unlink()
    succeed(*over, *files)
    assert (tmp_path / "hoop.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--branches", "omega"], "NAME=FROM..TO"),
        (["--branches", "omega=1.."], "NAME=FROM..TO"),
        (["--branches", "omega=0..nan"], "unknown name 'nan'"),
        (["--branches", "omega=0..1e300"], "a range ends at 1e+30"),
        (["--branches", "omga=0..1"], "did you mean 'omega'"),
        (["--branches", "omega=0..9", "--at", "theta=0"], "branches are of all equilibria"),
        (["--branches", "omega=0..9", "-o", "x.npz"], "add --linearization"),
        (["--branches", "omega=0..9", "--modes", "--plot", "x.png"], "--plot draws one picture"),
        (["--branches", "omega=0..9", "--steady"], "not of steady motions"),
    ],
)
def test_branches_that_are_refused(options, message):
    run = lagrange("analyze", HOOP, *options)
    assert run.returncode == 2
    assert message in run.stderr
    assert "internal" not in run.stderr


@pytest.mark.slow
def test_text_shows_each_part():
    shown = succeed("analyze", HOOP)
    assert "Equilibria   These are all.\n" in shown
    assert "stable     θ = acos(g / (R ω²)) = 1.03452 where |g| ≤ R ω²" in shown
    assert "\n  M = m R² = 0.0045\n" in shown
    assert "Modes   Angular frequencies:\n  Ω_1 = √(ω² - g² / (R² ω²)) = 6.87694291\n" in shown
    assert "h = ½ m R² θ̇²" in shown
    assert "Left out" not in shown


def test_symmetries_and_what_they_conserve():
    bodies = str(SYSTEMS / "celestial" / "two_bodies.yaml")
    shown = succeed("analyze", bodies, "--symmetries")
    assert "among energy and what symmetries linear in the coordinates give" in shown
    assert "P_x = m1 ẋ1 + m2 ẋ2     translation along x" in shown
    assert "L_z = m1 (x1 ẏ1 - y1 ẋ1) + m2 (x2 ẏ2 - y2 ẋ2)     rotation around z" in shown
    assert "Equilibria" not in shown
    report = json.loads(succeed("analyze", bodies, "--symmetries", "--json"))
    assert [c["name"] for c in report["conserved"]] == [
        *("energy", "P_x", "P_y", "L_z", "boost_x", "boost_y")
    ]
    assert report["conserved"][1]["field"] == {"x1": "1", "x2": "1"}
    assert report["conserved"][1]["symmetry"] == "translation along x"
    assert report["symmetries"] == {"matrices": True, "unproven": 0}
    assert report["equilibria"] is None


def test_the_linear_system_stands_alone():
    shown = succeed("analyze", "-", "--linearization", input=SPRING)
    assert "State space" in shown
    assert "Conserved" not in shown
    assert "Energy" not in shown


@pytest.mark.slow
def test_lyapunov_exponents_alone_or_beside_other_parts():
    scene = str(SYSTEMS / "pendulums" / "damped_driven_pendulum.yaml")
    shown = succeed("analyze", scene, "--lyapunov", "5")
    assert "Lyapunov exponents   Averaged from t = 0.5 to 5, together" in shown
    assert "Equilibria" not in shown
    report = json.loads(succeed("analyze", scene, "--lyapunov", "5", "--symmetries", "--json"))
    assert sum(report["lyapunov"]["exponents"]) == pytest.approx(-3 * np.pi / 2)
    assert report["symmetries"] is not None
    done = lagrange("analyze", scene, "--lyapunov", "-1")
    assert done.returncode == 2


def test_text_in_ascii():
    shown = succeed("analyze", HOOP, "--ascii")
    assert shown.isascii()
    assert "theta = acos(g/(R*omega^2)) = 1.03452 where abs(g) <= R*omega^2" in shown


def test_json_is_the_contract():
    report = json.loads(succeed("analyze", "-", "--json", input=SPRING))
    assert report["name"] == "spring"
    assert report["cyclic"] == []
    assert report["conserved"] == []
    (point,) = report["equilibria"]
    assert point["at"] == {"x": 0.0}
    assert point["stability"] == "stable"
    linear = report["linearization"]
    assert (linear["M"], linear["C"], linear["K"]) == ([[1.0]], [[0.0]], [[4.0]])
    space = linear["state_space"]
    assert space["states"] == ["x", "dot(x)"]
    assert space["inputs"] == ["u"]
    assert space["A"] == [[0.0, 1.0], [-4.0, 0.0]]
    assert space["B"] == [[0.0], [1.0]]
    (mode,) = report["modes"]
    assert mode["frequency"] == pytest.approx(2.0)
    assert mode["shape"] == [1.0]
    assert mode["exact_square"] == "k"
    assert report["left_out"] == []


def test_parts_that_are_not_asked_for_are_null():
    report = json.loads(succeed("analyze", "-", "--modes", "--json", input=SPRING))
    assert report["equilibria"] is None
    assert report["linearization"] is None
    assert report["modes"]


def test_files(tmp_path):
    shown = succeed("analyze", "-", "-o", str(tmp_path / "a.json"), "--json", input=SPRING)
    assert (tmp_path / "a.json").read_text() == shown
    succeed("analyze", "-", "-o", str(tmp_path / "a.npz"), input=SPRING)
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["A"].tolist() == [[0.0, 1.0], [-4.0, 0.0]]
        assert arrays["B"].tolist() == [[0.0], [1.0]]
        assert arrays["states"].tolist() == ["x", "dot(x)"]
        assert arrays["stiffness"].tolist() == [[4.0]]


@pytest.mark.parametrize(
    ("format_", "ending", "beginning"),
    [
        ("latex", ".tex", "% spring: analysis, written by lagrange"),
        ("markdown", ".md", "# spring"),
        ("typst", ".typ", "// spring: analysis, written by lagrange"),
        ("html", ".html", "<!DOCTYPE html>"),
        ("text", ".txt", "spring"),
    ],
)
def test_documents(tmp_path, format_, ending, beginning):
    words = "analyze", "-", "--format", format_
    shown = succeed(*words, input=SPRING)
    assert shown.startswith(beginning)
    path = tmp_path / f"a{ending}"
    assert succeed(*words, "-o", str(path), input=SPRING) == ""
    assert path.read_text(encoding="utf-8") == shown
    german = succeed(*words, "--language", "de", input=SPRING)
    assert "Gleichgewichte" in german
    assert "Equilibria" not in german


def test_a_report_stands_beside_a_document(tmp_path):
    words = "analyze", "-", "--format", "latex", "--style", "snippet"
    shown = succeed(*words, "-o", str(tmp_path / "a.npz"), input=SPRING)
    assert shown.startswith("% spring: analysis (needs amsmath)\n\\paragraph{Equilibria}")
    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["stiffness"].tolist() == [[4.0]]


def test_at_chooses_the_equilibrium():
    report = json.loads(succeed("analyze", HOOP, "--at", "theta=pi", "--json"))
    assert report["linearization"]["at"]["theta"] == pytest.approx(np.pi)
    assert report["modes"][0]["pole"][0] > 0


@pytest.mark.parametrize(
    ("words", "fragment"),
    [
        (["--at", "theta=1.5"], "--at theta:1:1: this is no equilibrium"),
        (["--at", "thta=0"], "did you mean 'theta'?"),
        (["-o", "a.csv"], "does not end in .json or .npz or .txt"),
        (
            ["-o", "a.tex", "--format", "text"],
            "does not end in .json, .npz or .txt, as --format text asks",
        ),
        (["--format", "markdown", "--style", "beamer"], "'markdown' has no option 'style'"),
        (["--format", "latex", "--width", "narrow"], "cannot be 'narrow'"),
        (["--language", "de", "--json"], "format 'json' has no option 'language'"),
        (["--modes", "-o", "a.npz"], "add --linearization"),
    ],
)
def test_refusals(words, fragment, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = lagrange("analyze", HOOP, *words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert fragment in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_what_cannot_be_found_is_left_out_or_refused():
    driven = str(SYSTEMS / "pendulums" / "kapitza_pendulum.yaml")
    assert "Left out\n  equilibria, linearization, modes: nothing stays" in succeed(
        "analyze", driven
    )
    done = lagrange("analyze", driven, "--modes")
    assert done.returncode == 2
    assert "the equations depend on t" in done.stderr


HOLE = str(SYSTEMS / "lecture" / "masses_through_hole.yaml")


def test_steady_motions():
    shown = succeed("analyze", HOLE, "--steady", "--at", "dot(theta)=3")
    assert "Steady motions   Motions are steady where:\n  M r θ̇² - m g = 0\n" in shown
    assert "\n  With θ̇ = 3: these are all.\n" in shown
    assert "stable   r = m g / (M θ̇²) = 0.545, p_θ = m² g² / (M θ̇³) = 1.78215" in shown
    assert "ω_1 = √(3 M θ̇² / (M + m)) = 4.24264069\n" in shown
    words = ("--equilibria", "--json", "--at", "dot(theta)=3")
    report = json.loads(succeed("analyze", HOLE, "--steady", *words))
    assert report["steady"] == {
        "ignored": ["theta"],
        "momenta": ["p_theta"],
        "given": {"dot(theta)": 3.0},
    }
    (motion,) = report["equilibria"]
    assert motion["at"] == {"r": pytest.approx(0.545)}
    assert motion["exact_momenta"] == {"p_theta": "m^2*g^2/(M*dot(theta)^3)"}
    assert motion["rates"] == {"dot(theta)": 3.0}
    assert report["modes"] is None
    done = lagrange("analyze", str(SYSTEMS / "pendulums" / "pendulum.yaml"), "--steady")
    assert done.returncode == 2
    assert "no coordinate is cyclic" in done.stderr
    done = lagrange("analyze", HOLE, "--steady", "--at", "p_thet=3")
    assert done.returncode == 2
    assert "did you mean 'p_theta'?" in done.stderr
