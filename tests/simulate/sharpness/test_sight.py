"""How long steps may be: as long as nothing sharp can lie between them, and no longer."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate.integrators.expressions import Expressions
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.sharpness.analyticity import AnalyticDiscs, PathPoint, longest_step
from lagrange_cli.simulate.toolchain.compiler import find_compiler
from tests.simulate.compiling import skip_without_compiler


class Written:
    """A right-hand side q'' = of(functions, t, q, v), as values and as expressions."""

    def __init__(self, of):
        def trace(functions, t, y, p, u):
            return [y[1], of(functions, t, *y)]

        self._of = of
        self.expressions = Expressions(trace, np.empty(0), np.empty(0))

    def __call__(self, t, y):
        numbers = {name: getattr(math, name) for name in ("sin", "cos", "exp", "sqrt", "tanh")}
        return np.array([y[1], self._of(numbers, t, *y)])


def reach(of, y0=(0.0, 1.0), until=1.0, autonomous=True):
    problem = InitialValueProblem(
        Written(of),
        np.array(y0),
        np.linspace(0.0, until, 11),
        ("length",),
        autonomous=autonomous,
    )
    return AnalyticDiscs(problem).first(PathPoint(0.0, problem.y0))


def test_a_uniform_acceleration_is_seen_to_the_end():
    assert reach(lambda f, t, q, v: 0.0 * q - 9.81) == 1.0


@pytest.mark.parametrize("omega", [1.0, 5.0, 20.0])
def test_an_oscillation_is_seen_for_a_part_of_its_period(omega):
    found = reach(lambda f, t, q, v: -(omega**2) * q, (1.0, 0.0))
    assert 0.2 < found * omega < 1.0


@pytest.mark.parametrize("width", [0.3, 0.1, 0.03, 0.01])
@pytest.mark.parametrize(
    "force",
    [
        lambda f, x, w: f["exp"](-((x / w) ** 2)),
        lambda f, x, w: 1.0 / (1.0 + (x / w) ** 2),
        lambda f, x, w: f["tanh"](x / w),
        lambda f, x, w: f["sin"](x / w),
    ],
    ids=["gauss", "lorentz", "tanh", "sine"],
)
@pytest.mark.parametrize("size", [1.0, 1e-6])
def test_what_is_narrow_is_not_overlooked(force, width, size):
    """However weak it is: what grows as exp(r/w) is seen from log(1/size) widths away."""
    far = (8 + math.log(1 / size)) * width
    assert reach(lambda f, t, q, v: size * force(f, q, width) - 0.1) < far
    assert reach(lambda f, t, q, v: size * force(f, t, width) - 0.1, autonomous=False) < far


def test_a_force_without_derivatives_leaves_the_usual_steps():
    assert reach(lambda f, t, q, v: -f["abs"](q) if "abs" in f else -abs(q)) == 0.0


def test_a_right_hand_side_of_values_alone_leaves_the_usual_steps():
    problem = InitialValueProblem(
        lambda t, y: y * 0, np.array([0.0, 1.0]), np.linspace(0.0, 1.0, 11), ("length",)
    )
    assert AnalyticDiscs(problem).first(PathPoint(0.0, problem.y0)) == 0.0
    assert longest_step(problem, 0.0) == problem.longest_step == 1 / 128


def test_the_rest_of_the_motion_counts_as_well():
    """A wall that is far away at first."""

    def force(f, t, q, v):
        return -f["exp"]((q - 0.8) / 0.01)

    problem = InitialValueProblem(
        Written(force), np.array([0.0, 1.0]), np.linspace(0.0, 1.0, 11), ("length",)
    )
    sight, start = AnalyticDiscs(problem), PathPoint(0.0, problem.y0)
    first = sight.first(start)
    places = [start, PathPoint(0.3, np.array([0.3, 1.0])), PathPoint(0.75, np.array([0.75, 1.0]))]
    assert first > 0.1
    assert sight.along(places[:2], first, np.ones(2)) > sight.along(places, first, np.ones(2))


def compiled_or_skip():
    if find_compiler() is None:
        skip_without_compiler("steps are counted of compiled runs")


GROUND = """
name: ball
parameters: {{h: 0.001, w: 0.001, u: 1}}
plane: xz
particles: {{p: {{mass: 1, position: [x, y, z]}}}}
constraints: {{ground: {{unilateral: "{ground}", restitution: 0.5}}}}
potentials: {{weight: {{gravity: 9.81}}}}
initial: {{x: 0, z: 1, dot(x): u}}
simulate: {{until: 0.7, accuracy: 1e-6}}
"""


@pytest.mark.slow
def test_rough_ground_is_looked_at_more_closely_than_flat_ground():
    compiled_or_skip()
    flat, rough = (
        loads(GROUND.format(ground=ground)).derive().simulate()
        for ground in ("z >= 0", "z >= h*sin(x/w)")
    )
    assert flat.steps < 10
    assert rough.steps >= 128
    touched = rough.events[0].state
    assert touched["z"] == pytest.approx(1e-3 * math.sin(touched["x"] / 1e-3), abs=1e-9)
    assert flat.events[0].t == pytest.approx(math.sqrt(2 / 9.81), rel=1e-9)


POST = """
name: post
parameters: {{h: 1.3, w: {width}, c: 0.61}}
particles: {{p: {{mass: 1, position: [x, 0, z]}}}}
coordinates: [x, z]
potentials: {{V: "10*z"}}
constraints: {{ground: {{unilateral: "z >= {post}", restitution: 0.5}}}}
initial: {{x: 0, dot(x): 1, z: 0.1, dot(z): 5}}
simulate: {{until: 1, samples: 21, accuracy: 1e-6}}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("post", "width", "height"),
    [
        ("h/cosh((x-c)/w)^8", 0.01, lambda u: np.cosh(u) ** -8.0),
        ("h/cosh((x-c)/w)^2", 0.003, lambda u: np.cosh(u) ** -2.0),
        ("h*exp(-((x-c)/w)^2)", 0.01, lambda u: np.exp(-(u**2))),
        ("h/(1 + ((x-c)/w)^2)^2", 0.01, lambda u: (1 + u**2) ** -2.0),
        (
            "h*(tanh((x-c)/w + 5) - tanh((x-c)/w - 5))/2",
            0.003,
            lambda u: (np.tanh(u + 5) - np.tanh(u - 5)) / 2,
        ),
        ("h/cosh((t-c)/w)^4", 0.003, lambda u: np.cosh(u) ** -4.0),
    ],
)
def test_narrow_posts_are_met(post, width, height):
    """The way of the ball is known: where it meets the post is found on a fine grid."""
    compiled_or_skip()
    found = loads(POST.format(post=post, width=width)).derive().simulate()
    t = np.linspace(0.5, 0.7, 2_000_001)
    beyond = 1.3 * height((t - 0.61) / width) - (0.1 + 5 * t - 5 * t**2)
    assert found.events[0].t == pytest.approx(t[np.flatnonzero(beyond > 0)[0]], abs=1e-6)


@pytest.mark.slow
def test_a_low_wave_under_a_long_way_is_met():
    compiled_or_skip()
    text = """
name: skim
parameters: {z0: 1.5995e-8, H: 1.62306e-8, w: 0.01538, c: 0.558473}
particles: {p: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
constraints: {ground: {unilateral: "z >= H*sin((x-c)/w)", restitution: 0.5}}
initial: {x: 0, dot(x): 1, z: z0, dot(z): 0}
simulate: {until: 1, samples: 21, accuracy: 1e-9}
"""
    found = loads(text).derive().simulate()
    t = np.linspace(0, 0.2, 2_000_001)
    met = t[np.flatnonzero(1.62306e-8 * np.sin((t - 0.558473) / 0.01538) > 1.5995e-8)[0]]
    assert found.events[0].t == pytest.approx(met, abs=1e-6)
