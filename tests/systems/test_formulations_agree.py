"""Minimal and multiplier form of shipped scenes that have both are the same motion."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from mpmath import mpf

from lagrange_cli import load
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics.numerics.autodiff import Tape
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.simulation import simulate
from lagrange_cli.simulate.system.functions import interpreted
from tests.systems.shipped import SCENES, SLICE, derived, sliced

pytestmark = pytest.mark.slow

#: Scenes that have both forms, at least: of all and of the slice.
BOTH, BOTH_OF_SLICE = 35, 10

#: A slice of them for whole motions: spherical, planar, polar, moved in time, rigid, coupled, and
#: turned by three angles.
MOTIONS = [
    "spherical_pendulum",
    "double_pendulum",
    "masses_through_hole",
    "pendulum_driven_support",
    "swinging_atwood",
    "furuta_pendulum",
    "spinning_top",
    "quadrotor",
]


@cache
def multiplied(name):
    """The scene with multipliers, or None where there is no such form beside its own."""
    if derived(name).system.closures or derived(name).system.contacts:
        return None
    try:
        return derived(name, formulation="multiplier")
    except InputError as refusal:
        if refusal.problems[0].rule != "formulation":
            raise
        return None


def states(e, count=3):
    """Random states near the initial one."""
    draw = np.random.default_rng(7)
    start = np.array([*e.system.initial.positions, *e.system.initial.velocities])
    size = max(1.0, np.abs(start).max())
    for _ in range(count):
        yield start + 0.1 * np.minimum(size, 1 + np.abs(start)) * draw.uniform(-1, 1, len(start))


def kinematics(e, other):
    """Positions, velocities and accelerations of the other form for q, v, a and t of a minimal one.

    By arithmetic on Taylor series along the motion: nothing is differentiated. Parts of quaternions
    are no names of the minimal form.
    """
    places = {c.name: c.position for c in other.system.chart.places}
    places.update({c.name: c.position for c in e.system.cartesian_names})
    places.update({c.name: c.q for c in e.system.coordinates})
    parameters = [p.symbol for p in e.system.parameters]
    symbols = [*(c.q for c in e.system.coordinates), e.system.t, *parameters]
    tape = Tape([places[c.name] for c in other.system.coordinates], symbols)
    zero = mpf(0)

    def of(q, v, a, t):
        moving = [tuple(map(mpf, s)) for s in zip(q, v, a, strict=True)]
        constants = [(mpf(p.value), zero, zero) for p in e.system.parameters]
        run = tape.run([*moving, (mpf(t), mpf(1), zero), *constants])
        return np.array(run.outputs, dtype=float).T

    return of


@sliced(SCENES)
def test_accelerations_agree(name):
    other = multiplied(name)
    if other is None:
        pytest.skip("there is one form only")
    e = derived(name)
    assert (e.system.formulation, other.system.formulation) == ("minimal", "multiplier")
    assert len(other.system.coordinates) == len(e.system.coordinates) + len(other.system.closures)
    of = kinematics(e, other)
    few, many = (interpreted(model_of(x), "").rhs for x in (e, other))
    n, m = len(e.system.coordinates), len(other.system.coordinates)
    t = e.system.simulate.start + 0.3
    for y in states(e):
        r, w, expected = of(y[:n], y[n:], few(t, y)[n:], t)
        found = many(t, np.concatenate([r, w]))
        assert found[:m] == pytest.approx(w)
        size = np.abs(expected).max() + np.abs(w).max() ** 2
        assert np.abs(found[m:] - expected).max() <= 1e-10 * size


def test_many_scenes_of_the_slice_have_both():
    assert sum(multiplied(name) is not None for name in SLICE) >= BOTH_OF_SLICE


@pytest.mark.campaign
def test_many_scenes_have_both():
    assert sum(multiplied(name) is not None for name in SCENES) >= BOTH


@sliced(SCENES)
def test_starts_agree(name):
    other = multiplied(name)
    if other is None:
        pytest.skip("there is one form only")
    e = derived(name)
    of = kinematics(e, other)
    q, v = e.system.initial.positions, e.system.initial.velocities
    r, w, _ = of(q, v, [0.0] * len(q), e.system.simulate.start)
    assert other.system.initial.positions == pytest.approx(r, rel=1e-14, abs=1e-14)
    assert other.system.initial.velocities == pytest.approx(w, rel=1e-14, abs=1e-14)


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_agree_within_their_estimates(name):
    few, many = model_of(derived(name)), model_of(multiplied(name))
    start = few.defaults.start
    until = start + 0.1 * (few.defaults.until - start)
    how = {"until": until, "accuracy": 1e-9, "samples": 41}
    ours, theirs = simulate(few, **how), simulate_past_singularities(many, SimulationOptions(**how))
    assert ours.status == theirs.status == "ok"
    assert (ours.formulation, theirs.formulation) == ("minimal", "multiplier")
    assert set(ours.columns) <= set(theirs.columns), "results carry every name of the scene"
    scale = max(theirs.scales.values())
    for column in ours.columns:
        size = max(ours.scales.get(column, 0.0), theirs.scales.get(column, 0.0)) or scale
        apart = np.abs(ours.columns[column] - theirs.columns[column]).max()
        assert apart <= 20 * (ours.estimated + theirs.estimated) * size + 1e-13, column


def test_constraint_forces_agree():
    """The tension of a pendulum's rod from both forms, by ``derive --forces``."""
    names = ("force_x(bob)", "force_z(bob)")
    how = {"until": 1.0, "accuracy": 1e-10, "samples": 21}
    runs = [
        load(str(SCENES["pendulum"])).derive(forces=True, formulation=form).simulate(**how)
        for form in ("minimal", "multiplier")
    ]
    for name in names:
        found, expected = (run.forces[name] for run in runs)
        assert found == pytest.approx(expected, abs=1e-8)
