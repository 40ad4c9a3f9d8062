"""Motions of many members at once, of which some end before their last sample."""

from __future__ import annotations

import math

import numpy as np

from lagrange_cli import loads
from lagrange_cli.cache import open_cache
from lagrange_cli.simulate.ensemble.run.batched import batched_members
from lagrange_cli.simulate.integrators.native.batched_taylor import TaylorSteps
from lagrange_cli.simulate.model.build import model_of
from tests.simulate.compiling import skip_without_compiler
from tests.studies.trade_systems import problem_and_coarse_run

OSCILLATOR = """
name: oscillator
parameters: {k: 1}
coordinates: [x]
kinetic: {T: dot(x)^2/2}
potentials: {V: k*x^2/2}
initial: {x: 1}
simulate: {until: 10, samples: 11}
"""


def test_samples_that_a_member_does_not_reach_are_no_numbers():
    """Of two oscillators the faster one, with ten times the steps to make, has too few of them."""
    model = model_of(loads(OSCILLATOR).derive().equations)
    *_, problem, _ = problem_and_coarse_run(model)
    members = batched_members(model, problem, open_cache())
    if members is None:
        skip_without_compiler("no members are stepped side by side")
    starts, stiffness = np.array([[1.0, 0.0]] * 2), np.array([[1.0], [100.0]])
    steps, before = TaylorSteps(20, 1e-12, math.inf, most=12), np.full((2, 11, 2), 7.0)
    found = members.motions.run("rhs", problem.times, starts, stiffness, steps, out=before)
    slow, fast = found.filled
    assert slow == 11
    assert 0 < fast < 11
    for member, rate in enumerate((1, 10)):
        exact = np.cos(rate * problem.times)
        exact[found.filled[member] :] = np.nan
        np.testing.assert_allclose(found.states[member, :, 0], exact, atol=1e-10)
