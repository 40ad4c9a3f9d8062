"""A conserved energy takes back a promise that it disproves."""

from __future__ import annotations

import numpy as np
import pytest

from lagrange_cli.mechanics import derive
from lagrange_cli.scene import read_text
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.verification.drifts import EnergyDrift, first_contradiction

BARRIER = """
particles: {{p: {{mass: 1, position: [x, 0, 0]}}}}
coordinates: [x]
potentials: {{v: {height}*exp(-((x-10)/0.0001)^2)}}
initial: {{x: 0, dot(x): 1}}
simulate: {{until: 20, accuracy: 1e-6}}
"""


def test_a_barrier_narrower_than_a_step_is_not_passed_in_silence():
    """It is met, and throws the particle back; or the energy says that it was not."""
    found = simulate(derive(read_text(BARRIER.format(height=0.6))))
    if found.status == "ok":
        assert found.columns["dot(x)"][-1] == pytest.approx(-1, abs=1e-6)
        assert found.columns["x"].max() < 10
    else:
        assert found.holds_until is not None
        assert found.holds_until < 10
        assert "energy" in found.reason


def test_without_the_barrier_the_promise_stands():
    found = simulate(derive(read_text(BARRIER.format(height=0))))
    assert found.status == "ok"


def energy(t: np.ndarray, y: np.ndarray) -> np.ndarray:
    return (y**2).sum(axis=1, keepdims=True) / 2


def drift_of(energy, t: np.ndarray, states: np.ndarray, kinetic: float) -> EnergyDrift:
    drift = EnergyDrift()
    drift.add(t, states, energy(t, states)[:, 0], np.array(kinetic), np.zeros(len(t)))
    return drift


def test_energies_in_parts_drift_as_all_at_once():
    draw = np.random.default_rng(2)
    t, states = np.arange(60.0), draw.normal(size=(60, 4))
    energy, kinetic, lost = draw.normal(size=(3, 60))
    whole, parts = EnergyDrift(), EnergyDrift()
    whole.add(t, states, energy, kinetic, lost)
    for part in np.split(np.arange(60), [1, 3, 40]):
        parts.add(t[part], states[part], energy[part], kinetic[part], lost[part])
    for drift in (whole, parts):
        kept = energy - lost
        change = np.abs(kept - kept[0])
        scale = max(np.abs(kinetic).max(), np.abs(lost).max())
        assert drift.first == kept[0]
        assert drift.size == max(np.abs(kept).max(), np.abs(kinetic).max())
        assert drift.scale == scale
        assert drift.drift == change.max() / scale
        times = np.concatenate([suspects[0] for suspects in drift.suspects])
        assert set(np.argsort(change)[-5:]) <= set(times.astype(int))


def circle(error: float) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0, 10, 101)
    radius = 1 + error * t / 10
    return t, np.column_stack([radius * np.cos(t), -radius * np.sin(t)])


@pytest.mark.parametrize(("error", "disproved"), [(0.0, False), (1e-7, False), (1e-4, True)])
def test_changes_within_the_accuracy_prove_nothing(error: float, disproved: bool):
    t, states = circle(error)
    kinetic = float((states[:, 1] ** 2 / 2).max())
    first = first_contradiction(
        energy, t, states, 1e-6, np.ones(2), drift_of(energy, t, states, kinetic)
    )
    assert (first is not None) == disproved


def test_the_first_sample_beyond_is_named():
    t, states = circle(0.0)
    states[40:] *= 1.1
    first = first_contradiction(
        energy, t, states, 1e-6, np.ones(2), drift_of(energy, t, states, 0.5)
    )
    assert first == 40


def test_a_start_close_to_a_singularity_excuses_no_change():
    """A straight line instead of an orbit: the error that is promised is larger than the distance
    at the start, but the start is given."""
    speed = np.sqrt(2e9)

    def energy(t, y):
        return (y[:, 2] ** 2 + y[:, 3] ** 2)[:, None] / 2 - 1 / np.hypot(y[:, 0], y[:, 1])[:, None]

    t = np.linspace(0.0, 60.0, 11)
    states = np.array([[1e-9, speed * s, 0.0, speed] for s in t])
    scales = np.array([3e3, 3e6, 45.0, 4.5e4])
    drift = drift_of(energy, t, states, 1e9)
    assert first_contradiction(energy, t, states, 1e-6, scales, drift) == 1
