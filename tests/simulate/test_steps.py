"""Motions with steps and cases: closed forms between the places where they switch."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads

#: A mass that a push for a while sends to and fro between two springs, with play between them.
#: J. P. Den Hartog, Mechanical Vibrations (4th ed., 1956), chapter 8.
PLAY = """
name: play
parameters:
  m: {value: 1, positive: true}
  k: {value: 4*pi^2, positive: true}
  a: {value: 0.5, positive: true}
inputs: {u: PUSH}
particles: {block: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {springs: "piecewise([k*(x - a)^2/2, x > a], [k*(x + a)^2/2, x < -a], 0)"}
forces: {push: {on: x, force: u}}
outputs: {side: "piecewise([1, x >= a], [-1, x <= -a], 0)"}
initial: {x: 0, dot(x): 0}
simulate: {until: 6.25, accuracy: 1e-9}
"""
PUSHES = ["2*(heaviside(t) - heaviside(t - 0.5))", "piecewise([2, t < 0.5], 0)"]


def motion(t: np.ndarray) -> np.ndarray:
    """Where the mass is: pushed for 1/2, then 1/2 s on each spring and 1 s between them."""
    phase = (t - 0.75) % 3
    pieces = [phase < 0.5, phase < 1.5, phase < 2]
    path = np.select(
        pieces,
        [
            0.5 + np.sin(2 * np.pi * phase) / (2 * np.pi),
            1 - phase,
            -0.5 - np.sin(2 * np.pi * (phase - 1.5)) / (2 * np.pi),
        ],
        phase - 2.5,
    )
    return np.select([t < 0.5, t < 0.75], [t**2, 0.25 + (t - 0.5)], path)


@pytest.mark.parametrize("push", PUSHES)
@pytest.mark.parametrize("method", ["auto", "DOP853", "RK45", "Radau"])
def test_play_between_springs(push: str, method: str) -> None:
    scene = loads(PLAY.replace("PUSH", f'"{push}"'))
    times = np.linspace(0, 6.25, 76)
    if method == "auto":
        run = scene.derive().simulate(accuracy=1e-9, times=times)
    else:
        run = scene.derive().simulate(method=method, rtol=1e-11, atol=1e-12, times=times)
    assert run.status == "ok"
    x = np.array(run.columns["x"])
    assert np.abs(x - motion(times)).max() < (1e-9 if method == "auto" else 1e-7)
    inside = np.abs(np.abs(x) - 0.5) > 1e-6
    expected = np.where(x > 0.5, 1, np.where(x < -0.5, -1, 0))
    assert (np.array(run.columns["side"])[inside] == expected[inside]).all()


def test_steps_are_the_same_force_as_signs() -> None:
    """heaviside(x) is (1 + sign(x))/2: the same surfaces, the same motion to the bit."""
    text = PLAY.replace("piecewise([k*(x - a)^2/2, x > a], [k*(x + a)^2/2, x < -a], 0)", "k*x^2/2")
    steps, signs = (
        loads(text.replace("PUSH", u)).derive().simulate()
        for u in ("heaviside(t - 0.3)", "(1 + sign(t - 0.3))/2")
    )
    assert list(steps.columns["x"]) == list(signs.columns["x"])
