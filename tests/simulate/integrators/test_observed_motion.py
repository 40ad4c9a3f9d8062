"""A motion is seen alike in machine code and in Python."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import load
from lagrange_cli.simulate.accuracy.coarse_run import CoarseRun
from lagrange_cli.simulate.checkpoint.progress import Deadline, RunProgress, Watch
from lagrange_cli.simulate.integrators.observed_motion import SETTLING
from lagrange_cli.simulate.request import SimulationOptions, resolve
from lagrange_cli.simulate.simulation import problem_of
from tests.simulate.compiling import compiled_or_skip

SYSTEMS = Path(__file__).parents[3] / "systems"


def coarse_run(scene):
    model = load(SYSTEMS / f"{scene}.yaml").derive().model()
    request = resolve(model, SimulationOptions())
    problem = problem_of(model, request, compiled_or_skip(model))
    watch = Watch(RunProgress(None, None, (0.0, 1.0)), Deadline.after(None), None)
    return problem, lambda: CoarseRun(problem, watch, 1e-5)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    "scene",
    [
        "pendulums/double_pendulum",
        "celestial/pleiades",
        "celestial/arenstorf_orbit",
        "oscillators/wilberforce_pendulum",
        "lecture/masses_through_hole",
    ],
)
def test_both_languages_see_the_same(scene):
    problem, begin = coarse_run(scene)
    run, twin, steps = begin(), begin().motion, 0
    while True:
        start, before = run.explicit.t, run.explicit.y
        goes_on = run.explicit.advance(len(problem.times), 1)
        if run.explicit.steps > steps:
            steps = run.explicit.steps
            twin.add(start, before, run.explicit.t, run.explicit.y, steps > SETTLING)
        if not goes_on:
            break
    seen = run.motion
    assert seen.passed == twin.passed == steps > SETTLING
    for name in ("moved", "scales", "way", "closest", "atol", "lengths"):
        np.testing.assert_allclose(getattr(seen, name), getattr(twin, name), rtol=1e-9, atol=1e-15)
    assert (seen.longest, seen.ended) == pytest.approx((twin.longest, twin.ended))
    assert seen.first_step == twin.first_step


@pytest.mark.compiler
def test_what_is_seen_does_not_depend_on_the_parts_of_the_run():
    problem, begin = coarse_run("pendulums/double_pendulum")
    whole, parts = begin(), begin()
    whole.go(whole.explicit)
    while parts.explicit.advance(len(problem.times), 7, math.inf):
        pass
    assert whole.motion.passed == parts.motion.passed
    for name in ("moved", "scales", "way", "closest", "atol", "lengths"):
        assert np.array_equal(getattr(whole.motion, name), getattr(parts.motion, name))
    assert (whole.explicit.states == parts.explicit.states).all()


@pytest.mark.slow
def test_a_motion_that_comes_no_further_is_ended():
    _, begin = coarse_run("pendulums/double_pendulum")
    motion = begin().motion
    y, t = np.zeros(4), 0.0
    while not motion.ended:
        motion.add(t, y, t + 1e-12, y, True)
        t += 1e-12
    assert motion.passed == 2**14
