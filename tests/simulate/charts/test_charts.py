"""Motions past places where the scene's coordinates are singular."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.charts.continuation import KnownMotion, continue_coordinates
from lagrange_cli.simulate.charts.inverse import ChartInverse
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.simulation import RunContext

SPHERICAL = """
name: spherical
parameters: {m: 1, l: {value: 1, positive: true}, g: 9.81}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta, phi]
definitions: {x: l*sin(theta)*cos(phi), y: l*sin(theta)*sin(phi), z: -l*cos(theta)}
potentials: {weight: {gravity: g}}
simulate: {until: 5, samples: 101}
"""

#: A height by a root: it ends where the rod is level.
ELBOW = """
name: elbow
parameters: {m: 1, l: {value: 1, positive: true}, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [x]
ROOT
potentials: {weight: {gravity: g}}
initial: {x: 0, z: -1, dot(x): 7}
simulate: {until: 3, samples: 61, accuracy: 1e-9}
"""

POLAR = """
name: polar
parameters: {m: 1, k: 4}
plane: xy
particles: {puck: {mass: m, position: [x, y, z]}}
coordinates: [r, phi]
definitions: {x: r*cos(phi), y: r*sin(phi)}
potentials: {spring: k*(x^2 + y^2)/2}
initial: {r: 1, phi: 0.3, dot(r): 0, dot(phi): 0}
simulate: {until: 5, samples: 51, accuracy: 1e-9}
"""

TOP = """
name: top
parameters: {A: 1, C: 0.5}
coordinates: [phi, theta, psi]
kinetic:
  turning: A/2*(dot(theta)^2 + sin(theta)^2*dot(phi)^2) + C/2*(dot(psi) + cos(theta)*dot(phi))^2
initial: {phi: 0, theta: 0, psi: 0, dot(phi): 1, dot(theta): 0.5, dot(psi): 3}
simulate: {until: 1}
"""


def spherical(theta=1.2, phi=0.0, dtheta=0.0, dphi=0.0):
    state = f"{{theta: {theta!r}, phi: {phi!r}, dot(theta): {dtheta!r}, dot(phi): {dphi!r}}}"
    return SPHERICAL + f"initial: {state}\n"


def ran(text, formulation="auto", **how):
    return loads(text).derive(formulation=formulation).simulate(**how)


def height(t, theta0=1.2, g=9.81):
    """sin and cos of a pendulum's angle released at rest, by Jacobi's functions."""
    k = np.sin(theta0 / 2)
    sn = ellipj(ellipk(k**2) - np.sqrt(g) * t, k**2)[0]
    half = k * sn
    return 2 * half * np.sqrt(1 - half**2), 1 - 2 * half**2


def turning(t, rate, g=9.81):
    """x and z of a pendulum that goes round and round, from its lowest point, l = 1."""
    sn, cn, _, _ = ellipj(rate / 2 * t, 4 * g / rate**2)
    return 2 * sn * cn, 2 * sn**2 - 1


def cartesian_reference(start, t, g=9.81):
    """A spherical pendulum in x, y, z by SciPy, tension from the constraint."""

    def rhs(_, y):
        r, v = y[:3], y[3:]
        a = np.array([0, 0, -g])
        return [*v, *(a - (v @ v + a @ r) / (r @ r) * r)]

    found = solve_ivp(rhs, (0, t[-1]), start, "DOP853", t, rtol=1e-13, atol=1e-15)
    assert found.success
    return found.y


# Through the pole.


def test_exactly_through_the_pole():
    """φ stands still and θ changes sign: the angles' own equations go through."""
    run = ran(spherical(), accuracy=1e-9)
    assert (run.status, run.formulation) == ("ok", "minimal")
    sin, cos = height(run.t)
    assert np.abs(run.columns["x"] - sin).max() < 1e-9
    assert np.abs(run.columns["z"] + cos).max() < 1e-9


@pytest.mark.slow
def test_exactly_through_the_pole_with_multipliers():
    run = ran(spherical(phi=0.4), "multiplier", accuracy=1e-9)
    assert (run.status, run.formulation) == ("ok", "multiplier")
    sin, cos = height(run.t)
    assert np.abs(run.columns["theta"] - np.arctan2(sin, cos)).max() < 2e-9
    assert np.abs(run.columns["phi"] - 0.4).max() < 1e-9
    assert any("one choice of several" in remark for remark in run.remarks)


@pytest.mark.slow
@pytest.mark.parametrize("dphi", [1e-9, 1e-4, 0.02, -1.0])
def test_near_the_pole(dphi):
    """Both forms give the position; angles are those of the motion, or said to be a choice."""
    few = ran(spherical(dphi=dphi), "minimal", accuracy=1e-8)
    many = ran(spherical(dphi=dphi), "multiplier", accuracy=1e-8)
    assert few.status == many.status == "ok"
    start = [np.sin(1.2), 0, -np.cos(1.2), 0, np.sin(1.2) * dphi, 0]
    exact = cartesian_reference(start, few.t)
    for run in (few, many):
        for name, values in zip(("x", "y", "z"), exact[:3], strict=True):
            assert np.abs(run.columns[name] - values).max() < 2e-8
    theta, phi = many.columns["theta"], many.columns["phi"]
    assert np.abs(np.sin(theta) * np.cos(phi) - many.columns["x"]).max() < 1e-8
    assert np.abs(np.sin(theta) * np.sin(phi) - many.columns["y"]).max() < 1e-8
    if many.remarks:
        assert abs(dphi) < 1e-7
    else:
        assert np.abs(theta - few.columns["theta"]).max() < 1e-7
        assert np.abs(phi - few.columns["phi"]).max() < 1e-6


@pytest.mark.slow
def test_steps_over_the_pole_are_noticed():
    """A fixed step passes the pole unseen, with θ on the wrong side: not kept as it is."""
    text, how = spherical(dphi=1e-6), {"method": "RK4", "step": 0.01, "samples": 101}
    run = ran(text, **how)
    assert (run.status, run.formulation) == ("ok", "multiplier")
    assert "singular where sin(theta) = 0" in run.remarks[0]
    exact = cartesian_reference([np.sin(1.2), 0, -np.cos(1.2), 0, np.sin(1.2) * 1e-6, 0], run.t)
    assert np.abs(run.columns["x"] - exact[0]).max() < 1e-5
    kept = ran(text, "minimal", **how)
    assert kept.status == "accuracy_not_reached"
    assert "sin(theta) = 0" in kept.reason
    assert kept.exit_code == 1
    assert (np.sin(kept.columns["theta"]) > 0).all()
    assert len(kept.t) < len(run.t)


@pytest.mark.slow
def test_start_at_the_pole():
    run = ran(spherical(theta=0.0, dtheta=2.0, phi=0.7), accuracy=1e-9)
    assert (run.status, run.formulation) == ("ok", "multiplier")
    assert "in multiplier form" in run.remarks[0]
    along = np.hypot(run.columns["x"], run.columns["y"])
    assert np.abs(run.columns["y"] - np.tan(0.7) * run.columns["x"]).max() < 1e-12
    exact = cartesian_reference([0, 0, -1, 2, 0, 0], run.t)
    assert np.abs(along - np.abs(exact[0])).max() < 1e-9
    assert run.columns["theta"][0] == 0.0
    assert run.columns["phi"][0] == 0.7
    assert np.abs(run.columns["phi"] - 0.7).max() < 1e-8


def test_start_at_the_pole_in_minimal_form_is_refused():
    with pytest.raises(InputError) as caught:
        ran(spherical(theta=0.0, dtheta=2.0), "minimal", accuracy=1e-9)
    assert "sin(theta) = 0" in caught.value.problems[0].hint


@pytest.mark.slow
def test_coordinates_are_left_only_where_the_formulation_is_free():
    """One rule for commands, ensembles, stress runs and Python."""
    model = model_of(derive(read_text(spherical(theta=0.0, dtheta=1.0, dphi=2.0))))
    asked_for = []

    def other():
        asked_for.append("multiplier")
        raise InputError(Problem("there is none"))

    for asked, scenes, free in (
        (None, None, True),
        ("auto", "minimal", True),
        (None, "auto", True),
        (None, "minimal", False),
        ("minimal", None, False),
        ("multiplier", "auto", False),
    ):
        given = replace(model, defaults=replace(model.defaults, formulation=scenes))
        asked_for.clear()
        with pytest.raises(InputError, match="singular"):
            simulate_past_singularities(given, SimulationOptions(), other, formulation=asked)
        assert bool(asked_for) is free


@pytest.mark.slow
def test_start_at_the_pole_in_cartesian_names():
    text = SPHERICAL + "initial: {x: 0, y: 0, z: -1, dot(x): 1, dot(y): 2}\n"
    run = ran(text, accuracy=1e-9)
    assert (run.status, run.formulation) == ("ok", "multiplier")
    exact = cartesian_reference([0, 0, -1, 1, 2, 0], run.t)
    assert np.abs(run.columns["y"] - exact[1]).max() < 1e-8
    assert np.isnan(run.columns["phi"][0]), "the azimuth of the pole is unknown"
    phi = run.columns["phi"][np.isfinite(run.columns["phi"])]
    assert len(phi) > 95
    assert np.abs(np.tan(phi) - 2).max() < 1e-6


# The elbow of a root.

ROD = "constraints: {rod: x^2 + z^2 = l^2}"
DEFINED = "definitions: {z: -sqrt(l^2 - x^2)}"


@pytest.mark.slow
@pytest.mark.parametrize("root", [ROD, DEFINED])
def test_past_the_elbow(root):
    run = ran(ELBOW.replace("ROOT", root))
    assert (run.status, run.formulation) == ("ok", "multiplier")
    x, z = turning(run.t, 7.0)
    assert z.max() > 0.99
    assert np.abs(run.columns["x"] - x).max() <= 1e-9
    assert np.abs(run.columns["z"] - z).max() <= 1e-9
    assert "in multiplier form" in run.remarks[0]


def test_before_the_elbow_nothing_changes():
    run = ran(ELBOW.replace("ROOT", ROD).replace("dot(x): 7", "dot(x): 2"))
    assert (run.status, run.formulation, run.remarks) == ("ok", "minimal", ())


def test_the_elbow_in_minimal_form():
    run = ran(ELBOW.replace("ROOT", ROD), "minimal")
    assert run.status != "ok"
    assert run.exit_code == 1
    assert "singular where" in run.reason
    x, _ = turning(run.t, 7.0)
    assert np.abs(run.columns["x"] - x).max() <= 1e-9


@pytest.mark.slow
def test_the_scene_may_ask_for_a_form():
    text = ELBOW.replace("ROOT", ROD).replace("dot(x): 7", "dot(x): 2")
    run = ran(text.replace("simulate: {", "simulate: {formulation: multiplier, "))
    assert (run.status, run.formulation) == ("ok", "multiplier")
    text = ELBOW.replace("ROOT", ROD).replace("simulate: {", "simulate: {formulation: minimal, ")
    assert ran(text).formulation == "minimal"


# No other form.


def test_no_cartesian_form():
    """Euler angles of a body that is given by its kinetic energy alone."""
    with pytest.raises(InputError) as caught:
        ran(TOP)
    assert "sin(theta) = 0" in caught.value.problems[0].hint


@pytest.mark.slow
def test_euler_angles_through_the_vertical_where_their_motion_is_regular():
    """With p_φ = p_ψ the axis of a free top passes the vertical, and φ's rate stays finite."""
    theta, p = 0.5, 1.5
    phi_rate = p * (1 - np.cos(theta)) / np.sin(theta) ** 2
    psi_rate = p / 0.5 - np.cos(theta) * phi_rate
    state = f"{{phi: 0, theta: {theta}, psi: 0, dot(theta): -2, "
    state += f"dot(phi): {float(phi_rate)!r}, dot(psi): {float(psi_rate)!r}}}"
    start = TOP.index("initial:")
    text = TOP[:start] + f"initial: {state}\nsimulate: {{until: 0.45}}\n"
    run = ran(text, method="RK4", step=0.009, samples=51)
    assert run.status == "ok"
    assert run.columns["theta"][-1] < -0.1
    assert np.abs(run.columns["dot(phi)"] - phi_rate).max() < 0.1 * phi_rate


def test_through_the_origin_of_polar_coordinates():
    """r passes zero with φ at rest: x = cos 2t along a line."""
    run = ran(POLAR)
    assert run.status == "ok"
    assert np.abs(run.columns["x"] - np.cos(0.3) * np.cos(2 * run.t)).max() < 1e-9


# Coordinates along a motion.


def circle(t, y):
    return np.array([np.cos(y[0]), np.sin(y[0])])


def circling(t, y):
    return y[1] * np.array([-np.sin(y[0]), np.cos(y[0])])


def samples(angle, rate, t):
    positions = np.column_stack([np.cos(angle), np.sin(angle)])
    velocities = rate[:, None] * np.column_stack([-np.sin(angle), np.cos(angle)])
    return KnownMotion(t, positions, velocities, np.full(2, 1e-12))


@pytest.mark.slow
def test_an_angle_is_followed_over_many_turns():
    t = np.linspace(0, 10, 201)
    angle, rate = 40 * t + np.sin(t), 40 + np.cos(t)
    found = continue_coordinates(
        samples(angle, rate, t), np.array([0.0, 41.0]), 1, circle, circling
    )
    assert np.abs(found.q[:, 0] - angle).max() < 1e-10
    assert np.abs(found.v[:, 0] - rate).max() < 1e-9
    assert found.lost == ()


def test_an_angle_without_a_start():
    t = np.linspace(0, 1, 21)
    angle, rate = 0.4 + t, np.ones_like(t)
    found = continue_coordinates(samples(angle, rate, t), None, 1, circle, circling)
    assert np.abs(found.q[:, 0] - angle).max() < 1e-12


# Few samples.


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "form"),
    [
        (ELBOW.replace("ROOT", ROD), "auto"),
        (spherical(dphi=1e-6), "auto"),
        (spherical(dphi=1.0), "multiplier"),
    ],
)
def test_few_samples_are_those_of_many(text, form):
    few, many = (ran(text, form, accuracy=1e-9, samples=n) for n in (6, 501))
    assert (few.status, few.formulation) == ("ok", many.formulation)
    assert np.allclose(few.t, many.t[::100], 1e-15, 0)
    assert few.remarks == many.remarks
    for name, values in few.columns.items():
        size = max(1.0, float(np.nanmax(np.abs(many.columns[name]))))
        assert np.allclose(values, many.columns[name][::100], 0, 1e-8 * size, equal_nan=True), name


def test_few_samples_before_the_elbow():
    run = ran(ELBOW.replace("ROOT", ROD), "minimal", samples=6)
    assert run.status != "ok"
    assert len(run.t) == len(run.energy) == len(run.columns["x"]) == 1
    assert run.t[-1] == run.holds_until == 0.0


SPIN = """
name: spin
parameters: {m: 1, l: 1}
plane: xz
particles: {a: {mass: m, position: [x, y, z]}}
coordinates: [p]
definitions: {x: l*sin(p), z: -l*cos(p)}
initial: {p: 0, dot(p): RATE}
simulate: {until: 5, accuracy: 1e-8, samples: 2}
"""


@pytest.mark.slow
@pytest.mark.parametrize("rate", [40.0, 150.0])
def test_many_turns_between_two_samples(rate):
    run = ran(SPIN.replace("RATE", str(rate)), "multiplier")
    assert run.status == "ok"
    assert run.t.tolist() == [0.0, 5.0]
    assert abs(run.columns["p"][-1] - 5 * rate) < 1e-7 * 5 * rate
    assert run.all_evaluations < 10_000 * rate
    assert run.seconds["follow"] > 0


@pytest.mark.slow
def test_turns_that_are_too_many_are_refused(monkeypatch):
    for name in ("passages.WATCHED", "passages._FINEST"):
        monkeypatch.setattr(f"lagrange_cli.simulate.charts.{name}", 20)
    run = ran(SPIN.replace("RATE", "80"), "multiplier", until=0.6)
    assert run.status == "accuracy_not_reached"
    assert "p cannot be followed past t = 0" in run.reason
    assert run.t.tolist() == [0.0]


def test_following_ends_in_time():
    t = np.linspace(0, 10, 201)
    known = samples(40 * t, np.full_like(t, 40.0), t)
    found = continue_coordinates(known, np.array([0.0, 40.0]), 1, circle, circling, deadline=0.0)
    assert len(found.q) == len(found.v) == 1


# Models.


@pytest.mark.parametrize("formulation", ["minimal", "multiplier"])
def test_models_keep_what_they_know_of_charts(formulation):
    model = model_of(derive(read_text(spherical()), formulation=formulation))
    assert Model.from_json(json.loads(json.dumps(model.to_json()))) == model
    if formulation == "minimal":
        (place,) = model.singular
        assert (place.where, place.lost, place.ends) == ("sin(theta) = 0", ("phi",), False)
    else:
        assert model.singular == ()
        assert model.chart.coordinates == ("theta", "phi")


def test_a_budget_counts_for_both_runs():
    model = model_of(derive(read_text(ELBOW.replace("ROOT", ROD))))
    budgets = []

    def other():
        return model_of(derive(read_text(ELBOW.replace("ROOT", ROD)), formulation="multiplier"))

    context = RunContext(progress=budgets.append)
    run = simulate_past_singularities(model, SimulationOptions(budget=500.0), other, context)
    assert run.formulation == "multiplier"
    assert budgets == sorted(budgets), "progress never falls"


@pytest.mark.slow
def test_an_orbit_in_metres_is_followed_as_one_in_orbits() -> None:
    """1e10 metres of the angle are no more than a metre of the radius: both are followed."""
    equations = load("systems/celestial/kepler.yaml").derive(formulation="multiplier").equations
    found = simulate_past_singularities(model_of(equations), SimulationOptions(accuracy=1e-6))
    assert found.status == "ok"
    columns = found.columns
    place = np.hypot(columns["x_planet"], columns["y_planet"])
    assert np.abs(columns["r"] - place).max() <= 1e-9 * place.max()
    assert columns["phi"][-1] > 2 * np.pi - 0.1


@pytest.mark.slow
def test_the_side_of_a_passage_is_not_guessed():
    """A mass that falls past its pulley within 1e-9: angles read off positions end before it."""
    scene = load(
        Path(__file__).parents[3] / "systems/pulleys/swinging_atwood.yaml",
        initial={"theta": "3.141592652589793"},
    )
    run = scene.derive(formulation="multiplier").simulate(accuracy=1e-9, until=1.0)
    exact = scene.derive().simulate(accuracy=1e-9, until=1.0)
    assert run.status == "accuracy_not_reached"
    kept = len(run.t)
    assert np.abs(run.columns["theta"] - exact.columns["theta"][:kept]).max() < 1e-8


def spherical_positions(t, y):
    theta, phi = y[:2]
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def spherical_velocities(t, y):
    theta, phi, *rates = y
    columns = [
        [np.cos(theta) * np.cos(phi), -np.sin(theta) * np.sin(phi)],
        [np.cos(theta) * np.sin(phi), np.sin(theta) * np.cos(phi)],
        [-np.sin(theta), 0],
    ]
    return np.array(columns) @ rates


@pytest.mark.parametrize("theta", [1.0, 1e-2])
def test_rates_are_those_where_the_coordinates_end(theta):
    """Newton's last step may be a thousand units in the last place, and changes ∂r/∂q."""
    inverse = ChartInverse(spherical_positions, spherical_velocities, np.full(3, 1e-15))
    draw = np.random.default_rng(5)
    for _ in range(300):
        q = np.array([theta * draw.uniform(0.5, 2), draw.uniform(-3, 3)])
        rates = draw.normal(size=2) * [1, 1 / theta]
        state = np.concatenate([q, rates])
        guess = q + [theta, 1] * draw.uniform(-1, 1, 2) * 10.0 ** draw.uniform(-9, -1)
        point = inverse.point(
            0.0, guess, spherical_positions(0, state), spherical_velocities(0, state)
        )
        # Rounding of the positions moves phi by their size over sin(theta).
        assert np.abs(point.v - rates).max() < 2e-15 / theta * np.abs(rates).max()
