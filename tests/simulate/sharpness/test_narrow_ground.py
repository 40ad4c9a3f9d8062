"""Narrow posts and low waves of one-sided constraints are met, however smooth the flight is."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads

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
    found = loads(POST.format(post=post, width=width)).derive().simulate()
    t = np.linspace(0.5, 0.7, 2_000_001)
    beyond = 1.3 * height((t - 0.61) / width) - (0.1 + 5 * t - 5 * t**2)
    assert found.events[0].t == pytest.approx(t[np.flatnonzero(beyond > 0)[0]], abs=1e-6)


@pytest.mark.slow
def test_a_low_wave_under_a_long_way_is_met():
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
