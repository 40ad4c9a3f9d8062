"""Scenes whose forces switch, against closed forms of their pieces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli import loads
from tests.systems.shipped import simulated

pytestmark = pytest.mark.slow


def test_a_dead_zone_has_its_period() -> None:
    run = simulated("dead_zone_oscillator")
    assert run.status == "ok"
    assert float(run.t[-1]) == pytest.approx(4 * 0.5 / 1 + 2 * math.pi / math.sqrt(4), abs=1e-12)
    # Free within the play, a sine on the spring, over a quarter of the period.
    first = run.t < 0.5
    assert run.columns["x"][first] == pytest.approx(run.t[first], abs=1e-9)
    spring = (run.t > 0.5) & (run.t < 0.5 + math.pi / 2)
    exact = 0.5 + np.sin(2 * (run.t[spring] - 0.5)) / 2
    assert run.columns["x"][spring] == pytest.approx(exact, abs=1e-9)


def test_a_relay_makes_parabolas() -> None:
    run = simulated("relay_oscillator")
    assert run.status == "ok"
    quarter = math.sqrt(2 * 2.0 * 1.0 / 4.0)
    assert float(run.t[-1]) == pytest.approx(4 * quarter, abs=1e-12)
    first = run.t < quarter
    assert run.columns["x"][first] == pytest.approx(1 - run.t[first] ** 2, abs=1e-9)
    assert not run.slides


def test_a_saturated_actuator_brakes_and_accelerates_at_its_bounds() -> None:
    run = simulated("saturated_step")
    assert run.status == "ok"
    assert not run.columns["x"][run.t <= 1].any()
    # The command asks for 10 (1 − s²) − 6 s with s = t − 1, more than 2 for the first half second.
    bound = (run.t > 1) & (run.t < 1.5)
    assert run.columns["x"][bound] == pytest.approx((run.t[bound] - 1) ** 2, abs=1e-9)


def test_a_pushed_mass_flies_between_its_springs() -> None:
    run = simulated("play_between_springs")
    assert run.status == "ok"
    t, x = run.t, run.columns["x"]
    pushed = t < 0.5
    assert x[pushed] == pytest.approx(t[pushed] ** 2, abs=1e-9)
    spring = (t > 0.75) & (t < 1.25)
    exact = 0.5 + np.sin(2 * math.pi * (t[spring] - 0.75)) / (2 * math.pi)
    assert x[spring] == pytest.approx(exact, abs=1e-9)
    back = (t > 1.25) & (t < 2.25)
    assert x[back] == pytest.approx(1.75 - t[back], abs=1e-9)
    # Samples are 0.05 s apart, a period is 3 s.
    first = (t > 0.5) & (t < 3.25)
    later = np.flatnonzero(first) + 60
    assert x[later] == pytest.approx(x[first], abs=1e-9)


def test_a_block_sticks_to_its_belt_until_the_spring_overcomes_the_friction() -> None:
    run = simulated("stick_slip_belt")
    assert run.status == "ok"
    assert {slide.on for slide in run.slides} == {"dot(x) - w"}
    assert len(run.slides) == 7
    # It is let go where k x is the friction at rest.
    ends = [slide.end for slide in run.slides[:-1]]
    assert run.slides[-1].end is None
    x = np.interp(ends, run.t, run.columns["x"])
    assert x == pytest.approx(1.5 / 4, abs=1e-2)
    lasting = [b.start - a.end for a, b in zip(run.slides[:-1], run.slides[1:], strict=True)]
    assert lasting[1:] == pytest.approx(np.full(len(lasting) - 1, lasting[1]), abs=1e-7)


def test_states_of_first_order_slide_along_a_surface() -> None:
    """The relay b brings a + b to 0 at √2 − 1, and keeps it there: a fades with the rate 1."""
    text = """
    coordinates: [x]
    kinetic: {block: dot(x)^2/2}
    states: {a: b, b: -2*sign(a + b)}
    forces: {push: {on: x, force: a}}
    initial: {x: 0, dot(x): 0, a: 1, b: 0}
    simulate: {until: 4, accuracy: 1e-9, samples: 81}
    """
    run = loads(text).derive().simulate()
    assert run.status == "ok"
    met = math.sqrt(2) - 1
    (slide,) = run.slides
    assert (slide.on, slide.end) == ("a + b", None)
    assert slide.start == pytest.approx(met, abs=1e-9)
    fades = np.exp(-np.maximum(run.t - met, 0))
    a = np.where(run.t < met, 1 - run.t**2, 2 * met * fades)
    v = np.where(run.t < met, run.t - run.t**3 / 3, met - met**3 / 3 + 2 * met * (1 - fades))
    assert run.columns["a"] == pytest.approx(a, abs=1e-9)
    assert run.columns["dot(x)"] == pytest.approx(v, abs=1e-9)


def test_a_governed_engine_goes_through_its_limit_cycle() -> None:
    run = simulated("hit_and_miss_engine")
    assert run.status == "ok"
    # The speed goes from 10 to 14 towards 24 where the engine fires, and back towards 0.
    rises, falls = 4 * math.log((24 - 10) / (24 - 14)), 4 * math.log(14 / 10)
    assert float(run.t[-1]) == pytest.approx(4 * rises + 3 * falls, abs=1e-9)
    phase = run.t % (rises + falls)
    clear = (np.abs(phase - rises) > 1e-3) & (phase > 1e-3) & (phase < rises + falls - 1e-3)
    assert run.columns["firing"][clear].tolist() == (phase[clear] < rises).astype(float).tolist()
    speed = np.where(phase < rises, 24 - 14 * np.exp(-phase / 4), 14 * np.exp((rises - phase) / 4))
    assert run.columns["dot(phi)"][clear] == pytest.approx(speed[clear], abs=1e-8)


def test_a_slider_goes_with_its_pin_beyond_the_play() -> None:
    run = simulated("slider_with_play")
    assert run.status == "ok"
    z = 0.75
    for x, place in zip(np.cos(run.t), run.columns["z"], strict=True):
        z = min(max(z, x - 0.25), x + 0.25)
        assert abs(place - z) < 0.1  # samples miss where the pin turns back
    later = run.t > 0.1
    assert run.columns["z"][later].max() <= 0.75 + 1e-8
