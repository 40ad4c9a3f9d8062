"""Motion with one-sided constraints against closed forms, compiled and interpreted."""

from __future__ import annotations

import itertools
import math
from fractions import Fraction
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.functions import RightHandSide, interpreted
from tests.campaign import slice_of
from tests.simulate.compiling import compiled_or_skip

G = 9.81

BALL = """
name: ball
parameters: {m: 1, g: 9.81, e: 0.8}
plane: xz
particles: {ball: {mass: m, position: [x, y, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: e}}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: 1, dot(x): 0.5}
simulate: {until: 3}
"""

SPHERE = """
name: sphere
parameters: {m: 1, g: 9.81, R: {value: 1, positive: true}, theta0: 0.2}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {sphere: x^2 + z^2 >= R^2}
potentials: {weight: {gravity: g}}
initial: {x: R*sin(theta0), z: R*cos(theta0)}
simulate: {until: 1.2}
"""

#: A pendulum (a closure) that swings against a wall.
PENDULUM_AT_WALL = """
name: pendulum_at_wall
parameters: {m: 1, g: 9.81, l: 1, d: 0.3, e: 0.7}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
constraints:
  rod: x^2 + z^2 = l^2
  wall: {unilateral: x >= -d, restitution: e}
potentials: {weight: {gravity: g}}
initial: {x: 0.6, z: -0.8}
simulate: {until: 4}
"""

#: The same by its angle.
PENDULUM_AT_WALL_BY_ANGLE = """
name: pendulum_at_wall
parameters: {m: 1, g: 9.81, l: 1, d: 0.3, e: 0.7}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: {theta: {unit: rad}}
definitions: {x: l*sin(theta), z: -l*cos(theta)}
constraints: {wall: {unilateral: x >= -d, restitution: e}}
potentials: {weight: {gravity: g}}
initial: {theta: asin(0.6)}
simulate: {until: 4}
"""

BOX = """
name: box
parameters: {m: 1}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints:
  left: {unilateral: x >= 0, restitution: 1}
  right: {unilateral: x <= 1, restitution: 1}
  bottom: {unilateral: z >= 0, restitution: 1}
  top: {unilateral: z <= 1, restitution: 1}
initial: {x: 0.5, z: 0.5, dot(x): 1, dot(z): 1}
simulate: {until: 5.2}
"""


PATHS = ["compiled", "interpreted"]


def on_both_paths(values: list) -> list[tuple]:
    """All values by compiled code, and one of them interpreted, which takes ten times as long."""
    both = list(itertools.product(PATHS, values))
    return slice_of(both, 1, lambda case: case[0] == "compiled")


def functions_of(model: Model, path: str) -> RightHandSide:
    return interpreted(model, "asked for") if path == "interpreted" else compiled_or_skip(model)


@cache
def model(text: str) -> Model:
    return model_of(loads(text).derive().equations)


def run(text: str, path: str = "compiled", **options: float | str) -> Trajectory:
    return simulate(model(text), functions=functions_of(model(text), path), **options)


def names(found: Trajectory) -> list[str]:
    return [event.name for event in found.events]


def bounces(e: float, h: float = 1.0) -> list[float]:
    """Times at which a ball dropped from h bounces."""
    first = math.sqrt(2 * h / G)
    return [first * (1 + 2 * sum(e**k for k in range(1, n))) for n in range(1, 40)]


@pytest.mark.slow
@pytest.mark.parametrize(("path", "e"), on_both_paths(["0.8", "1", "0.3"]))
def test_a_ball_bounces_as_its_restitution_says(path: str, e: str):
    found = run(BALL.replace("e: 0.8", f"e: {e}"), path, accuracy=1e-9, until=1.2)
    expected = [t for t in bounces(float(e)) if t < 1.2]
    if e == "0.3":  # all bounces end at 0.84
        assert found.status == "accuracy_not_reached"
        assert found.holds_until == pytest.approx(0.45152364 * 1.3 / 0.7, abs=0.0025)
        expected = expected[: len(found.events) - 1]
    else:
        assert found.status == "ok"
    times = [event.t for event in found.events][: len(expected)]
    assert times == pytest.approx(expected, abs=1e-9 * 1.2)
    assert found.energy_drift is not None
    assert found.energy_drift < 1e-12  # what impacts take is no drift


def test_the_promise_ends_where_bounces_accumulate_and_a_method_goes_on():
    limit = math.sqrt(2 / G) * 1.5 / 0.5
    text = BALL.replace("e: 0.8", "e: 0.5")
    promised = run(text, accuracy=1e-9, until=3)
    assert promised.status == "accuracy_not_reached"
    assert promised.exit_code == 1
    assert limit - 0.006 <= promised.holds_until < limit
    assert names(promised)[-1] == "zeno:floor"
    assert promised.events[-1].t == pytest.approx(limit, abs=3e-9)
    assert "'floor'" in promised.reason
    found = run(text, method="DOP853", rtol=1e-9, until=3)
    assert found.status == "ok"
    assert found.state["z"] == pytest.approx(0, abs=1e-12)
    assert found.state["dot(z)"] == pytest.approx(0, abs=1e-9)
    assert found.state["x"] == pytest.approx(1.5, abs=1e-12)
    rest = found.t > limit + 0.01
    assert found.multipliers["floor"][rest] == pytest.approx(G, rel=1e-12)
    assert (found.multipliers["floor"][found.t < limit - 0.01] == 0).all()


@pytest.mark.slow
@pytest.mark.parametrize(("path", "start"), on_both_paths([1e-3, 0.2, 1.0, 1.5]))
def test_a_particle_leaves_the_sphere_at_two_thirds(path: str, start: float):
    text = SPHERE.replace("theta0: 0.2", f"theta0: {start!r}")
    found = run(text, path, accuracy=1e-9, until=4 if start < 0.01 else 1.2)
    assert found.status == "ok"
    assert names(found) == ["release:sphere"]
    state = found.events[0].state
    assert abs(state["z"] - 2 / 3 * math.cos(start)) <= 1e-9
    assert found.constraint_drift is not None
    assert found.constraint_drift <= 1e-14


@pytest.mark.slow
@pytest.mark.parametrize(("m", "radius", "g"), [(1e-31, 1e-12, 1e3), (1e30, 1e16, 1e-3)])
def test_units_do_not_matter(m: float, radius: float, g: float):
    text = SPHERE.replace("m: 1,", f"m: {m!r},").replace("value: 1,", f"value: {radius!r},")
    text = text.replace("g: 9.81", f"g: {g!r}")
    found = run(text, accuracy=1e-9, until=1.1 * math.sqrt(radius / g) * math.sqrt(G))
    assert names(found) == ["release:sphere"]
    assert abs(found.events[0].state["z"] / radius - 2 / 3 * math.cos(0.2)) <= 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("path", "eps"), on_both_paths([1e-3, 1e-6, 1e-11]))
def test_every_sample_and_event_is_as_accurate_as_promised(path: str, eps: float):
    found = run(BALL, path, accuracy=eps)
    assert found.status == "ok"
    times = bounces(0.8)
    for t, z, speed in zip(found.t, found.columns["z"], found.columns["dot(z)"], strict=True):
        k = sum(at <= t for at in times)
        since = t - times[k - 1] if k else t
        start = math.sqrt(2 * G) * 0.8**k if k else 0.0
        exact = (start * since - G * since**2 / 2) if k else 1 - G * t**2 / 2
        assert abs(z - exact) <= eps * found.scales["z"]
        if t not in found.exempt:
            assert abs(speed - (start - G * since)) <= eps * found.scales["dot(z)"]
    assert found.estimated is not None
    assert found.estimated < eps
    for event, at in zip(found.events, times, strict=False):
        assert abs(event.t - at) <= eps * 3


@pytest.mark.slow
@pytest.mark.parametrize("path", slice_of(PATHS, 0, lambda path: path == "compiled"))
def test_closures_and_contacts_together_agree_with_coordinates(path: str):
    kept = run(PENDULUM_AT_WALL, path, accuracy=1e-9)
    reduced = run(PENDULUM_AT_WALL_BY_ANGLE, path, accuracy=1e-9)
    assert kept.status == reduced.status == "ok"
    assert names(kept) == names(reduced)
    assert len(kept.events) >= 2
    assert [e.t for e in kept.events] == pytest.approx([e.t for e in reduced.events], abs=4e-9)
    for name in ("x", "z", "dot(x)", "dot(z)"):
        scale = np.abs(kept.columns[name]).max()
        assert np.abs(kept.columns[name] - reduced.columns[name]).max() <= 4e-9 * scale


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled", "interpreted"])
def test_walls_that_are_met_at_once(path: str):
    """Along the diagonal of a box, two walls are met at the same time."""
    found = run(BOX, path, accuracy=1e-9)
    assert found.status == "ok"
    t = found.t
    exact = np.abs((t + 0.5 + 1) % 2 - 1)
    assert np.abs(found.columns["x"] - exact).max() <= 1e-9
    assert np.abs(found.columns["z"] - exact).max() <= 1e-9
    assert len(found.events) == 10
    assert {e.name for e in found.events[:2]} == {"contact:right", "contact:top"}


def test_a_start_that_meets_a_contact_is_an_impact():
    text = BALL.replace("z: 1,", "z: 0, dot(z): -2,")
    found = run(text, accuracy=1e-9, until=0.2)
    assert names(found) == ["contact:floor"]
    assert found.events[0].t == 0
    assert found.events[0].before["dot(z)"] == -2
    assert found.events[0].state["dot(z)"] == pytest.approx(1.6, rel=1e-15)
    assert found.state["z"] == pytest.approx(1.6 * 0.2 - G * 0.02, abs=1e-12)


def test_a_start_at_rest_on_a_contact_stays():
    found = run(BALL.replace("z: 1,", "z: 0,"), accuracy=1e-9)
    assert found.status == "ok"
    assert not found.events
    assert (found.columns["z"] == 0).all()
    assert found.multipliers["floor"] == pytest.approx(G, rel=1e-14)


@pytest.mark.slow
def test_a_small_obstacle_is_not_passed_unseen():
    """A disc of a ten-millionth of the way stops a particle that meets it head on."""
    text = """
name: obstacle
parameters: {R: 1e-6, m: 1}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {disc: {unilateral: x^2 + z^2 >= R^2, restitution: 1}}
initial: {x: -5.3, z: 0, dot(x): 1, dot(z): 0}
simulate: {until: 10}
"""
    found = run(text, accuracy=1e-9)
    assert names(found) == ["contact:disc"]
    assert found.events[0].t == pytest.approx(5.3 - 1e-6, abs=1e-8)
    assert found.state["dot(x)"] == pytest.approx(-1, rel=1e-12)


@pytest.mark.slow
def test_grazing_is_right_or_refused():
    """A flat shot that just touches a disc, from above or from inside its radius."""
    text = """
name: grazing
parameters: {m: 1, b: 1.0}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {disc: {unilateral: x^2 + z^2 >= 1, restitution: 1}}
initial: {x: -3, z: b, dot(x): 1, dot(z): 0}
simulate: {until: 6, samples: 61}
"""
    for offset in (0.0, 1e-15, -1e-15, 1e-12, -1e-12, 1e-9, -1e-9, 1e-6, -1e-6):
        b = 1 + offset
        found = run(text.replace("b: 1.0", f"b: {b!r}"), accuracy=1e-6)
        normal = math.sqrt(max(1 - b * b, 0.0))
        meets = b < 1
        # Reflection turns the velocity by twice the angle at the disc.
        angle = 2 * math.acos(b) if meets else 0.0
        exact = np.where(
            found.t < 3 - normal,
            b,
            b + np.sin(angle) * (found.t - 3 + normal),
        )
        off = np.abs(found.columns["z"] - exact).max()
        scale = max(found.scales["z"], found.scales["x"] * 1e-3)
        assert off <= 1e-6 * scale, (offset, found.status, off)
        assert found.status == "ok" or found.holds_until == pytest.approx(3, abs=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("path", ["compiled", "interpreted"])
def test_contacts_and_inputs_from_files_together(path: str, tmp_path: Path):
    """A ball under a weight that doubles at 0.2 s, between its start and its first bounce."""
    (tmp_path / "pull.csv").write_text("t,pull\n0,1\n0.2,2\n9,2\n", encoding="ascii")
    scene = tmp_path / "pulled.yaml"
    scene.write_text(
        """
name: pulled
parameters: {m: 1, g: 9.81}
plane: xz
particles: {ball: {mass: m, position: [x, y, z]}}
inputs: {pull: {file: pull.csv, column: pull, interpolation: previous}}
constraints: {floor: {unilateral: z >= 0, restitution: 1}}
forces: {weight: {on: ball, force: [0, 0, -m*g*pull]}}
initial: {x: 0, z: 1}
simulate: {until: 1.5}
""",
        encoding="ascii",
    )
    pulled = model_of(load(scene).derive().equations)
    found = simulate(pulled, functions=functions_of(pulled, path), accuracy=1e-9)
    assert found.status == "ok"
    height, speed = 1 - G * 0.2**2 / 2, G * 0.2
    speed_below = math.sqrt(speed**2 + 4 * G * height)
    first = 0.2 + (speed_below - speed) / (2 * G)
    assert found.events[0].t == pytest.approx(first, abs=1e-9)
    assert found.events[1].t == pytest.approx(first + speed_below / G, abs=1e-9)


@pytest.mark.parametrize("method", ["DOP853", "Gauss16", "RK45", "Radau", "BDF"])
def test_methods_with_an_interpolant_find_contacts(method: str):
    found = run(BALL, method=method, rtol=1e-8)
    assert names(found) == ["contact:floor"] * 6
    assert [e.t for e in found.events] == pytest.approx(bounces(0.8)[:6], abs=1e-6)


@pytest.mark.parametrize(
    "options",
    [
        {"method": "LSODA", "rtol": 1e-8},
        {"method": "RK4", "step": 0.01},
    ],
)
def test_other_methods_are_refused(options: dict[str, float | str]):
    with pytest.raises(InputError, match="where a contact closes"):
        run(BALL, **options)


@pytest.mark.slow
@pytest.mark.parametrize(("start", "speed", "until"), [(0.3, -0.1, 3), (1.0, -0.1, 10)])
def test_an_impact_at_the_very_end_does_not_end_the_promise(
    start: float, speed: float, until: float
):
    text = f"""
name: end
parameters: {{m: 1}}
particles: {{p: {{mass: m, position: [x, 0, 0]}}}}
constraints: {{a: {{unilateral: x >= 0, restitution: 1}}}}
initial: {{x: {start!r}, dot(x): {speed!r}}}
simulate: {{until: {until}}}
"""
    found = run(text, accuracy=1e-9, samples=4)
    assert found.status == "ok", found.reason
    assert abs(found.state["x"]) <= 1e-9 * start


@pytest.mark.slow
def test_balls_that_touch_are_struck_at_once():
    """Moreau's law for three touching balls: the last two go on together, and stay in touch."""
    text = """
name: cradle
parameters: {m: 1}
particles:
  a: {mass: m, position: [x1, 0, 0]}
  b: {mass: m, position: [x2, 0, 0]}
  c: {mass: m, position: [x3, 0, 0]}
constraints:
  ab: {unilateral: x2 - x1 >= 1, restitution: 1}
  bc: {unilateral: x3 - x2 >= 1, restitution: 1}
initial: {x1: 0, x2: 1, x3: 2, dot(x1): 1, dot(x2): 0, dot(x3): 0}
simulate: {until: 2}
"""
    found = run(text, accuracy=1e-9)
    assert found.status == "ok", found.reason
    assert len(found.events) == 1
    speeds = [found.state[f"dot(x{k})"] for k in (1, 2, 3)]
    assert speeds == pytest.approx([-1 / 3, 2 / 3, 2 / 3], rel=1e-12)


def test_energy_drift_counts_beside_what_impacts_took():
    """All samples but the first are at rest: the energy that was lost is the size."""
    found = run(BALL.replace("e: 0.8", "e: 0.3"), method="DOP853", rtol=1e-9, until=4, samples=3)
    assert found.energy_drift is not None
    assert found.energy_drift < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize(("path", "height"), on_both_paths([0.1, 0.3, 1.0, 2.7, 1e6]))
def test_an_impact_at_the_very_end_exempts_its_velocity(path: str, height: float):
    """Whether it has happened is more than arithmetic can tell; elsewhere it is told, and right."""
    text = BALL.replace("z: 1", f"z: {height}")
    fall = math.sqrt(2 * height / G)
    for ulps in (-1, 0, 1):
        until = fall + ulps * math.ulp(fall)
        found = run(text, path, accuracy=1e-9, until=until)
        assert found.status == "ok"
        struck = Fraction(until) ** 2 * Fraction(str(G)) > 2 * Fraction(str(height))
        assert until in found.exempt or (found.columns["dot(z)"][-1] > 0) == struck
        assert until in found.exempt or ulps
        assert abs(found.columns["z"][-1]) <= 1e-9 * height
    for until, speed in ((fall * (1 - 1e-6), -1.0), (fall * (1 + 1e-6), 0.8)):
        found = run(text, path, accuracy=1e-9, until=until)
        assert until not in found.exempt
        assert found.columns["dot(z)"][-1] == pytest.approx(speed * G * fall, rel=1e-5)
