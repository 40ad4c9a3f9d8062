"""Right runs are not disproved by their energy: exact solutions over many scales."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.simulate.verification import disproof, drifts
from tests.campaign import values_of

HARMONIC = """
name: harmonic
parameters: {{m: {m}, k: {k}, e: {e}}}
particles: {{p: {{mass: m, position: [x, y, 0]}}}}
coordinates: [x, y]
potentials: {{V: "{V}"}}
initial: {{x: {a}, y: 0, dot(x): 0, dot(y): {v}}}
simulate: {{until: {until}, accuracy: {accuracy}, samples: 41}}
"""

#: The same potential k x²/2, and terms that cancel or add what nothing feels.
POTENTIALS = [
    "k*x^2/2",
    "k*x^2/2 + 1e12",
    "k*x^2/2 - e*1e6",
    "k*((x + 1e7)^2 - 2e7*x - 1e14)/2",
    "e*(cosh(x*sqrt(k/e)) - 1)",
]


def scene(potential, m=1.0, k=1.0, e=1e6, a=1.0, v=0.5, accuracy=1e-6):
    until = 20 * np.sqrt(m / k)
    values = {"m": m, "k": k, "e": e, "a": a, "v": v, "until": until, "accuracy": accuracy}
    numbers = {name: repr(float(value)) for name, value in values.items()}
    return loads(HARMONIC.format(V=potential, **numbers))


@pytest.mark.slow
@pytest.mark.parametrize(("potential", "accuracy"), values_of(POTENTIALS, [1e-3, 1e-9]))
def test_an_oscillator_with_terms_that_cancel(potential, accuracy):
    run = scene(potential, accuracy=accuracy).derive().simulate()
    assert "energy" not in run.reason
    if run.status == "ok" and "cosh" not in potential:
        assert np.abs(run.columns["x"] - np.cos(run.t)).max() < 2 * accuracy


@pytest.mark.parametrize("seed", range(6))
def test_oscillators_of_any_scale(seed):
    """Masses, springs and amplitudes over hundreds of powers of ten, energies that underflow."""
    rng = np.random.default_rng(seed)
    m, k = (float(10 ** rng.uniform(-60, 60)) for _ in range(2))
    a = float(10 ** rng.uniform(-150, -90))
    run = scene("k*x^2/2", m, k, a=a, v=0.0).derive().simulate()
    assert run.status == "ok"
    assert np.abs(run.columns["x"] / a - np.cos(np.sqrt(k / m) * run.t)).max() < 1e-5


def test_free_fall_far_above_the_zero_of_its_potential():
    text = HARMONIC.replace("{until}", "1").format(
        m=1, k=9.81, e=1, V="k*(x + 1e12) - k*1e12 + 1e12", a=1, v=0.25, accuracy=1e-9
    )
    run = loads(text).derive().simulate()
    assert run.status == "ok"
    assert np.abs(run.columns["x"] - (1 - 9.81 * run.t**2 / 2)).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("v", [1.0, 1.3, 1e-3, 2**0.5])
def test_orbits(v):
    """Circle, ellipse, a fall past the centre, and the parabola, whose energy is zero."""
    text = HARMONIC.format(m=1, k=1, e=1, V="-1/sqrt(x^2 + y^2)", a=1, v=v, until=3, accuracy=1e-6)
    run = loads(text).derive().simulate()
    assert run.status == "ok"


def test_what_doubles_lose_convicts_nobody(monkeypatch):
    """The doubles' verdict alone would; the same energy in 60 digits does not."""
    potential = "k*((x + 1e7)^2 - 2e7*x - 1e14)/2"
    system = scene(potential, accuracy=1e-9).derive()
    # Terms that cancel are collected where they can be: the energy loses its digits here.
    real = drifts.first_contradiction

    def noisy(energy, t, states, accuracy, scales, drift, exact=None):
        def off(times, rows):
            return energy(times, rows) + 1e-4 * np.sin(1e4 * np.asarray(times))[:, None]

        shifted = drifts.EnergyDrift()
        shifted.add(t, states, off(t, states)[:, 0], np.array(drift.size), np.zeros(len(t)))
        assert real(off, t, states, accuracy, scales, shifted) is not None
        return real(off, t, states, accuracy, scales, shifted, exact)

    monkeypatch.setattr(disproof, "first_contradiction", noisy)
    assert system.simulate().status == "ok"


#: Where dot(x) is 1, as in units of c, the energy has a pole.
RELATIVISTIC = """
parameters: {{m: {m}, c: 1, k: 1}}
coordinates: [x]
kinetic: {{particle: "m*c^2*(1 - sqrt(1 - dot(x)^2/c^2))"}}
potentials: {{spring: k*x^2/2}}
initial: {{x: 2.0, dot(x): 0}}
simulate: {{until: 20, accuracy: 1e-9}}
"""


@pytest.mark.parametrize("m", [1e4, 1e6, 1e8])
def test_a_pole_of_the_energy_elsewhere_convicts_nobody(m):
    """A slow particle: 1 - sqrt(1 - v^2/c^2) loses its digits, and 60 digits have to be asked."""
    run = loads(RELATIVISTIC.format(m=m)).derive().simulate()
    assert run.status == "ok"
    # Of Newton's motion it differs by (v/c)^2 of the way.
    newton = 2 - 4 * np.sin(run.t / np.sqrt(m) / 2) ** 2
    assert np.abs(run.columns["x"] - newton).max() < 10 / m * (2 - newton.min())


def test_a_wrong_run_is_still_convicted():
    """Samples of a circle that grows by a ten-thousandth contradict its energy in any digits."""
    t = np.linspace(0, 10, 101)
    radius = 1 + 1e-4 * t / 10
    states = np.column_stack([radius * np.cos(t), -radius * np.sin(t)])

    def energy(times, rows):
        return (rows**2).sum(axis=1, keepdims=True) / 2

    def exact(time, y, moved):
        return float(((y if moved is None else y + moved) ** 2).sum() / 2)

    drift = drifts.EnergyDrift()
    drift.add(t, states, energy(t, states)[:, 0], np.array(0.5), np.zeros(len(t)))
    found = drifts.first_contradiction(energy, t, states, 1e-6, np.ones(2), drift, lambda: exact)
    assert found is not None
