"""Generated scenes with contacts against SciPy's events and Gauss' principle."""

from __future__ import annotations

import math

import numpy as np
import pytest
import sympy as sp
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from lagrange_cli import loads
from lagrange_cli.simulate import Trajectory, simulate
from tests.systems import lagranges_method
from tests.systems.contact_reference import ContactReference

pytestmark = pytest.mark.slow

EPS = 1e-8


def polygon(directions: list[float], distances: list[float]) -> list[tuple[float, float, float]]:
    """Half-planes a x + b z + c ≥ 0 around the origin."""
    pairs = zip(directions, distances, strict=True)
    return [(round(-math.cos(u), 6), round(-math.sin(u), 6), d) for u, d in pairs]


def scene(
    walls: list[tuple[float, float, float]], e: list[float], velocity: tuple[float, float]
) -> str:
    # Numbers are parameters, so that one code serves every example.
    sizes = ["m: 1.7", "g: 9.81"]
    lines = []
    for k, (a, b, c) in enumerate(walls):
        sizes += [f"a{k}: {a!r}", f"b{k}: {b!r}", f"c{k}: {c!r}", f"e{k}: {e[k]!r}"]
        gap = f"a{k}*x + b{k}*z + c{k} >= 0"
        lines.append(f"  w{k}: {{unilateral: {gap}, restitution: e{k}}}")
    return "\n".join(
        [
            "name: polygon",
            f"parameters: {{{', '.join(sizes)}}}",
            "plane: xz",
            "particles: {p: {mass: m, position: [x, y, z]}}",
            "constraints:",
            *lines,
            "potentials: {weight: {gravity: g}}",
            f"initial: {{x: 0, z: 0, dot(x): {velocity[0]!r}, dot(z): {velocity[1]!r}}}",
            "simulate: {until: 1.5, samples: 61}",
        ]
    )


def reference(
    walls: list[tuple[float, float, float]],
    e: list[float],
    velocity: tuple[float, float],
    times: np.ndarray,
) -> tuple[np.ndarray, ContactReference]:
    def lagrangian(p, q, v, t):
        return sp.Rational(17, 20) * (v.x**2 + v.z**2) - sp.Rational(17, 10) * p.g * q.z

    free = lagranges_method.from_typed(lagrangian, None, ["x", "z"], ["g"])
    dynamics = lagranges_method.constrained(
        free, lambda p, q, t: [a * q.x + b * q.z + c for a, b, c in walls], None, ["x", "z"], ["g"]
    )
    route = ContactReference(dynamics, [9.81], e)
    return route.run(np.array([0, 0, *velocity]), times, np.ones(4)), route


def assert_same(found: Trajectory, walls, e, velocity) -> None:
    kept = found.t
    if found.status != "ok":
        # Nothing else ends the promise here: bounces without end, or a corner that is grazed.
        assert found.status == "accuracy_not_reached", found.reason
    assume(len(kept) > 2)
    exact, route = reference(walls, e, velocity, kept)
    for column, expected in zip(("x", "z", "dot(x)", "dot(z)"), exact.T, strict=True):
        off = np.abs(found.columns[column] - expected)
        off[[t in found.exempt for t in kept.tolist()]] = 0
        assert off.max() <= EPS * found.scales[column] + 1e-10, (column, off.max())
    ours = [x for x in found.events if x.t <= kept[-1] and x.name.startswith("contact")]
    theirs = [x for x in route.happened if x.closes]
    assert len({round(x.t, 7) for x in ours}) == len({round(x.t, 7) for x in theirs})


angles = st.integers(0, 359).map(math.radians)
coefficients = st.sampled_from([0.0, 0.3, 0.7, 1.0])
speeds = st.integers(-30, 30).map(lambda k: k / 10)


@settings(max_examples=12, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    st.integers(0, 119),
    st.lists(st.integers(3, 12), min_size=3, max_size=3),
    coefficients,
    st.tuples(speeds, speeds),
)
def test_a_particle_in_a_triangle(turn: int, distances: list[int], e: float, velocity):
    walls = polygon([math.radians(turn + 120 * k) for k in range(3)], [d / 10 for d in distances])
    text = scene(walls, [e] * 3, velocity)
    assert_same(loads(text).derive().simulate(accuracy=EPS), walls, [e] * 3, velocity)


@settings(max_examples=8, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    st.integers(0, 89),
    st.lists(coefficients, min_size=4, max_size=4),
    st.tuples(speeds, speeds),
)
def test_a_particle_in_a_square_of_different_walls(turn: int, e: list[float], velocity):
    walls = polygon([math.radians(turn + 90 * k) for k in range(4)], [0.5, 0.7, 0.4, 0.6])
    text = scene(walls, e, velocity)
    assert_same(loads(text).derive().simulate(accuracy=EPS), walls, e, velocity)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_particle_comes_to_rest_in_a_corner(e: float):
    """In a symmetric valley; both sides then push with half of what the weight needs."""
    walls = polygon([math.radians(225), math.radians(315)], [0.5, 0.5])
    text = scene(walls, [e, e], (0.3, 0.0))
    found = simulate(loads(text).derive().equations, method="DOP853", rtol=1e-9, until=20)
    assert found.status == "ok", found.reason
    assert found.state["z"] == pytest.approx(-0.5 * math.sqrt(2), abs=1e-6)
    assert found.state["x"] == pytest.approx(0, abs=1e-6)
    push = 1.7 * 9.81 / math.sqrt(2)
    for k in range(2):
        assert found.table(("forces",))[f"lambda_w{k}"][-1] == pytest.approx(push, rel=1e-5)
