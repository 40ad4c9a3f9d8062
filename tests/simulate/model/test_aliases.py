"""Samples once a period, which show a motion always at the same place: scales lie between them."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of

pytestmark = pytest.mark.slow

BOUNCES = 300
DIGITS = 40

#: An elastic ball, sampled where it is highest, but for the rounding of the times.
BALL = """
name: ball
plane: xz
particles: {{b: {{mass: 1, position: [x, y, z]}}}}
constraints: {{f: {{unilateral: z >= 0, restitution: 1}}}}
potentials: {{w: {{gravity: 9.81}}}}
initial: {{x: 0, z: 1e-4}}
simulate: {{until: {until!r}, accuracy: {eps}, samples: 101}}
"""

#: A slot that is crossed a hundred times between two samples; z rests far from 0.
SLOT = """
name: slot
parameters: {{w: 1e-3}}
plane: xz
particles: {{b: {{mass: 1, position: [x, y, z]}}}}
constraints:
  a: {{unilateral: x <= w, restitution: 1}}
  f: {{unilateral: x >= 0, restitution: 1}}
initial: {{x: 0.0005, z: 1, dot(x): 1, dot(z): 0}}
simulate: {{until: {until!r}, accuracy: {eps}, samples: 4}}
"""

SPRING = """
name: spring
parameters: {{m: 1, k: 1}}
particles: {{b: {{mass: m, position: [x, 0, 0]}}}}
potentials: {{s: k*x^2/2}}
initial: {{x: 1e-3}}
simulate: {{until: {until!r}, accuracy: {eps}, samples: 21}}
"""


def simulated(text):
    return simulate(model_of(loads(text).derive().equations))


def ball(t):
    """Height and speed."""
    g, z0 = mpf("9.81"), mpf("1e-4")
    half = mpmath.sqrt(2 * z0 / g)
    since = (mpf(t) + half) % (2 * half) - half
    return z0 - g * since**2 / 2, -g * since


def slot(t):
    x = (mpf("0.0005") + mpf(t)) % mpf("0.002")
    return (x, mpf(1)) if x < mpf("0.001") else (mpf("0.002") - x, mpf(-1))


def spring(t):
    return mpf("1e-3") * mpmath.cos(mpf(t)), -mpf("1e-3") * mpmath.sin(mpf(t))


#: Scene, name of the coordinate, closed form, end, how far it and its rate go.
MOTIONS = {
    "ball": (BALL, "z", ball, 2 * BOUNCES * (2e-4 / 9.81) ** 0.5, (1e-4, 0.0443)),
    "slot": (SLOT, "x", slot, 0.003 * BOUNCES, (5e-4, 1.0)),
    "spring": (SPRING, "x", spring, 40 * np.pi, (2e-3, 1e-3)),
}


@pytest.mark.parametrize("eps", ["1e-6", "1e-8"])
@pytest.mark.parametrize("name", list(MOTIONS))
def test_samples_that_alias_with_the_motion(name, eps):
    text, coordinate, exact, until, moves = MOTIONS[name]
    found = simulated(text.format(until=until, eps=eps))
    # The rounding of six hundred impacts is 5e-9 of a scale that is a thousandth of the height.
    assert found.status == "ok" or (name, eps) == ("ball", "1e-8")
    columns = [found.columns[column] for column in (coordinate, f"dot({coordinate})")]
    scales = [found.scales[column] for column in (coordinate, f"dot({coordinate})")]
    for scale, most in zip(scales, moves, strict=True):
        # A thousandth of what lies between the samples, or what these show.
        assert 0.2e-3 * most <= scale <= 1.1 * most
    with mp.workdps(DIGITS):
        for t, *values in zip(found.t.tolist(), *columns, strict=True):
            for value, truth, scale in zip(values, exact(t), scales, strict=True):
                assert abs(value - truth) <= float(eps) * scale


POLE = """
name: pole
parameters: {{w: {w}}}
particles: {{b: {{mass: 1, position: [x, y, z]}}}}
coordinates: [theta, phi]
definitions: {{x: sin(theta)*cos(phi), y: sin(theta)*sin(phi), z: -cos(theta)}}
potentials: {{u: {{gravity: 9.81}}}}
initial: {{theta: 1.2, phi: 0, dot(theta): 0, dot(phi): w}}
simulate: {{until: 10, accuracy: {eps}, samples: 401}}
"""


@pytest.mark.parametrize("w", ["1e-4", "1.3e-6", "1e-8"])
def test_a_rush_between_samples_is_no_scale(w):
    """The azimuth turns by half a circle at the pole, faster than anything at a sample."""
    found, finer = (simulated(POLE.format(w=w, eps=eps)) for eps in ("1e-9", "1e-12"))
    assert found.status == finer.status == "ok"
    rate, most = found.columns["dot(phi)"], max(abs(found.columns["dot(phi)"]))
    turned = found.scales["phi"] / 10
    assert found.scales["dot(phi)"] == pytest.approx(max(most, turned), rel=1e-6)
    assert abs(rate - finer.columns["dot(phi)"]).max() <= 1e-9 * found.scales["dot(phi)"]


def test_what_is_below_rounding_is_still_refused():
    text, _, _, until, _ = MOTIONS["slot"]
    with pytest.raises(InputError, match="below what double precision can hold"):
        simulated(text.format(until=until, eps="1e-10"))


@pytest.mark.compiler
def test_the_rounding_of_a_body_that_friction_holds_is_no_scale():
    """F > k x: it stays, though the balance of forces is off by a last place."""
    scene = """
name: held
parameters: {m: 1, k: 1, F: 1}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {s: k*x^2/2}
forces: {friction: {on: p, force: [-F*sign(dot(x)), 0, 0]}}
simulate: {until: 10, accuracy: 1e-6}
"""
    for start in (0.1, -0.3, 0.7):
        found = loads(scene, initial={"x": repr(start), "dot(x)": "0"}).derive().simulate()
        assert found.status == "ok"
        assert (found.columns["x"] == start).all()
        assert found.scales["x"] == 1
