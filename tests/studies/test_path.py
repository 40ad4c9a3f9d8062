"""Paths of stationary action against closed forms, and against variations made here."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from lagrange_cli.api import load, loads
from lagrange_cli.errors import AccuracyError, InputError
from lagrange_cli.report.values.studies import PATHS
from lagrange_cli.studies.chebyshev import points_of
from lagrange_cli.studies.path.collocation import TwoPointProblem
from lagrange_cli.studies.path.ends import End
from lagrange_cli.studies.path.motions import Motions
from lagrange_cli.studies.path.search import scales_of

BALL = "systems/lecture/thrown_ball.yaml"
PENDULUM = "systems/pendulums/pendulum.yaml"
DOUBLE = "systems/pendulums/double_pendulum.yaml"

#: Mass 2, angular frequency 3.
OSCILLATOR = """
name: oscillator
parameters: {m: 2, w: 3}
particles: {a: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: m*w^2*x^2/2}
"""

#: The same in a plane: conjugate points are double.
PLANE = OSCILLATOR.replace("[x, 0, 0]", "[x, y, 0]").replace("[x]", "[x, y]")
PLANE = PLANE.replace("x^2/2", "(x^2 + y^2)/2")

#: A charge in a field along z: conjugate points come from L's terms linear in velocities alone.
CHARGE = """
name: charge
parameters: {m: 2, b: 3}
particles: {a: {mass: m, position: [x, y, 0]}}
coordinates: [x, y]
potentials: {field: -m*b*x*dot(y)}
"""


def paths(text, start, end, **more):
    derivation = (load(text) if text.endswith(".yaml") else loads(text)).derive()
    return derivation.path(start, end, **more)


def oscillator_action(x0, x1, span, m=2.0, w=3.0):
    """Feynman and Hibbs, problem 2-2."""
    s, c = math.sin(w * span), math.cos(w * span)
    return m * w / (2 * s) * ((x0**2 + x1**2) * c - 2 * x0 * x1)


@pytest.mark.slow
def test_a_ball_flies_on_its_parabola():
    found = paths(BALL, {"x": 1, "z": 2, "t": -1}, {"x": 5, "z": "2 - g/10", "t": 1.5})
    (only,) = found.solutions
    assert only.conjugacy.kind == "minimum"
    t, g, m, span = only.trajectory.t + 1, 9.81, 0.5, 2.5
    w = -g / 10 / span + g * span / 2
    np.testing.assert_allclose(only.trajectory.columns["x"], 1 + 4 / span * t, rtol=0, atol=1e-9)
    np.testing.assert_allclose(only.trajectory.columns["z"], 2 + w * t - g * t**2 / 2, atol=1e-9)
    mean = (4**2 + (g / 10) ** 2) / span**2
    action = m * mean * span / 2 - m * g * (4 - g / 10) * span / 2 - m * g**2 * span**3 / 24
    assert only.action == pytest.approx(action, rel=1e-12)
    assert abs(only.action - action) <= only.action_error
    assert found.exit_code == 0


@pytest.mark.slow
def test_a_free_particle_keeps_its_velocity():
    free = OSCILLATOR.replace("potentials: {spring: m*w^2*x^2/2}", "")
    (only,) = paths(free, {"x": 0.25, "t": 0}, {"x": -1, "t": 4}).solutions
    assert only.velocity == pytest.approx([-1.25 / 4], rel=1e-13)
    assert only.action == pytest.approx(2 / 2 * 1.25**2 / 4, rel=1e-12)
    assert (only.conjugacy.kind, only.conjugacy.index) == ("minimum", 0)


@pytest.mark.slow
@pytest.mark.parametrize(("halves", "index"), [(0.4, 0), (0.99, 0), (1.01, 1), (1.7, 1), (2.3, 2)])
def test_an_oscillator_is_a_saddle_beyond_half_a_period(halves, index):
    span = halves * math.pi / 3
    (only,) = paths(OSCILLATOR, {"x": 0.3, "t": 0.5}, {"x": 0.2, "t": 0.5 + span}).solutions
    assert only.action == pytest.approx(oscillator_action(0.3, 0.2, span), rel=1e-10)
    assert only.conjugacy.index == index
    assert only.conjugacy.kind == ("saddle" if index else "minimum")
    passed = [0.5 + (k + 1) * math.pi / 3 for k in range(index)]
    assert only.conjugacy.times == pytest.approx(passed, abs=1e-9)


@pytest.mark.slow
def test_conjugate_points_count_with_their_multiplicity():
    """Where both fields vanish at once their determinant does not change its sign."""
    ends = {"x": 1, "y": 0, "t": 0}, {"x": 0, "y": 0.5, "t": 1.2 * math.pi / 3}
    (only,) = paths(PLANE, *ends).solutions
    assert only.conjugacy.index == 2
    assert only.conjugacy.times == pytest.approx([math.pi / 3] * 2, abs=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("turns", "circles"), [(0.9, 0), (1.1, 1), (2.2, 2)])
def test_a_charge_comes_together_again_after_each_whole_circle(turns, circles):
    """Terms of L that are linear in velocities make them: both fields vanish with 1 − cos bt."""
    ends = {"x": 0, "y": 0, "t": 0}, {"x": 1, "y": 0.5, "t": turns * 2 * math.pi / 3}
    (only,) = paths(CHARGE, *ends).solutions
    times = [(k // 2 + 1) * 2 * math.pi / 3 for k in range(2 * circles)]
    assert only.conjugacy.index == 2 * circles
    assert only.conjugacy.times == pytest.approx(times, abs=1e-6)


@pytest.mark.slow
def test_at_the_conjugate_time_a_path_is_degenerate_or_there_is_none():
    half = math.pi / 3
    (only,) = paths(OSCILLATOR, {"x": 0, "t": 0}, {"x": 0, "t": half}).solutions
    assert (only.conjugacy.kind, only.conjugacy.index) == ("degenerate", 0)
    (of_all,) = paths(PLANE, {"x": 1, "y": 0, "t": 0}, {"x": -1, "y": 0, "t": half}).solutions
    assert of_all.conjugacy.kind == "degenerate"
    with pytest.raises(AccuracyError, match="no path of stationary action was found from 2"):
        paths(OSCILLATOR, {"x": 0.3, "t": 0}, {"x": 0.2, "t": half}, starts=2)


@pytest.mark.slow
def test_a_pendulum_goes_under_and_over():
    found = paths(PENDULUM, {"theta": -1, "t": 0}, {"theta": 1, "t": 1.2}, turns=1)
    ends = {round(path.last.q[0], 3) for path in found.solutions}
    assert {1.0, round(1 - 2 * math.pi, 3)} <= ends
    for path in found.solutions:

        def slope(t, y):
            return [y[1], -9.81 * math.sin(y[0])]

        start = [-1.0, path.velocity[0]]
        there = solve_ivp(
            slope, (0, 1.2), start, "DOP853", rtol=1e-13, atol=1e-13, dense_output=True
        )
        assert there.y[0, -1] == pytest.approx(path.last.q[0], abs=1e-8)

        def lagrangian(t, there=there):
            theta, rate = there.sol(t)
            return rate**2 / 2 + 9.81 * math.cos(theta)

        assert path.action == pytest.approx(quad(lagrangian, 0, 1.2, epsabs=1e-11)[0], rel=1e-9)
        assert path.reached < 1e-9
    actions = [path.action for path in found.solutions]
    assert actions == sorted(actions)


@pytest.mark.slow
def test_a_double_pendulum_is_certified():
    start, end = {"theta1": 0.5, "theta2": 0, "t": 0}, {"theta1": -0.5, "theta2": 0.3, "t": 1}
    derivation = load(DOUBLE).derive()
    found = derivation.path(start, end)
    assert len(found.solutions) >= 2
    for path in found.solutions:
        rates = zip(("dot(theta1)", "dot(theta2)"), path.velocity, strict=True)
        initial = {"theta1": 0.5, "theta2": 0, **dict(rates)}
        motion = derivation.simulate(initial=initial, until=1, accuracy=1e-11)
        assert motion.state["theta1"] == pytest.approx(-0.5, abs=1e-9)
        assert motion.state["theta2"] == pytest.approx(0.3, abs=1e-9)
        assert path.reached < 1e-9
        assert path.estimated <= 1e-9


@pytest.mark.slow
def test_varied_paths_change_the_action_at_second_order():
    """Variations of the test's own, beside the closed forms of both systems."""
    found = paths(BALL, {"x": 0, "z": 0, "t": 0}, {"x": 4, "z": 0, "t": 1})
    (only,) = found.solutions
    t, weights = only.panels.nodes, only.panels.weights()
    eta, rate = (t * (1 - t))[:, None] * [1, -2], (1 - 2 * t)[:, None] * [1, -2]

    def action(size):
        q, v = only.shot.q + size * eta, only.shot.v + size * rate
        return weights @ found.motions.action_values(t, q, v).lagrangian

    # δ²S = m ∫ η̇² dt is the whole change, since gravity is linear.
    for size in (-0.1, 1e-3, 0.1, 1.0):
        change = 0.5 / 2 * 5 / 3 * size**2
        assert action(size) - action(0) == pytest.approx(change, rel=1e-6, abs=1e-13)


@pytest.mark.slow
def test_modes_have_as_many_negative_eigenvalues_as_there_are_conjugate_points():
    from lagrange_cli.studies.path.measure import actions, modes

    span = 2.5 * math.pi / 3
    found = paths(OSCILLATOR, {"x": 0.3, "t": 0}, {"x": 0.2, "t": span})
    (only,) = found.solutions
    scale = only.shot.scales[0, 0]
    shapes = modes(found.motions, only)
    assert [mode.second < 0 for mode in shapes[:4]] == [True, True, False, False]
    for k, mode in enumerate(shapes[:4], 1):
        sine = np.sin(k * math.pi * only.shot.t / span)
        np.testing.assert_allclose(np.abs(mode.values[:, 0]) / scale, np.abs(sine), atol=1e-6)
        second = scale**2 * 2 * ((k * math.pi / span) ** 2 - 9) * span / 2
        assert mode.second == pytest.approx(second, rel=1e-6)
        change = actions(found.motions, only, mode, np.array([-0.1, 0.0, 0.1]))
        assert change == pytest.approx([second / 200, 0, second / 200], rel=1e-6, abs=1e-12)


@pytest.mark.slow
def test_forces_that_move_with_time_are_no_obstacle():
    pushed = OSCILLATOR.replace("m*w^2*x^2/2", "-m*x*cos(5*t)")
    (only,) = paths(pushed, {"x": 0, "t": 1}, {"x": 1, "t": 2}).solutions
    # x'' = cos 5t
    x = lambda t: -math.cos(5 * t) / 25  # noqa: E731
    speed = 1 - (x(2) - x(1)) + math.sin(5) / 5
    assert only.velocity == pytest.approx([speed], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("power", [-120, 90])
def test_units_do_not_matter(power):
    """Lengths in other units change numbers by powers of two alone."""
    scale = 2.0**power
    for size in (1.0, scale):
        found = paths(OSCILLATOR, {"x": 0.3 * size, "t": 0}, {"x": 0.2 * size, "t": 1.4}, starts=4)
        (only,) = found.solutions
        assert only.action / size**2 == pytest.approx(oscillator_action(0.3, 0.2, 1.4), rel=1e-9)
        assert only.conjugacy.index == 1


@pytest.mark.slow
def test_less_is_promised_than_can_be_held():
    """Above the top a motion loses digits by e^(wT): the estimate says how many."""
    steep = OSCILLATOR.replace("m*w^2*x^2/2", "-m*w^2*x^2/2")
    found = paths(steep, {"x": 1, "t": 0}, {"x": 1, "t": 6}, accuracy=1e-10, starts=1)
    (only,) = found.solutions
    assert only.estimated > 1e-10
    assert found.exit_code == 1
    exact = np.cosh(3 * (only.trajectory.t - 3)) / math.cosh(9)
    error = np.max(np.abs(only.trajectory.columns["x"] - exact))
    assert error <= only.estimated


@pytest.mark.slow
def test_files_say_what_was_found(tmp_path):
    found = paths(PENDULUM, {"theta": -1, "t": 0}, {"theta": 1, "t": 1.2}, samples=11)
    report = json.loads(json.dumps(PATHS.write(found)))
    assert report["t"] == pytest.approx(np.linspace(0, 1.2, 11))
    assert report["path"]["theta"][0] == -1
    assert report["solutions"][0]["action"] == report["action"]
    found.write(tmp_path / "p.csv")
    rows = list(csv.DictReader(io.StringIO((tmp_path / "p.csv").read_text())))
    assert len(rows) == 11 * len(found.solutions)
    assert float(rows[-1]["theta"]) == pytest.approx(1, abs=1e-9)
    assert int(rows[-1]["solution"]) == len(found.solutions)
    with pytest.raises(InputError, match=r"as \.csv, not"):
        found.write(tmp_path / "p.txt")


REFUSED = {
    "there is dissipation": OSCILLATOR + "dissipation: {rub: dot(x)^2}\n",
    "the force 'push' has no potential": OSCILLATOR + "forces: {push: {on: a, force: [1, 0, 0]}}\n",
    "have kinks or jumps": OSCILLATOR.replace("x^2/2", "abs(x)"),
}


@pytest.mark.parametrize("reason", REFUSED)
def test_motions_that_make_no_action_stationary_are_refused(reason):
    with pytest.raises(InputError, match=reason):
        paths(REFUSED[reason], {"x": 0, "t": 0}, {"x": 1, "t": 1})


def test_constraints_between_velocities_are_refused():
    with pytest.raises(InputError, match="between velocities cannot be integrated"):
        load("systems/rolling/ball_on_turntable.yaml").derive().path({"t": 0}, {"t": 1})


def test_contacts_are_refused():
    with pytest.raises(InputError, match="not varied across contacts"):
        load("systems/contact/bouncing_ball.yaml").derive().path({"t": 0}, {"t": 1})


def test_only_angles_turn():
    with pytest.raises(InputError, match="no coordinate is an angle"):
        paths(OSCILLATOR, {"x": 0, "t": 0}, {"x": 1, "t": 1}, turns=1)
    # A spring of torsion is not the same a turn further.
    twisted = load(PENDULUM).source.data.decode().replace("{gravity: g}", "m*l^2*theta^2/2")
    with pytest.raises(InputError, match="no coordinate is an angle"):
        paths(twisted, {"theta": 0, "t": 0}, {"theta": 1, "t": 1}, turns=1)


def test_a_parameter_without_a_value_is_asked_for():
    with pytest.raises(InputError, match="no value for 'w'"):
        paths(OSCILLATOR.replace("w: 3", "w: {}"), {"x": 0, "t": 0}, {"x": 1, "t": 1})


def test_a_motion_that_is_refused_is_no_end_of_the_search():
    """Starts may begin motions that no doubles hold; those of the user are looked at before."""
    motions = Motions(loads(OSCILLATOR).derive().path_models())
    times = np.array([0.0, 1.0])
    assert motions.shot(times, np.array([0.3]), np.array([1.0]), 1e-9) is not None
    assert motions.shot(times, np.array([0.3]), np.array([1.0]), 1e-30) is None
    assert motions.simulated(times, np.array([0.3]), np.array([1.0]), 1e-30, 11) is None


def test_inertia_may_vanish_at_rest():
    """T = ẋ⁴/4: a force-free path is straight."""
    text = "coordinates: [x]\nkinetic: {t: dot(x)^4/4}\npotentials: {v: 0*x}"
    (only,) = paths(f"name: quartic\n{text}", {"x": 0.5, "t": 0}, {"x": 1, "t": 0.5}).solutions
    np.testing.assert_allclose(only.trajectory.columns["dot(x)"], 1, atol=1e-9)


def test_ends_beyond_the_range_of_doubles_have_no_paths() -> None:
    """The action of a motion to 1e300 overflows."""
    with pytest.raises(AccuracyError, match="no path of stationary action was found"):
        paths(PLANE, {"x": 0, "y": 1e300, "t": 0}, {"x": 1, "y": 1e301, "t": 0.5}, starts=2)


@pytest.mark.slow
def test_coordinates_are_bent_by_falls_between_the_ends():
    """A fall of span²/8 times 9.81 m/s² between two times at one place, and its first speed."""
    text = "name: fall\ncoordinates: [z]\nkinetic: {T: dot(z)^2/2}\npotentials: {V: 9.81*z}\n"
    motions = Motions(loads(text).derive().path_models())
    first, last = End(5.0, np.zeros(1)), End(7.0, np.zeros(1))
    scales = scales_of(motions, first, last)
    assert scales == pytest.approx([9.81 * 2**2 / 8])
    s = points_of(8).s
    problem = TwoPointProblem(motions, first, last, scales)
    assert problem.velocity((4 * s * (1 - s))[:, None]) == pytest.approx([9.81 * 2 / 2])
