"""Bodies whose three turns meet an orientation without angles, and the same by a quaternion."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.scene.conditions import Formulation
from lagrange_cli.simulate import Trajectory

#: A top that swings through its lowest place: its angular momentum about the vertical, upwards, is
#: minus that about its axis.
TOP = """
parameters: {g: 9.81, p: 1, A: 1.5, C: 0.8, tilt: 2, w: -p*(1 + cos(tilt))/(A*sin(tilt)^2),
             s: p/C - w*cos(tilt)}
bodies:
  top: {turn: TURN, mass: 1, centre: [0, 0, 1], inertia: {about: origin, moments: [A, A, C]}}
coordinates: [ANGLES]
potentials: {weight: {gravity: g}}
initial: {START}
simulate: {until: 1, accuracy: 1e-3, samples: 11}
"""
BY_ANGLES = (
    TOP.replace("TURN", "[z: phi, x: theta, z: psi]")
    .replace("ANGLES", "phi, theta, psi")
    .replace("START", "phi: 0, theta: tilt, psi: 0, dot(phi): w, dot(theta): 0, dot(psi): s")
)
IN_GIMBALS = (
    BY_ANGLES.replace("turn: [z: phi, x: theta, z: psi]", "on: inner, turn: [z: psi]")
    + "frames: {outer: {turn: [z: phi]}, inner: {on: outer, turn: [x: theta]}}"
)
BY_QUATERNION = (
    TOP.replace("TURN", "{quaternion: [q0, q1, q2, q3]}")
    .replace("ANGLES", "q0, q1, q2, q3")
    .replace(
        "START",
        "q0: cos(tilt/2), q1: sin(tilt/2), q2: 0, q3: 0, dot(q0): 0, dot(q1): 0,"
        " dot(q2): sin(tilt/2)*(w - s)/2, dot(q3): cos(tilt/2)*(w + s)/2",
    )
)
HINT = "turn: {quaternion: [q0, q1, q2, q3]} has no such place"
TOLD = "in multiplier form: the coordinates are singular where sin(theta) = 0"

#: A body that turns about a point beside its centre.
CENTRE = np.array([0.1, 0.2, -0.3])
HEAVY = """
parameters: {g: 9.81, A: MOMENT1, B: MOMENT2, C: MOMENT3}
bodies:
  body: {turn: [AXIS1: phi, AXIS2: theta, AXIS3: psi], mass: 1, centre: [0.1, 0.2, -0.3],
         inertia: [A, B, C]}
points: {end: {on: body, at: [1, 0, 0]}}
coordinates: [phi, theta, psi]
potentials: {weight: {gravity: g}}
outputs: {w1: omega_1(body), w2: omega_2(body), w3: omega_3(body)}
initial: {START}
simulate: {until: 2, accuracy: 1e-9, samples: 21}
"""
ANGLES, PARTS = ["phi", "theta", "psi"], ["q0", "q1", "q2", "q3"]

FORMS: tuple[Formulation, Formulation] = ("minimal", "multiplier")
FAST = [("zxz", 0.0), ("zyx", 1e-9)]

Array = NDArray[np.float64]


def moved(moments: Array, turned: Rotation, spin: Array, times: Array) -> tuple[Rotation, Array]:
    """Orientations and angular velocities along the axes, by Euler's equations in SciPy."""
    tensor = np.diag(moments) + CENTRE @ CENTRE * np.eye(3) - np.outer(CENTRE, CENTRE)

    def slope(_: float, y: Array) -> Array:
        q, w = y[:4], y[4:]
        weight = Rotation.from_quat(np.roll(q, -1)).inv().apply([0, 0, -9.81])
        torque = np.cross(CENTRE, weight) - np.cross(w, tensor @ w)
        rates = [-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]
        return np.append(np.array(rates) / 2, np.linalg.solve(tensor, torque))

    y = np.append(np.roll(turned.as_quat(), 1), spin)
    tight = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
    states = solve_ivp(slope, times[[0, -1]], y, t_eval=times, **tight).y.T
    return Rotation.from_quat(np.roll(states[:, :4], -1, axis=1)), states[:, 4:]


def rates_of(axes: str, angles: Array, spins: Array) -> Array:
    """Rates of angles at which bodies turn with angular velocities along their axes."""
    rows = []
    for row, spin in zip(angles, spins, strict=True):
        columns = []
        for k, axis in enumerate(axes):
            after = Rotation.from_euler(axes.upper(), [*np.zeros(k + 1), *row[k + 1 :]])
            columns.append(after.inv().apply(np.eye(3)["xyz".index(axis)]))
        rows.append(np.linalg.solve(np.array(columns).T, spin))
    return np.array(rows)


def by_angles(axes: str, moments: Array, turned: Rotation, spin: Array) -> str:
    """The heavy body with a start."""
    angles = turned.as_euler(axes.upper())
    (rates,) = rates_of(axes, angles[None], spin[None])
    start = [*angles, *rates]
    names = [*ANGLES, *(f"dot({name})" for name in ANGLES)]
    written = ", ".join(f"{name}: {x!r}" for name, x in zip(names, map(float, start), strict=True))
    text = HEAVY.replace("START", written)
    for k, (axis, moment) in enumerate(zip(axes, moments.tolist(), strict=True), 1):
        text = text.replace(f"AXIS{k}", axis).replace(f"MOMENT{k}", repr(moment))
    return text


def columns_of(run: Trajectory, names: list[str]) -> Array:
    return np.column_stack([run.columns[name] for name in names])


@pytest.mark.parametrize(
    ("axes", "near"),
    [
        *FAST,
        *(
            pytest.param(axes, near, marks=pytest.mark.slow)
            for axes in ("zxz", "zyx", "yzx", "xyx")
            for near in (0.0, 1e-12, 1e-9, 1e-6, 1e-3)
            if (axes, near) not in FAST
        ),
    ],
)
def test_random_bodies_pass_gimbal_lock(axes: str, near: float) -> None:
    """Motions that come as near to it after a second: those from there, run backwards."""
    rng = np.random.default_rng([*axes.encode(), int(near * 1e12)])
    moments = rng.uniform(1, 1.9, 3)
    lock = 0.0 if axes[0] == axes[2] else np.pi / 2
    first, last = rng.uniform(-2, 2, 2)
    there = Rotation.from_euler(axes.upper(), [first, lock + near, last])
    back = moved(moments, there, rng.normal(size=3), np.array([0.0, 1.0]))
    turned, spin = back[0][-1], -back[1][-1]
    run = loads(by_angles(axes, moments, turned, spin)).derive().simulate()
    orientations, spins = moved(moments, turned, spin, run.t)
    assert (run.status, run.exit_code, run.t[-1]) == ("ok", 0, 2)
    assert run.formulation == ("multiplier" if near < 1e-4 else "minimal")
    assert columns_of(run, ["w1", "w2", "w3"]) == pytest.approx(spins, abs=1e-9)
    matrices = orientations.as_matrix()
    places = columns_of(run, ["x_body", "y_body", "z_body", "x_end", "y_end", "z_end"])
    wanted = np.hstack([matrices @ CENTRE, matrices[:, :, 0]])
    assert places == pytest.approx(wanted, abs=1e-9)
    angles, rates = columns_of(run, ANGLES), columns_of(run, [f"dot({name})" for name in ANGLES])
    known = np.isfinite(angles).all(axis=1)
    assert np.flatnonzero(~known).tolist() in ([], [10])
    turns = Rotation.from_euler(axes.upper(), angles[known]).as_matrix()
    assert turns == pytest.approx(matrices[known], abs=3e-9)
    step = 0.1
    assert np.abs(np.diff(angles[known], axis=0)).max() < np.pi + step * np.abs(spins).max() * 4
    known = np.isfinite(rates).all(axis=1)
    assert known.sum() >= 19
    assert rates[known] == pytest.approx(rates_of(axes, angles[known], spins[known]), rel=1e-6)


@pytest.mark.parametrize("text", [BY_ANGLES, IN_GIMBALS])
def test_a_top_goes_on_by_a_quaternion_where_its_angles_end(text: str) -> None:
    run = loads(text).derive().simulate()
    wanted = loads(BY_QUATERNION).derive().simulate()
    assert (run.status, run.formulation) == ("ok", "multiplier")
    assert run.remarks[0] == TOLD
    for name in ("x_top", "y_top", "z_top"):
        assert run.columns[name] == pytest.approx(wanted.columns[name], abs=2e-3)
    assert run.columns["z_top"].min() < -0.9
    squares = sum(wanted.columns[f"q{k}"] ** 2 for k in range(4))
    assert np.abs(squares - 1).max() < 1e-15


@pytest.mark.parametrize(
    "use", ["forces: {push: {on: psi, force: 1e-15}}", "outputs: {rate: dot(psi)}"]
)
def test_angles_that_a_scene_refers_to_stay_and_end(use: str) -> None:
    derivation = loads(BY_ANGLES + use).derive()
    ended = derivation.simulate()
    assert ended.exit_code == 1
    assert str(ended.reason).endswith(HINT)
    with pytest.raises(InputError) as caught:
        derivation.simulate(initial={"theta": "0"})
    hints = caught.value.problems[0].hint.splitlines()
    assert "singular where sin(theta) = 0" in hints[0]
    assert hints[-1] == HINT


@pytest.mark.slow
def test_a_start_at_gimbal_lock_goes_on_by_a_quaternion() -> None:
    """The orientation alone counts there: turns by φ and ψ about one axis are turns by the sum."""
    derivation = loads(BY_ANGLES).derive()
    runs = [
        derivation.simulate(initial={"theta": "0", "phi": phi, "psi": psi, "dot(theta)": "1"})
        for phi, psi in (("0.2", "0.5"), ("0.2", "-0.1"))
    ]
    assert [run.status for run in runs] == ["ok", "ok"]
    assert runs[0].columns["x_top"] == pytest.approx(runs[1].columns["x_top"], abs=1e-3)


@pytest.mark.slow
def test_angles_of_a_long_motion_have_the_accuracy_of_those_without_a_quaternion() -> None:
    start = dict.fromkeys(ANGLES, 1.0) | {f"dot({name})": 2.0 for name in ANGLES}
    text = HEAVY.replace("START", ", ".join(f"{name}: {x}" for name, x in start.items()))
    for k, axis in enumerate("zxz", 1):
        text = text.replace(f"AXIS{k}", axis).replace(f"MOMENT{k}", str(1 + k / 4))
    runs = [loads(text).derive(formulation=form).simulate(until=30) for form in FORMS]
    assert [run.status for run in runs] == ["ok", "ok"]
    assert [run.requested for run in runs] == [1e-9, 1e-9]
    assert [run.formulation for run in runs] == list(FORMS)
    for name in ANGLES:
        assert runs[1].columns[name] == pytest.approx(runs[0].columns[name], abs=1e-9)
