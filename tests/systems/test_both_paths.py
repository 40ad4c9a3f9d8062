"""Shipped scenes run the same in machine code and interpreted, to rounding."""

from __future__ import annotations

import os
from functools import cache

import numpy as np
import pytest

from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side
from tests.systems.shipped import APART, CONTACTS, NARROW, SCENES, derived, sliced

pytestmark = pytest.mark.slow

#: Scenes with contacts have another method.
SMOOTH = sorted({*SCENES, *APART} - set(CONTACTS))

#: Part of a scene's duration that is integrated, and the number of its steps.
PART, STEPS = 0.02, 40


@cache
def model_at(name):
    return model_of(derived(name))


@pytest.fixture
def paths(name):
    model = model_at(name)
    if model.initial is None or model.defaults.until is None:
        pytest.skip("the scene has nothing to simulate")
    native = right_hand_side(model)
    if not native.implementation.startswith("compiled"):
        assert os.environ.get("CI") != "true", native.implementation
        pytest.skip(native.implementation)
    return model, native, interpreted(model, "")


@sliced(SMOOTH)
def test_functions_and_motions_agree(paths):
    model, native, python = paths
    start = model.defaults.start
    until = start + PART * (model.defaults.until - start)
    step = (until - start) / STEPS
    how = {"until": until, "method": "RK4", "step": step, "samples": 11}
    ours, theirs = (simulate(model, functions=f, **how) for f in (native, python))
    assert ours.status == theirs.status == "ok"
    for name in model.coordinates:
        for column in (name, f"dot({name})"):
            found, expected = ours.columns[column], theirs.columns[column]
            size = max(np.abs(expected).max(), ours.scales[column])
            assert np.abs(found - expected).max() <= 1e-11 * size
    states = np.column_stack(
        [theirs.columns[form.format(c)] for form in ("{}", "dot({})") for c in model.coordinates]
    )
    # Equal operations in equal order: only the functions of the C library may differ.
    for t, y in zip(theirs.t, states, strict=True):
        rates = python.rhs(t, y)
        assert native.rhs(t, y) == pytest.approx(rates, rel=1e-11, abs=1e-11 * np.abs(rates).max())
    for name in ("energy", "positions", "velocities"):
        found, expected = (getattr(f, name)(theirs.t, states) for f in (native, python))
        assert found == pytest.approx(expected, rel=1e-11, abs=1e-11, nan_ok=True)


#: Scenes of adaptive motions: closures of positions by loops, of velocities in the rolling disk.
MOVED = {*NARROW, "spherical_pendulum_from_the_pole"} - {"chaplygin_sleigh", "four_bar_linkage"}


@sliced(SMOOTH, MOVED)
def test_the_promise_holds_on_both(paths):
    model, native, python = paths
    start = model.defaults.start
    until = start + PART / 4 * (model.defaults.until - start)
    eps = 1e-7
    how = {"until": until, "accuracy": eps, "samples": 11}
    ours, theirs = (simulate(model, functions=f, **how) for f in (native, python))
    assert ours.status == theirs.status == "ok"
    for name in ours.scales:
        apart = np.abs(ours.columns[name] - theirs.columns[name]).max()
        assert apart <= (ours.estimated + theirs.estimated) * ours.scales[name]
        assert ours.estimated <= eps
