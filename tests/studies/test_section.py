"""Poincaré sections beside closed forms, samples at known times, and SciPy's events."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.studies.chebyshev import Series, nodes_between
from lagrange_cli.studies.section.roots import zeros_of

ONE = "name: s\ncoordinates: [x]\nkinetic: {{T: dot(x)^2/2}}\npotentials: {{V: {}}}\n"

#: Frequencies 1 and √2, which never meet again.
TWO = """\
name: two
parameters: {a: 0.3}
coordinates: [x, y]
kinetic: {T: (dot(x)^2 + dot(y)^2)/2}
potentials: {V: x^2/2 + y^2}
initial: {x: 0, dot(x): 1, y: a, dot(y): 0}
"""

#: A pendulum that goes round: its angle grows by about 40 in 10 s.
ROTOR = """\
name: rotor
parameters: {k: 0.01}
coordinates: {theta: {unit: rad}}
kinetic: {T: dot(theta)^2/2}
potentials: {V: -cos(theta)}
initial: {theta: 0.1, dot(theta): 4}
"""


@pytest.fixture(scope="module")
def oscillator():
    return loads(ONE.format("x^2/2") + "initial: {x: 1, dot(x): 0}").derive()


@pytest.mark.parametrize(
    ("condition", "first", "period"),
    [
        ("x = 0", np.pi / 2, np.pi),
        ("x = 0, dot(x) > 0", 3 * np.pi / 2, 2 * np.pi),
        ("dot(x) = 0, x < 0", np.pi, 2 * np.pi),
        ("dot(x) = 0, x > 0", 0.0, 2 * np.pi),
        ("x + dot(x) = 0", np.pi / 4, np.pi),
        ("cos(3*t) = 0, dot(x) < 0", None, None),
        ("abs(x) = 1/2", None, None),
        ("x = 0.999999", None, None),
    ],
)
def test_the_times_of_an_oscillator_are_known(oscillator, condition, first, period):
    """x = cos t; the last three have their times by hand."""
    section = oscillator.section(condition, until=40, accuracy=1e-10)
    if first is None:
        k, third = np.arange(40), np.pi / 3
        expected = {
            "cos(3*t) = 0, dot(x) < 0": (2 * k + 1) * np.pi / 6,
            "abs(x) = 1/2": np.sort(np.append(third + np.pi * k, 2 * third + np.pi * k)),
            "x = 0.999999": np.sort(
                np.append(
                    2 * np.pi * k + np.arccos(0.999999), 2 * np.pi * (k + 1) - np.arccos(0.999999)
                )
            ),
        }[condition]
        if "dot(x) < 0" in condition:
            expected = expected[np.sin(expected) > 0]
    else:
        expected = first + period * np.arange(40)
    expected = expected[expected <= 40]
    (points,) = section.members
    assert len(section) == len(expected) > 5
    np.testing.assert_allclose(section.t, expected, atol=40e-10, rtol=0)
    np.testing.assert_allclose(points.columns["x"], np.cos(expected), atol=1e-10)
    np.testing.assert_allclose(points.columns["dot(x)"], -np.sin(expected), atol=1e-10)
    wrong = np.maximum(
        np.abs(points.columns["x"] - np.cos(expected)), np.abs(section.t - expected) / 40
    )
    assert (wrong <= points.error + 1e-15).all()
    assert points.complete
    assert section.exit_code == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("condition", "place"),
    [("sqrt(x) = 0.5", 0.25), ("tan(x) = 0.5", 0.5), ("1/x = 2, x > 0", 0.5)],
)
def test_poles_and_places_without_values_are_no_points(oscillator, condition, place):
    section = oscillator.section(condition, until=6.5, accuracy=1e-9)
    first = np.arccos(np.arctan(place) if "tan" in condition else place)
    (points,) = section.members
    assert points.complete
    assert section.t == pytest.approx([first, 2 * np.pi - first], abs=1e-8)


@pytest.mark.parametrize(("short", "error"), [(0.0, 0.0), (1e-10, 1e-9)])
def test_zeros_at_both_ends_are_zeros(short, error):
    """Of sin πt from 0 to 3, and to a little before 3, closer than its error in the last third."""
    edges = np.linspace(0.0, 3.0 - short, 4)
    series = Series.through(edges, np.sin(np.pi * nodes_between(edges)))
    zeros = zeros_of(series, np.array([0.0, 0.0, error]))
    np.testing.assert_allclose(zeros.t, [0, 1, 2, 3 - short], atol=4e-15)
    assert len(zeros.open) == 0


def test_a_touch_is_open_and_a_miss_is_none(oscillator):
    touched = oscillator.section("x = 1", until=20)
    np.testing.assert_allclose(touched.members[0].open, 2 * np.pi * np.arange(1, 4), atol=1e-4)
    assert touched.t.tolist() == [0.0]
    assert touched.exit_code == 1
    missed = oscillator.section("x = 1.000001", until=20)
    assert len(missed) == 0
    assert missed.exit_code == 0
    # The motion meets the border of the inequality: nobody can tell whether it is beyond it.
    at_border = oscillator.section("dot(x) = 0, x > 1", until=20)
    np.testing.assert_allclose(at_border.members[0].open, 2 * np.pi * np.arange(1, 4), atol=1e-4)
    assert len(at_border) == 0
    # What is nowhere near is not: there x = -1.
    elsewhere = oscillator.section("x = 1, x < 0", until=20)
    assert not elsewhere.members[0].open


def test_flat_crossings_are_as_accurate_as_others_or_said_to_be_uncertain(oscillator):
    """At 1 − 1e-10 an error of x by 1e-9 moves the time by 7e-5: it takes a better run."""
    section = oscillator.section("x = 1 - 1e-10", until=20, accuracy=1e-6)
    (points,) = section.members
    shift = np.arccos(1 - 1e-10)
    expected = np.sort([2 * np.pi * k + s * shift for k in range(4) for s in (-1, 1)])[1:]
    assert len(section) == len(expected)
    wrong = np.abs(section.t - expected) / 20
    assert (wrong <= points.error).all()
    assert points.complete == (points.error <= 1e-6).all()
    assert (wrong[points.error <= 1e-6] <= 1e-6).all()


def test_points_of_two_frequencies_have_a_closed_form():
    section = loads(TWO).derive().section("x = 0, dot(x) > 0", until=300, accuracy=1e-9)
    times = 2 * np.pi * np.arange(48)
    (points,) = section.members
    np.testing.assert_allclose(section.t, times, rtol=0, atol=300e-9)
    y, rate = 0.3 * np.cos(np.sqrt(2) * times), -0.3 * np.sqrt(2) * np.sin(np.sqrt(2) * times)
    wrong = [
        np.abs(section.columns["y"] - y) / points.scales["y"],
        np.abs(section.columns["dot(y)"] - rate) / points.scales["dot(y)"],
        np.abs(section.columns["dot(x)"] - 1) / points.scales["dot(x)"],
    ]
    assert (np.max(wrong, axis=0) <= points.error + 1e-15).all()
    assert points.error.max() <= 1e-9
    np.testing.assert_allclose(points.energy, 0.5 + 0.09, rtol=1e-9)


def henon_heiles(t, s):
    x, y, u, v = s
    return [u, v, -x - 2 * x * y, -y - x * x + y * y]


def start(energy: float, y: float) -> dict[str, float]:
    """A start on x = 0 with dot(y) = 0; dot(x) follows from the energy."""
    return {"x": 0.0, "y": y, "dot(y)": 0.0, "dot(x)": np.sqrt(2 * energy - y * y + 2 * y**3 / 3)}


@pytest.fixture(scope="module")
def galaxy():
    return load("systems/oscillators/henon_heiles.yaml").derive()


@pytest.mark.slow
@pytest.mark.parametrize(("energy", "y", "until"), [(1 / 12, -0.1, 300), (1 / 8, -0.25, 150)])
def test_crossings_by_another_route(galaxy, energy, y, until):
    """SciPy's DOP853 at 1e-13, with events that it finds on its interpolant."""

    def crossing(t, s):
        return s[0]

    crossing.direction = 1
    begin = start(energy, y)
    first = [begin[name] for name in ("x", "y", "dot(x)", "dot(y)")]
    other = solve_ivp(
        henon_heiles, (0, until), first, method="DOP853", rtol=1e-13, atol=1e-14, events=crossing,
        max_step=0.05,
    )  # fmt: skip
    section = galaxy.section("x = 0, dot(x) > 0", [begin], until=until, accuracy=1e-9)
    (points,) = section.members
    events = other.t_events[0] > 1e-6
    states = other.y_events[0][events]
    assert section.t[0] == 0
    assert len(section) == 1 + events.sum() > 20
    np.testing.assert_allclose(section.t[1:], other.t_events[0][events], rtol=0, atol=1e-8)
    for number, name in enumerate(("x", "y", "dot(x)", "dot(y)")):
        np.testing.assert_allclose(points.columns[name][1:], states[:, number], rtol=0, atol=2e-9)
    np.testing.assert_allclose(points.energy, energy, rtol=1e-9)


def boxes(section, cells: int) -> int:
    """Count the cells of a square from −0.6 to 0.7 in which there are points."""
    columns = section.columns
    places = np.array([columns["y"], columns["dot(y)"]])
    return len(set(map(tuple, np.floor((places + 0.6) / 1.3 * cells).astype(int).T.tolist())))


@pytest.mark.slow
def test_order_at_a_low_energy_and_chaos_at_a_higher_one(galaxy):
    """Hénon and Heiles 1964, figures 4 and 5: at 1/12 every orbit lies on a curve; at 1/8 the
    points of one fill an area. Cells half as wide are twice as many on a curve, four times as many
    in an area that is filled."""
    motion = {"method": "DOP853", "rtol": 1e-11, "until": 6000}
    curve = galaxy.section("x = 0, dot(x) > 0", [start(1 / 12, -0.1)], **motion)
    area = galaxy.section("x = 0, dot(x) > 0", [start(1 / 8, -0.25)], **motion)
    assert min(len(curve), len(area)) > 800
    assert boxes(curve, 16) < 2 * boxes(curve, 8)
    assert boxes(area, 16) > 2.5 * boxes(area, 8)
    assert boxes(area, 32) > 5 * boxes(curve, 32)


def test_a_stroboscopic_section_has_the_samples_at_whole_periods():
    pendulum = load("systems/pendulums/damped_driven_pendulum.yaml").derive()
    section = pendulum.section("sin(omega*t) = 0, cos(omega*t) > 0", until=20, accuracy=1e-9)
    samples = pendulum.simulate(until=20, accuracy=1e-9, samples=21)
    np.testing.assert_allclose(section.t, samples.t, rtol=0, atol=1e-13)
    for name in ("phi", "dot(phi)"):
        atol = 2e-9 * samples.scales[name]
        np.testing.assert_allclose(section.columns[name], samples.columns[name], rtol=0, atol=atol)


@pytest.mark.parametrize(
    ("condition", "step"),
    [
        ("theta = 0", 2 * np.pi),
        ("theta = pi/2", 2 * np.pi),
        ("2*theta = 1", np.pi * 2),
        ("theta/2 = 1/2", 2 * np.pi),
        ("sin(theta) = 0", np.pi),
        ("theta - t/10 = 0", None),
        ("theta^2 = 9", 0.0),
    ],
)
def test_angles_are_equal_modulo_turns(condition, step):
    """A rotor passes the angles that whole turns make an equation hold at, in order."""
    section = loads(ROTOR).derive().section(condition, until=10)
    angles, turned = section.columns["theta"], section.columns["theta"][-1]
    assert turned < 60
    if step is None:
        crossed = (angles - section.t / 10) / (2 * np.pi)
        np.testing.assert_allclose(crossed, np.round(crossed), atol=1e-6)
        assert len(section) > 4
    elif step == 0:  # no equation between angles: taken as it stands
        np.testing.assert_allclose(angles, [3.0], atol=1e-6)
    else:
        np.testing.assert_allclose(np.diff(angles), step, atol=1e-5)
        assert len(section) > 4


def test_an_angle_that_winds_a_spring_is_no_other_after_a_turn():
    sprung = loads(ROTOR.replace("-cos(theta)", "k*theta^2/2 - cos(theta)")).derive()
    section = sprung.section("theta = 0", until=10, accuracy=1e-8)
    np.testing.assert_allclose(section.columns["theta"], 0, atol=1e-7)
    assert not section.turning
    assert loads(ROTOR).derive().section("theta = 0", until=1).turning == ("theta",)


@pytest.mark.slow
def test_no_passage_at_a_perihelion_is_missed():
    """An orbit of eccentricity 0.99: all that it does near the focus takes a thousandth of it."""
    text = """\
name: comet
coordinates: [x, y]
kinetic: {T: (dot(x)^2 + dot(y)^2)/2}
potentials: {V: -1/sqrt(x^2 + y^2)}
initial: {x: -1.99, y: 0, dot(x): 0, dot(y): -sqrt(1/199)}
"""
    section = loads(text).derive().section("y = 0, x > 0", until=12 * np.pi, accuracy=1e-9)
    np.testing.assert_allclose(section.t, np.pi * (2 * np.arange(6) + 1), rtol=0, atol=1e-7)
    np.testing.assert_allclose(section.columns["x"], 0.01, rtol=1e-6)
    assert section.exit_code == 0


@pytest.mark.slow
def test_kinks_of_forces_hide_no_crossings():
    """x'' = −sign(x) from x = 1/2 at rest: zeros at 1, 3, 5, ..., turning points at 0, 2, 4, ..."""
    wedge = loads(ONE.format("abs(x)") + "initial: {x: 0.5, dot(x): 0}").derive()
    zeros = wedge.section("x = 0", until=20.5, accuracy=1e-8)
    np.testing.assert_allclose(zeros.t, 1 + 2 * np.arange(10), rtol=0, atol=1e-6)
    turns = wedge.section("dot(x) = 0", until=20.5, accuracy=1e-8)
    np.testing.assert_allclose(turns.t, 2 * np.arange(11), rtol=0, atol=1e-6)


@pytest.mark.slow
def test_points_before_the_end_of_a_motion_are_kept():
    """x'' = 2 x³ from x = 1 with x' = 1: x = 1/(1 − t)."""
    falling = loads(ONE.format("-x^4/2") + "initial: {x: 1, dot(x): 1}").derive()
    section = falling.section("sin(pi*x) = 0", until=2, accuracy=1e-8)
    (points,) = section.members
    assert points.status != "ok"
    assert "past t = 0.999" in points.reason or "past t = 1:" in points.reason
    assert section.exit_code == 1
    n = np.arange(1, 9)
    np.testing.assert_allclose(section.t[:8], 1 - 1 / n, rtol=0, atol=1e-7)


def test_members_are_the_motions_one_by_one():
    system = loads(TWO).derive()
    many = system.section("x = 0, dot(x) > 0", {"a": [0.1, 0.3]}, until=50)
    assert [points.given for points in many.members] == [{"a": "0.1"}, {"a": "0.3"}]
    assert many.member.tolist() == [0] * 8 + [1] * 8
    for points in many.members:
        alone = loads(TWO, parameters={"a": points.given["a"]}).derive()
        (other,) = alone.section("x = 0, dot(x) > 0", until=50).members
        for name, values in other.columns.items():
            np.testing.assert_array_equal(points.columns[name], values)
    assert next(iter(many.table())) == "member"
    in_two = system.section("x = 0, dot(x) > 0", {"a": [0.1, 0.3]}, until=50, jobs=2)
    np.testing.assert_array_equal(in_two.t, many.t)


def test_a_member_that_cannot_begin_is_named():
    text = ONE.format("-sqrt(x)") + "initial: {x: 1, dot(x): 0}\n"
    section = loads(text).derive().section("x = 2", {"x": [1, -1]}, until=5)
    assert [points.status for points in section.members] == ["ok", "refused"]
    assert section.members[1].reason
    assert section.exit_code == 1


@pytest.mark.parametrize(
    ("condition", "column", "length", "says"),
    [
        ("theta", 1, 5, "one of ="),
        ("theta = 0 = t", 1, 13, "one of ="),
        ("theta = 0, dot(theta) = 0", 12, 14, "one equation"),
        ("dot(theta) > 0", 1, 14, "needs an equation"),
        ("thta = 0", 1, 4, "unknown name 'thta'"),
        ("theta = 0, dot(phi) > 0", 16, 3, "unknown name 'phi'"),
        ("ddot(theta) = 0", 1, 11, "neither accelerations"),
        ("k = 1", 1, 5, "nothing in this equation"),
        ("sign(theta) = 0", 1, 15, "a jump leads past zero"),
        ("1/theta = 0", 1, 11, "never holds"),
        ("theta == 0", 7, 2, "'=='"),
        ("theta = ", 9, 1, "found nothing"),
        ("theta = 1/0", 11, 1, "division by zero"),
    ],
)
def test_a_condition_that_is_none_is_refused_at_its_place(condition, column, length, says):
    with pytest.raises(InputError, match=says) as refusal:
        loads(ROTOR).derive().section(condition, until=1)
    mark = refusal.value.problems[0].mark
    assert (mark.file, mark.column, mark.length) == ("section", column, length)


def test_contacts_and_methods_whose_steps_end_at_samples_are_refused():
    ball = load("systems/contact/bouncing_ball.yaml").derive()
    with pytest.raises(InputError, match="contacts"):
        ball.section("t = 1")
    with pytest.raises(InputError, match="RK4 end at samples"):
        loads(TWO).derive().section("x = 0", until=1, method="RK4")
