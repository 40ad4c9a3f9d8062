"""Every method of the registry beside contacts: it follows them to its tolerance, or is refused."""

from __future__ import annotations

import math
from functools import cache

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators import Integrator
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.results.trajectory import Trajectory
from tests.campaign import values_of
from tests.simulate.available import INSTALLED

G = 9.81

BALL = """
name: ball
parameters: {{m: 1, g: 9.81, e: {e}}}
plane: xz
particles: {{ball: {{mass: m, position: [x, y, z]}}}}
constraints: {{floor: {{unilateral: z >= 0, restitution: e}}}}
potentials: {{weight: {{gravity: g}}}}
initial: {{x: 0, z: {z}, dot(x): 0.5, dot(z): {v}}}
simulate: {{until: {until!r}}}
"""

SPHERE = """
name: sphere
parameters: {m: 1, g: 9.81, R: 1, theta0: 0.3}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {sphere: x^2 + z^2 >= R^2}
potentials: {weight: {gravity: g}}
initial: {x: R*sin(theta0), z: R*cos(theta0)}
simulate: {until: 1.2}
"""

ROPE = """
name: rope
parameters: {m: 1, g: 9.81, l: 1, v0: 5.5}
plane: xz
particles: {p: {mass: m, position: [x, y, z]}}
constraints: {rope: x^2 + z^2 <= l^2}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: -l, dot(x): v0, dot(z): 0}
simulate: {until: 1.6}
"""

#: Methods that a system with contacts accepts, and the others.
FOLLOWING = [m for m in INSTALLED.values() if m.interpolates and m.projects]
REFUSED = [m for m in INSTALLED.values() if m not in FOLLOWING]

following = pytest.mark.parametrize("method", FOLLOWING, ids=lambda m: m.name)
TOLERANCES = [1e-4, 1e-8, 1e-11]


def name_of(value: object) -> str:
    return getattr(value, "name", str(value))


@cache
def model(text: str) -> Model:
    return model_of(loads(text).derive().equations)


def run(text: str, method: type[Integrator], rtol: float, **options: float) -> Trajectory:
    return simulate(model(text), method=method.name, rtol=rtol, **options)


def test_there_are_methods_of_both_kinds():
    assert {"DOP853", "Gauss16", "RK45", "BDF"} <= {m.name for m in FOLLOWING}
    assert {"RK4", "LSODA"} <= {m.name for m in REFUSED}


@pytest.mark.parametrize("method", REFUSED, ids=lambda m: m.name)
def test_the_others_are_refused_with_a_reason(method: type[Integrator]):
    control = {"rtol": 1e-8} if method.adaptive else {"step": 0.01}
    with pytest.raises(InputError, match=f"{method.name} (cannot end its steps|needs what)"):
        simulate(
            model(BALL.format(e=0.5, z=1, v=0, until=3.0)),
            method=method.name,
            samples=11,
            **control,
        )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "rtol", "e"), values_of(FOLLOWING, TOLERANCES, (0.5, 0.9)), ids=name_of
)
def test_bounces_that_accumulate_are_ended(method: type[Integrator], rtol: float, e: float):
    """The ball lies still behind the last bounce; each bounce is where it should be."""
    first = math.sqrt(2 / G)
    limit = first * (1 + e) / (1 - e)
    found = run(BALL.format(e=e, z=1, v=0, until=1.25 * limit), method, rtol)
    assert found.status == "ok", found.reason
    names = [event.name for event in found.events]
    assert names.count("zeno:floor") == 1
    assert names[-1] == "zeno:floor"
    # Steps cannot tell from rest what is lower than their absolute tolerance.
    lowest = rtol / 100 * found.scales["z"]
    rest = 2 * math.sqrt(2 * lowest / G) / (1 - e)
    assert abs(found.events[-1].t - limit) <= max(5e-9, 12 * rest)
    expected = [first * (1 + 2 * sum(e**k for k in range(1, n))) for n in range(1, 5)]
    times = [event.t for event in found.events[:4]]
    assert np.abs(np.array(times) - expected).max() <= 30 * rtol * limit
    assert abs(found.state["z"]) <= 1e-15
    assert found.state["dot(z)"] == 0
    assert found.state["x"] == pytest.approx(0.5 * 1.25 * limit, rel=1e-9)


@pytest.mark.slow
@following
def test_a_ball_without_restitution_stays(method: type[Integrator]):
    found = run(BALL.format(e=0, z=1, v=0, until=1.0), method, 1e-8)
    assert [event.name for event in found.events] == ["contact:floor"]
    assert found.events[0].t == pytest.approx(math.sqrt(2 / G), abs=1e-7)
    assert found.multipliers["floor"][-1] == pytest.approx(G, rel=1e-12)


@pytest.mark.slow
@following
@pytest.mark.parametrize("v", ["-1e-20", "1e-20", "-1e-300", "-1e-9"])
def test_a_start_that_hardly_moves_comes_to_rest(method: type[Integrator], v: str):
    found = run(BALL.format(e=0.5, z=0, v=v, until=1.0), method, 1e-8)
    assert found.status == "ok", found.reason
    assert found.events[-1].name == "zeno:floor"
    assert (found.state["z"], found.state["dot(z)"]) == (0, 0)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "rtol"), values_of(FOLLOWING, TOLERANCES), ids=name_of)
def test_a_sphere_is_left_at_two_thirds(method: type[Integrator], rtol: float):
    found = run(SPHERE, method, rtol)
    assert [event.name for event in found.events] == ["release:sphere"]
    assert found.events[0].state["z"] == pytest.approx(2 / 3 * math.cos(0.3), abs=100 * rtol)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "rtol"), values_of(FOLLOWING, TOLERANCES), ids=name_of)
def test_a_rope_goes_slack_where_the_book_says(method: type[Integrator], rtol: float):
    found = run(ROPE, method, rtol)
    assert found.events[0].name == "release:rope"
    height = (5.5**2 - 2 * G) / (3 * G)
    assert found.events[0].state["z"] == pytest.approx(height, abs=100 * rtol)
    assert found.events[1].name == "contact:rope"
