"""What measuring the error costs beside the run, in right-hand sides."""

from __future__ import annotations

import pytest

from lagrange_cli.simulate.accuracy import controller as accuracy
from lagrange_cli.simulate.accuracy.attempt import Attempt
from lagrange_cli.simulate.accuracy.method_selection import coarse_result
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
from lagrange_cli.simulate.checkpoint.progress import Watch
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.runs import run
from lagrange_cli.simulate.simulation import simulate
from tests.campaign import slice_of
from tests.simulate.accuracy.accuracy_systems import SYSTEMS, oscillator, problem
from tests.systems.shipped import derived


def model(name, formulation):
    return model_of(derived(name.rpartition("/")[2], formulation=formulation))


@pytest.fixture
def attempts(monkeypatch):
    """The attempts that are made."""
    made = []

    class Recorded(Attempt):
        def __init__(self, *given):
            super().__init__(*given)
            made.append(self)

    monkeypatch.setattr(accuracy, "Attempt", Recorded)
    return made


#: Motions at every one of whose steps the longest one rules; that begin at rest; that need wider
#: arithmetic, or another attempt; whose coordinates are lost on the way.
COSTS = [
    ("sliding/trammel", "minimal", 1e-6),
    ("pulleys/swinging_atwood", "minimal", 1e-9),
    ("beads/bead_on_helix", "minimal", 1e-12),
    ("pendulums/coupled_pendulums", "multiplier", 1e-9),
    ("pendulums/damped_driven_pendulum", "minimal", 2e-12),
    ("constraints/elliptical_gears", "multiplier", 1e-12),
    ("celestial/two_centres", "minimal", 1e-6),
    ("constraints/spherical_pendulum_from_the_pole", "multiplier", 1e-6),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "formulation", "eps"), slice_of(COSTS, 5))
def test_at_most_four_times_the_run(name, formulation, eps):
    found = simulate_past_singularities(model(name, formulation), SimulationOptions(accuracy=eps))
    if not found.implementation.startswith("compiled") or EXTENDED.epsilon >= DOUBLE.epsilon:
        pytest.skip("counts are those of compiled code, and wider arithmetic")
    assert found.status == "ok"
    assert found.all_evaluations <= 5 * found.rhs_evaluations


def test_what_rests_is_compared_with_what_rounding_moves():
    """A lever at rest: rounding, and so the runs beside it, do not rest, and cost no more."""
    found = simulate_past_singularities(
        model("lecture/lever", "minimal"), SimulationOptions(accuracy=1e-12)
    )
    if not found.implementation.startswith("compiled"):
        pytest.skip("counts are those of compiled code")
    assert found.status == "ok"
    assert found.all_evaluations <= 5 * found.rhs_evaluations


def test_a_run_that_nearly_was_enough_is_the_looser_one_of_the_next_attempt(attempts):
    """Its cost counts once; and only the disturbed run is disturbed then, which counts more."""
    *given, _ = SYSTEMS["kepler"]
    of = problem(*given)
    found = coarse_result(of, 1e-8, Watch())
    first = Attempt(of, 1.0, found, 1e-8, 0)
    first.go(Watch())
    eps = first.error_estimate().estimate
    near, far = (Attempt(of, part * eps, found, 1e-8, 0) for part in (0.5, 0.05))
    for missed in (near, far):
        missed.go(Watch())
    after_near, after_far = (Attempt(of, eps, found, 1e-9, 1, one) for one in (near, far))
    assert near.reduction == 10.0 < far.reduction
    for attempt in (after_near, after_far):
        attempt.go(Watch())
        assert attempt.error_estimate().excess < 1
    assert after_near.evaluations < 0.8 * after_far.evaluations


@pytest.mark.slow
def test_an_attempt_that_misses_early_is_given_up_where_another_may_follow():
    *given, _ = oscillator(3.0, 500.0)
    of = problem(*given, samples=641)
    found = coarse_result(of, 1e-8, Watch())
    whole = Attempt(of, 1.0, found, 1e-6, 0)
    whole.go(Watch())
    eps = whole.error_estimate().estimate / 5
    last, other = (Attempt(of, eps, found, 1e-6, 0, None, last) for last in (True, False))
    for attempt in (last, other):
        attempt.go(Watch())
    assert last.complete
    assert not other.complete
    assert other.evaluations < 0.7 * last.evaluations
    assert other.error_estimate().samples == last.error_estimate().samples


def test_attempts_that_share_a_run_go_on(attempts, monkeypatch, tmp_path):
    """Bit for bit, wherever the runs were interrupted."""
    monkeypatch.setattr(run, "FIRST_LOOK", 64)
    monkeypatch.setattr(run, "FASTER", 1.0)
    pendulum = model("pendulums/double_pendulum", "minimal")
    whole = simulate(pendulum, accuracy=1e-6, until=15.0)
    assert len(attempts) == 2
    path, parts = tmp_path / "c", 0
    while True:
        looks = iter(range(10**9))
        found = simulate(
            pendulum,
            accuracy=1e-6,
            until=15.0,
            checkpoint=Checkpoint(str(path), resume=path.exists()),
            stop=lambda looks=looks, most=3 * (parts + 1): next(looks) >= most,
        )
        if found.status != "stopped":
            break
        parts += 1
    assert parts > 1
    assert found.all_evaluations == whole.all_evaluations
    assert found.npz() == whole.npz()
