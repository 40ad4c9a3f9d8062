"""Scenes in tests/defects/ that once showed a defect, each with what it must give.

They are the smallest of a class; the tests of the class stand in the folder of its room.
"""

from __future__ import annotations

import json
import math
import time
from pathlib import Path
from xml.etree import ElementTree

import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import Derivation, load, loads
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.results.trajectory import Trajectory
from tests.cli.terminal import lagrange

DEFECTS = Path(__file__).parent / "defects"


def derived(name: str) -> Derivation:
    return load(DEFECTS / f"{name}.yaml").derive()


def moved(name: str, **options: float) -> Trajectory:
    return derived(name).simulate(**options)


def problems_of(name: str) -> tuple[Problem, ...]:
    """What a derivation is refused for, nothing where it is not."""
    try:
        derived(name)
    except InputError as error:
        return tuple(error.problems)
    return ()


@pytest.mark.slow
def test_what_rests_at_the_start_is_no_fact() -> None:
    # L does not hold x, but a force acts on it.
    assert {c.name for c in derived("stop_spring").equations.derivation.conserved} == {"p_y"}
    assert "x is cyclic" not in lagrange("derive", str(DEFECTS / "stop_spring.yaml")).stdout
    checked = lagrange("check", str(DEFECTS / "stop_spring.yaml"), "--format", "json")
    assert checked.returncode == 1
    (scene,) = json.loads(checked.stdout)["scenes"]
    assert scene["outcome"] == "fail"
    assert {"conserved", "equations"} <= {p["rule"] for p in scene["problems"]}


def test_a_right_run_is_not_disproved() -> None:
    found = moved("false_disproof")
    rest = 10 - 5.9
    assert found.status == "ok"
    assert found.state["x"] == pytest.approx(5.9 + math.sinh(rest), rel=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("units", [0, 1, -1, 17, -300, 8192, -8192])
def test_a_graze_is_right_or_ends_the_promise(units: int) -> None:
    scene = (DEFECTS / "graze_exact.yaml").read_text(encoding="utf-8")
    given = 4.47213595499958
    speed = given + units * math.ulp(given)
    found = loads(scene.replace(repr(given), repr(speed))).derive().simulate()
    times = [t for t in found.t.tolist() if t <= found.holds_until]
    # Restitution 1: where it is met, the motion is the mirror image.
    height, top = speed * speed / 20, speed / 10
    met = (speed - math.sqrt(max(speed * speed - 20, 0.0))) / 10 if height > 1 else math.inf
    for k, t in enumerate(times):
        free = speed * t - 5 * t * t
        bounced = speed * (2 * met - t) - 5 * (2 * met - t) ** 2 if t > met else free
        assert abs(found.columns["z"][k] - bounced) <= 1e-9
    assert found.status == "ok" or found.holds_until <= top + 1e-2


@pytest.mark.slow
def test_narrow_forces_are_met() -> None:
    box = moved("missed_box")
    assert box.status == "ok"
    assert box.state["dot(x)"] == pytest.approx(1.001797, abs=1e-6)
    pulse = moved("missed_pulse_3e-5")
    assert pulse.status == "ok"
    assert pulse.state["x"] == pytest.approx(1 + math.sqrt(math.pi) * 0.463, abs=2e-6)
    assert pulse.state["dot(x)"] == pytest.approx(1 + math.sqrt(math.pi), abs=4e-6)


def test_a_polar_needle_is_right_or_ends_there() -> None:
    found = moved("polar_needle")
    assert found.status != "ok" or found.state["r"] > 0
    assert (found.columns["r"] > 0).all()


@pytest.mark.slow
def test_dry_friction_runs() -> None:
    found = moved("rough_typeerror")
    assert found.status == "ok"
    assert found.state["x"] == pytest.approx(-0.2, abs=1e-6)


@pytest.mark.parametrize("name", ["forces_min", "forces_heaviside"])
def test_constraint_forces_of_kinked_terms(name: str) -> None:
    assert load(DEFECTS / f"{name}.yaml").derive(forces=True).equations.derivation.constraint_forces


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [
        "prime_factor",
        "domainerror_acosh",
        "restitution_tiny",
        "gravdir_1e309",
        "toda_start_1e-150",
        "memory_exptower",
        "hang_sum_sqrt",
        "hang_gravdir_digits",
        "hang_family_1e5",
    ],
)
def test_hostile_numbers_are_derived_or_refused_at_their_place(name: str) -> None:
    started = time.process_time()
    assert all(problem.mark is not None for problem in problems_of(name))
    assert time.process_time() - started < 20


@pytest.mark.slow
def test_too_many_samples_are_a_located_problem() -> None:
    checked = lagrange("check", str(DEFECTS / "samples_1e150.yaml"), "--format", "json")
    assert checked.returncode == 1
    (scene,) = json.loads(checked.stdout)["scenes"]
    assert scene["outcome"] == "invalid"
    assert all(p["line"] for p in scene["problems"])


@pytest.mark.slow
@pytest.mark.parametrize("name", ["slot_many", "bounce_1000"])
def test_samples_that_alias_with_the_motion(name: str) -> None:
    found = moved(name)
    assert found.status == "ok"
    assert len(found.events) > 900


@pytest.mark.slow
def test_annotations_hold_no_control_characters() -> None:
    checked = lagrange("check", str(DEFECTS / "github_controls.yaml"), "--format", "github")
    assert checked.returncode == 1
    assert all(c.isprintable() or c == "\n" for c in checked.stdout)
    assert all(line.startswith("::") for line in checked.stdout.splitlines() if "foo" in line)


@pytest.mark.slow
def test_floors_at_zero() -> None:
    assert moved("floor_at_zero_beside_a_rod").status == "ok"
    trebuchet = moved("trebuchet_taut")
    assert trebuchet.status == "ok"
    release = next(e for e in trebuchet.events if e.name.startswith("release"))
    assert release.t == pytest.approx(0.170127044, abs=2e-6)


@pytest.mark.slow
def test_bounces_without_end_close_the_contact_and_the_run_goes_on() -> None:
    found = moved("trebuchet", method="DOP853", rtol=1e-9)
    assert found.status == "ok"
    assert found.t[-1] == 1.2


@pytest.mark.slow
def test_an_impact_at_the_first_instant_is_no_drift() -> None:
    found = moved("impact_at_the_first_instant")
    assert found.status == "ok"
    assert found.constraint_drift is None or found.constraint_drift < 1e-12


@pytest.mark.slow
def test_unit_quaternions_from_the_identity() -> None:
    found = moved("quaternion_body_explicit")
    assert found.status == "ok"
    assert found.constraint_drift < 1e-12


def test_rates_by_another_name_are_kinetic_energy() -> None:
    assert derived("kinetic_through_abbreviations").equations.derivation.account.dof == 3


def test_a_constraint_that_definitions_satisfy_on_a_part() -> None:
    lines = {
        line.name: line.status
        for line in derived("implied_on_a_part").equations.derivation.account.lines
    }
    assert lines["c0"] == "satisfied"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("exit3_accumbounds", ("derive",)),
        ("exit3_zoo_in_max", ("derive",)),
        ("exit3_analyze_rest_division", ("analyze",)),
        ("exit3_form_explicit_1", ("derive", "--form", "explicit")),
    ],
)
def test_what_has_no_value_at_rest_is_no_internal_error(name: str, words: tuple[str, ...]) -> None:
    command, *options = words
    assert lagrange(command, str(DEFECTS / f"{name}.yaml"), *options).returncode == 0


@pytest.mark.slow
def test_fits_of_many_measurements_take_little_memory(tmp_path: Path) -> None:
    # All singular vectors of 50,000 rows would take 20 gigabytes.
    times = [k / 10_000 for k in range(50_000)]
    rate = math.sqrt(4 - 0.05**2)
    swing = (
        math.exp(-0.05 * t) * (math.cos(rate * t) + 0.05 / rate * math.sin(rate * t)) for t in times
    )
    rows = [f"{t},{x!r}" for t, x in zip(times, swing, strict=True)]
    data = tmp_path / "data.csv"
    data.write_text("\n".join(["t,x", *rows]), encoding="utf-8")
    (stiffness,) = derived("fit_out_of_memory").fit(data, ["k"]).values
    assert stiffness.value == pytest.approx(4, abs=1e-8)


@pytest.mark.slow
def test_pictures_with_control_characters_are_well_formed(tmp_path: Path) -> None:
    scene, picture = DEFECTS / "plot_svg_not_wellformed.yaml", tmp_path / "p.svg"
    assert lagrange("simulate", str(scene), "--plot", str(picture)).returncode == 0
    assert ElementTree.parse(picture).getroot().tag.endswith("svg")


@pytest.mark.slow
def test_a_step_into_a_saturated_controller_runs() -> None:
    """The bounds of the controller lie elsewhere at the instant of the step."""

    def behind(_: float, y: list[float]) -> list[float]:
        return [y[1], max(-2.0, min(2.0, 10 * (1 - y[0]) - 3 * y[1]))]

    found = moved("pulse_input")
    assert found.status == "ok"
    reference = solve_ivp(behind, (1, 5), [0, 0], rtol=1e-11, atol=1e-12, max_step=0.01)
    assert [found.state["x"], found.state["dot(x)"]] == pytest.approx(reference.y[:, -1], abs=2e-8)


@pytest.mark.slow
def test_late_times_need_wider_arithmetic() -> None:
    found = moved("late_time_blow_up", accuracy=1e-6)
    assert found.status == "ok"
    # The closed form in 30 digits.
    assert found.state["x"] == pytest.approx(0.157266353581627, abs=1e-6)
