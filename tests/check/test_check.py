"""``check`` finds what does not hold, says where, and survives every scene."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from lagrange_cli import mechanics
from lagrange_cli.cache import open_cache
from lagrange_cli.check import CheckOptions, check_paths, check_scene, scenes_in
from lagrange_cli.check.expectations import CHECKS
from lagrange_cli.check.motions import MOTION_CHECKS
from lagrange_cli.errors import InputError, InternalError, Problem
from tests.cli.terminal import lagrange

BEAD = """\
name: bead
parameters: {m: 1.0, a: 0.5, g: 9.81}
particles:
  bead: {mass: m, position: [x, y, z]}
constraints:
  plane: y = 0
  wire: z = a*x^2
coordinates: [x]
potentials:
  weight: m*g*z
initial: {x: 1.0, dot(x): 0.0}
simulate: {until: 2.0, accuracy: 1e-9}
"""

EQUATION = "(1 + 4*a^2*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 + 2*a*g*x = 0"

HOLE = """\
name: hole
parameters: {M: 2.0, m: 1.0, g: 9.81, l: 2.0}
particles:
  puck: {mass: M, position: [r*cos(theta), r*sin(theta), 0]}
  weight: {mass: m, position: [0, 0, r - l]}
coordinates: [r, theta]
potentials:
  weight: {gravity: g}
initial: {r: 1.0, theta: 0.0, dot(theta): 3.0}
simulate: {until: 1.0, accuracy: 1e-9}
"""


def written(folder: Path, base: str, expect: str, name: str = "scene.yaml") -> str:
    path = folder / name
    path.write_text(base + "expect:\n" + expect, encoding="utf-8")
    return str(path)


def outcome(folder: Path, expect: str, base: str = BEAD):
    return check_scene(written(folder, base, expect))


FALL = """\
name: fall
parameters: {m: 1.0, g: 9.81}
particles:
  stone: {mass: m, position: [x, 0, z]}
coordinates: [x, z]
potentials:
  weight: {gravity: g}
initial: {x: 0, z: 0, dot(x): 3, dot(z): 1}
"""

HOLDS = [
    "  dof: 1\n",
    "  cyclic: []\n",
    "  conserved: [energy]\n",
    f"  equations: ['{EQUATION}']\n",
    # Multiples: by -1, by a parameter, by a coordinate, by a velocity, by t.
    f"  equations: ['0 = {EQUATION.removesuffix(' = 0')}']\n",
    f"  equations: ['m*({EQUATION.removesuffix(' = 0')}) = 0']\n",
    f"  equations: ['x*sin(x)*({EQUATION.removesuffix(' = 0')}) = 0']\n",
    f"  equations: ['dot(x)*exp(t)*({EQUATION.removesuffix(' = 0')}) = 0']\n",
    # Solved for the acceleration.
    "  equations: ['ddot(x) = -(4*a^2*x*dot(x)^2 + 2*a*g*x)/(1 + 4*a^2*x^2)']\n",
    # The same through the Cartesian names and their total derivatives.
    "  equations: ['m*ddot(x) + 2*a*x*m*(ddot(z) + g) = 0']\n",
    "  equations: []\n",
    "  lagrangian: m/2*dot(x)^2*(1 + 4*a^2*x^2) - m*g*a*x^2\n",
    # A total time derivative does not count, nor does a constant.
    "  lagrangian: m/2*(dot(x)^2 + dot(z)^2) - m*g*z + x^2*cos(t)*dot(x) - x^3*sin(t)/3 + g\n",
    # Of H the constants count too.
    "  hamiltonian: p_x^2/(2*m*(1 + (2*a*x)^2)) + m*g*a*x^2\n",
    "  drift: {energy: 1e-7}\n",
    "  equilibria: [{x: 0, stability: stable}]\n",
    "  frequencies: [sqrt(2*a*g)]\n",
]

FAILS = {
    "  dof: 2\n": ("dof", "expected dof 2, found 1"),
    "  cyclic: [x]\n": ("cyclic", "expected cyclic coordinates: x; found: none"),
    "  conserved: [p_x]\n": ("conserved", "'p_x' is not found to be conserved; found: energy"),
    "  conserved: []\n": ("conserved", "expected no conserved quantity; found: energy"),
    "  equations: ['(1 + 4*a*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 + 2*a*g*x = 0']\n": (
        "equations",
        "no derived equation is a multiple of this one",
    ),
    "  equations: ['(1 + 4*a^2*x^2)*ddot(x) + 4*a^2*x*dot(x)^2 - 2*a*g*x = 0']\n": (
        "equations",
        "no derived equation",
    ),
    "  equations: ['0 = 0']\n": ("equations", "no derived equation"),
    "  equations: ['ddot(x)^2 = 0']\n": ("equations", "no derived equation"),
    f"  equations: ['{EQUATION}', '{EQUATION}']\n": ("equations", "no derived equation"),
    "  lagrangian: m/2*dot(x)^2*(1 + 4*a^2*x^2) + m*g*a*x^2\n": ("lagrangian", "Lagrangian"),
    "  lagrangian: 2*(m/2*dot(x)^2*(1 + 4*a^2*x^2) - m*g*a*x^2)\n": ("lagrangian", "Lagrangian"),
    "  hamiltonian: p_x^2/(m*(1 + 4*a^2*x^2)) + m*g*a*x^2\n": ("hamiltonian", "Hamiltonian"),
    "  hamiltonian: p_x^2/(2*m*(1 + 4*a^2*x^2)) + m*g*a*x^2 + 1e-30*p_x^3\n": (
        "hamiltonian",
        "Hamiltonian",
    ),
    "  hamiltonian: p_q^2/(2*m) + m*g*a*x^2\n": ("unknown-name", "unknown name 'p_q'"),
    "  state: {t: 1, x: 1, within: 1e-6}\n": ("state", "at t = 1: expected x = 1.0"),
    "  equilibria: [{x: 1}]\n": ("equilibria", "this equilibrium is not found"),
    "  equilibria: []\n": ("equilibria", "expected no equilibrium; found: x = 0"),
    "  frequencies: [sqrt(a*g)]\n": ("frequencies", "expected the frequencies"),
    "  drift: {energy: 1e-30}\n": ("drift", "expected a drift of 'energy' within 1e-30"),
    "  drift: {phase: 1}\n": ("drift", "'phase' is not found to be conserved"),
    "  error: {contains: wire}\n": ("error", "the scene is not refused"),
}


@pytest.mark.slow
@pytest.mark.parametrize("expect", HOLDS)
def test_what_holds_passes(expect, tmp_path):
    report = outcome(tmp_path, expect)
    assert (report.outcome, report.problems) == ("pass", ())


@pytest.mark.slow
@pytest.mark.parametrize("expect", FAILS)
def test_what_does_not_hold_is_located(expect, tmp_path):
    report = outcome(tmp_path, expect)
    rule, message = FAILS[expect]
    assert report.outcome == "fail"
    (problem,) = report.problems
    assert (problem.rule, message in problem.message) == (rule, True), problem
    assert problem.mark.file == str(tmp_path / "scene.yaml")
    assert problem.mark.text.strip() == expect.splitlines()[0].strip()


#: Four particles on a line, each placed by its distance from the one before.
TRAIN = """\
name: train
parameters: {m: 1.5}
particles:
  a: {mass: m, position: [x1, 0, 0]}
  b: {mass: m, position: [x1 + x2, 0, 0]}
  c: {mass: m, position: [x1 + x2 + x3, 0, 0]}
  d: {mass: m, position: [x1 + x2 + x3 + x4, 0, 0]}
coordinates: [x1, x2, x3, x4]
initial: {x1: 0, x2: 1, x3: 1, x4: 1}
"""


@pytest.mark.parametrize(("last", "found"), [("p_x4^2", "pass"), ("p_x3^2", "fail")])
def test_hamiltonian_of_a_block_that_is_not_solved(last, found, tmp_path):
    squares = " + ".join(f"(p_x{k} - p_x{k + 1})^2" for k in (1, 2, 3))
    expect = f"  hamiltonian: ({squares} + {last})/(2*m)\n"
    assert outcome(tmp_path, expect, TRAIN).outcome == found


def test_every_check_is_exercised():
    # Events need contacts, which the scenes of test_expected_events have, and laws of equilibrium
    # levers: test_expected_equilibria.
    rules = {rule for rule, _ in FAILS.values()}
    assert {"events", "equilibrium", *rules} == {*CHECKS, *MOTION_CHECKS, "error", "unknown-name"}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("state", "found"),
    [
        ("{t: 2, x: 6, z: 2 - 2*g, dot(z): 1 - 2*g, dot(x): 3, within: 1e-10}", "pass"),
        ("[{t: 1, x: 3, within: 1e-10}, {t: sqrt(4), z: 2 - 2*g, within: 1e-10}]", "pass"),
        ("{t: 2, x: 6, z: 2 - 2*g + 1e-9, within: 1e-10}", "fail"),
        ("{t: 2, x: 6 - 2e-10, within: 1e-10}", "fail"),
    ],
)
def test_state_is_compared_within_its_bound(state, found, tmp_path):
    assert outcome(tmp_path, f"  state: {state}\n", FALL).outcome == found


@pytest.mark.slow
def test_drift_of_what_is_not_conserved_fails(tmp_path):
    damped = FALL + "dissipation: {air: m*dot(z)^2/2}\nsimulate: {until: 1}\n"
    (problem,) = outcome(tmp_path, "  drift: {energy: 1}\n", damped).problems
    assert "'energy' is not found to be conserved" in problem.message


TWO_BODIES = """
name: pair
parameters: {m: 1, k: 2}
particles: {a: {mass: m, position: [x, 0, 0]}, b: {mass: 3*m, position: [y, 0, 0]}}
coordinates: [x, y]
potentials: {V: k/2*(x - y)^2}
initial: {x: 1, y: 0, dot(x): 0.1, dot(y): 0.2}
simulate: {until: 5}
"""


@pytest.mark.slow
def test_momenta_of_symmetries_have_drifts(tmp_path):
    held = "  drift: {P_x: 1e-9, boost_x: 1e-9, energy: 1e-6}\n"
    assert outcome(tmp_path, held, TWO_BODIES).outcome == "pass"
    (problem,) = outcome(tmp_path, "  drift: {boost_x: 1e-30}\n", TWO_BODIES).problems
    assert "expected a drift of 'boost_x' within 1e-30" in problem.message
    (problem,) = outcome(tmp_path, "  drift: {P_y: 1}\n", TWO_BODIES).problems
    assert "'P_y' is not found to be conserved" in problem.message


def test_an_empty_list_says_that_symmetries_give_nothing_either(tmp_path):
    driven = TWO_BODIES.replace("potentials:", "forces: {f: {on: x, force: sin(t)}}\npotentials:")
    shaken = TWO_BODIES.replace("k/2*", "sin(t)*k/2*")
    (problem,) = outcome(tmp_path, "  conserved: []\n", shaken).problems
    assert "symmetries give P_x, boost_x" in problem.message
    assert outcome(tmp_path, "  conserved: []\n", driven).outcome == "pass"


def test_order_of_equations_does_not_matter(tmp_path):
    expect = (
        "  equations:\n"
        "    - r*ddot(theta) + 2*dot(r)*dot(theta) = 0\n"
        "    - (M + m)*ddot(r) - M*r*dot(theta)^2 + m*g = 0\n"
        "  cyclic: [theta]\n"
        "  conserved: [energy, p_theta]\n"
    )
    report = outcome(tmp_path, expect, HOLE)
    assert (report.outcome, report.problems) == ("pass", ())


def test_one_derived_equation_does_not_serve_twice(tmp_path):
    expect = (
        "  equations:\n"
        "    - r*ddot(theta) + 2*dot(r)*dot(theta) = 0\n"
        "    - r^2*ddot(theta) + 2*r*dot(r)*dot(theta) = 0\n"
    )
    (problem,) = outcome(tmp_path, expect, HOLE).problems
    assert problem.mark.line == len(HOLE.splitlines()) + 4
    assert "theta:" in problem.hint


def test_all_problems_of_a_scene_are_reported(tmp_path):
    report = outcome(tmp_path, "  dof: 3\n  cyclic: [x]\n  conserved: [p_x]\n")
    assert [p.rule for p in report.problems] == ["dof", "cyclic", "conserved"]


@pytest.mark.parametrize(
    ("base", "expect", "found"),
    [
        (BEAD.replace("a*x^2", "a*u^2"), "  error: {contains: \"unknown name 'u'\"}\n", "pass"),
        (BEAD.replace("a*x^2", "a*u^2"), "  error: {kind: unknown-name}\n", "pass"),
        (BEAD.replace("a*x^2", "a*u^2"), "  error: {kind: redundant}\n", "fail"),
        (BEAD.replace("a*x^2", "a*u^2"), "  error: {contains: nonsense}\n", "fail"),
        (BEAD.replace("a*x^2", "a*u^2"), "  dof: 1\n", "invalid"),
        (BEAD.replace("plane: y = 0", "plane: [y = 0, y = 1]"), "  error: {contains: y}\n", "pass"),
        (BEAD.replace("plane: y = 0", "plane: [y = 0, y = 1]"), "  dof: 1\n", "invalid"),
        (BEAD + "\tx", "  dof: 1\n", "invalid"),
        ("", "", "invalid"),
    ],
)
def test_refusals(base, expect, found, tmp_path):
    report = outcome(tmp_path, expect, base)
    assert report.outcome == found, report.problems
    assert bool(report.problems) == (found != "pass")


def test_strict_refuses_warnings(tmp_path):
    base = BEAD.replace("plane: y = 0", "plane: y = 0\n  again: 2*y = 0")
    path = written(tmp_path, base, "  dof: 1\n")
    assert check_scene(path).outcome == "pass"
    assert check_scene(path, CheckOptions(strict=True)).outcome == "invalid"


def test_parameters_replace_those_of_the_scenes(tmp_path):
    path = written(tmp_path, BEAD, "  state: {t: 1, x: cos(sqrt(g)), within: 0.1}\n")
    assert check_scene(path).outcome == "fail"
    # A flat enough wire leaves nearly a bead at rest, x = 1.
    path = written(tmp_path, BEAD, "  state: {t: 1, x: 1, within: 1e-3}\n")
    assert check_scene(path, CheckOptions({"a": "1e-6"})).outcome == "pass"


def test_a_crash_stays_within_its_scene(tmp_path, monkeypatch):
    first, second = (written(tmp_path, BEAD, "  dof: 1\n", n) for n in ("a.yaml", "b.yaml"))
    derive = mechanics.derive

    def broken(scene, **options):
        if scene.file == first:
            raise ZeroDivisionError("no such luck")
        return derive(scene, **options)

    monkeypatch.setattr(mechanics, "derive", broken)
    report = check_paths([first, second])
    assert [scene.outcome for scene in report.scenes] == ["crash", "pass"]
    assert "ZeroDivisionError: no such luck (test_check.py:" in report.scenes[0].problems[0].message
    assert "Traceback" in report.scenes[0].trace
    assert report.exit_code == 3


def test_an_internal_error_is_a_crash(tmp_path, monkeypatch):
    def broken(scene, **options):
        raise InternalError(Problem("the certificate does not hold"))

    monkeypatch.setattr(mechanics, "derive", broken)
    report = check_scene(written(tmp_path, BEAD, "  dof: 1\n"))
    assert (report.outcome, report.problems[0].message) == (
        "crash",
        "the certificate does not hold",
    )


class TestWalk:
    def test_folders_are_searched_in_order(self, tmp_path):
        for name in ("b/z.yaml", "b/a.yml", "a.yaml", "b/.hidden.yaml", ".git/c.yaml", "b/t.txt"):
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text("")
        found = [Path(p).relative_to(tmp_path).as_posix() for p in scenes_in([str(tmp_path)])]
        assert found == ["a.yaml", "b/a.yml", "b/z.yaml"]

    def test_a_scene_named_twice_is_checked_once(self, tmp_path):
        path = tmp_path / "a.yaml"
        path.write_text("")
        assert scenes_in([str(path), str(tmp_path), str(path)]) == [str(path)]

    def test_a_file_named_outright_may_have_any_name(self, tmp_path):
        (tmp_path / "a.scene").write_text("")
        assert scenes_in([str(tmp_path / "a.scene")]) == [str(tmp_path / "a.scene")]

    def test_missing_paths_and_empty_folders_are_refused(self, tmp_path):
        with pytest.raises(InputError) as refusal:
            scenes_in([str(tmp_path / "nowhere"), str(tmp_path)])
        assert ["no such" in p.message or "no scene" in p.message for p in refusal.value.problems]
        assert len(refusal.value.problems) == 2


class TestCommand:
    def run(self, *words: str, **more):
        return lagrange("check", *words, **more)

    @pytest.mark.slow
    def test_exit_codes_and_reports(self, tmp_path):
        good = written(tmp_path, BEAD, "  dof: 1\n", "good.yaml")
        bad = written(tmp_path, BEAD, "  dof: 2\n", "bad.yaml")
        assert self.run(good).returncode == 0
        done = self.run(str(tmp_path), "--json", "--junit", str(tmp_path / "report.xml"))
        assert done.returncode == 1
        found = json.loads(done.stdout)
        assert [(s["path"], s["outcome"]) for s in found["scenes"]] == [
            (bad, "fail"),
            (good, "pass"),
        ]
        assert found["summary"] == {"pass": 1, "fail": 1}
        suite = ElementTree.parse(tmp_path / "report.xml").getroot()[0]
        assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
        assert "::error file=" in self.run(bad, "--format", "github").stdout

    def test_missing_path_exits_2(self):
        done = self.run("nowhere.yaml")
        assert (done.returncode, done.stdout) == (2, "")
        assert "no such file or folder: 'nowhere.yaml'" in done.stderr
        assert self.run().returncode == 2

    def test_standard_input(self):
        done = self.run("-", input=BEAD + "expect: {dof: 1}\n")
        assert done.returncode == 0, done.stderr


def test_motions_of_scenes_that_say_how_long_are_integrated(tmp_path):
    """A particle falls into a centre of attraction at t = π/(2√2), which no accuracy passes."""
    falls = """\
parameters: {m: 1}
particles: {p: {mass: m, position: [r, 0, 0]}}
coordinates: [r]
potentials: {sun: -m/r}
initial: {r: 1, dot(r): 0}
simulate: {until: 5}
"""
    path = tmp_path / "falls.yaml"
    path.write_text(falls)
    asked = ["expected", "short", "full"]
    reports = [check_scene(str(path), CheckOptions(motions=motions)) for motions in asked]
    assert [report.outcome for report in reports] == ["pass", "pass", "fail"]
    (problem,) = reports[2].problems
    assert (problem.rule, problem.mark.line) == ("simulation", 6)
    path.write_text(falls.replace("until: 5", "samples: 5"))
    assert check_scene(str(path), CheckOptions(motions="full")).outcome == "pass"


def test_no_check_begins_after_one_that_fails(tmp_path):
    for name, dof in (("a", 1), ("b", 2), ("c", 1)):
        written(tmp_path, BEAD, f"  dof: {dof}\n", f"{name}.yaml")
    done = lagrange("check", ".", "-x", "--json", "-q", cwd=tmp_path)
    found = json.loads(done.stdout)
    assert [scene["outcome"] for scene in found["scenes"]] == ["pass", "fail"]
    assert (found["unchecked"], done.returncode) == (1, 1)


def test_limits_are_of_processes(tmp_path):
    done = lagrange("check", "-", "--timeout", "1", input=BEAD)
    assert (done.returncode, done.stdout) == (2, "")
    assert "a check on standard input has no limits" in done.stderr


PENDULUM = """
parameters: {m: 1, l: 1, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: m*g*z}
"""


@pytest.mark.parametrize(
    ("second", "found"),
    [
        ("m*ddot(z) = 2*z*lambda_rod - m*g", "pass"),
        ("m*ddot(z) = z*lambda_rod - m*g", "fail"),
        ("m*ddot(z) = 2*z*lambda_bar - m*g", "fail"),
    ],
)
def test_equations_with_multipliers(second, found, tmp_path):
    expect = f"  dof: 1\n  equations:\n    - m*ddot(x) = 2*x*lambda_rod\n    - {second}\n"
    assert outcome(tmp_path, expect, PENDULUM).outcome == found


RECORDED = """\
name: driven
parameters: {m: 1.0}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
inputs: {F: {file: f.csv, column: F, interpolation: linear}}
forces: {push: {on: p, force: [F, 0, 0]}}
initial: {x: 0.0, dot(x): 0.0}
simulate: {until: 1.0, accuracy: 1e-6}
expect:
  state: {t: 1.0, x: 0.5, within: 1e-5}
"""


@pytest.mark.slow
def test_an_outcome_is_recalled_until_anything_it_rests_on_changes(tmp_path, cache_folder):
    """Neither the wrong derivation below nor another recording is noticed through the cache."""
    scene, recording = tmp_path / "driven.yaml", tmp_path / "f.csv"
    scene.write_text(RECORDED, encoding="utf-8")
    recording.write_text("t,F\n0,1\n2,1\n")

    def outcomes(options: CheckOptions | None = None, jobs: int = 1) -> list[str]:
        report = check_paths([str(tmp_path)], options, cache=open_cache(), jobs=jobs)
        return [scene.outcome for scene in report.scenes]

    assert outcomes() == ["pass"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mechanics, "derive", None)
        assert outcomes() == outcomes(jobs=2) == ["pass"]
        assert outcomes(CheckOptions(strict=True)) == ["crash"]
    recording.write_text("t,F\n0,2\n2,2\n")
    assert outcomes() == outcomes() == ["fail"]
    recording.write_text("t,F\n0,1\n2,1\n")
    assert outcomes() == ["pass"]
    scene.write_text(RECORDED.replace("0.5", "0.6"), encoding="utf-8")
    assert outcomes() == outcomes() == ["fail"]


def test_crashes_are_not_stored(tmp_path, cache_folder, monkeypatch):
    path = written(tmp_path, BEAD, "  dof: 1\n")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mechanics, "derive", None)
        assert check_paths([path], cache=open_cache()).scenes[0].outcome == "crash"
    assert check_paths([path], cache=open_cache()).scenes[0].outcome == "pass"
