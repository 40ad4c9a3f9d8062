"""Members that are enumerated as they are asked for: grids and random draws."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy import stats

from lagrange_cli import load, sampled
from lagrange_cli.simulate.ensemble.plan.sampling import sampled as drawn
from lagrange_cli.simulate.ensemble.plan.sources import grid

KINDS = ["a ~ uniform(-pi, pi)", "dot(a)~normal(1, 2)", "b ~ loguniform(0.1, 10)"]


def test_members_of_a_grid_are_its_combinations():
    found = grid(["a=[1,2,3]", "b=[x, y]", "c=linspace(0,1,4)"])
    whole = [*found.rows()]
    assert len(found) == len(whole) == 24
    assert [*found.rows(5, 9)] == whole[5:9]
    assert found.values(23) == {"a": "3", "b": "y", "c": "1.0"}


def test_a_billion_members_are_not_made():
    started = time.process_time()
    found = grid([f"{name}=linspace(0,1,1000)" for name in "abc"])
    assert len(found) == 10**9
    assert found.values(10**9 - 2) == {"a": "1.0", "b": "1.0", "c": repr(998 / 999)}
    assert time.process_time() - started < 1


def test_a_member_is_the_same_alone_and_among_others():
    many = drawn(KINDS, 20_000, 7)
    rows = [*many.rows()]
    for k in (0, 1, 2, 3, 4095, 4096, 9999, 19_999):
        assert [*drawn(KINDS, 10**9, 7).rows(k, k + 1)] == [rows[k]]
        assert many.values(k) == dict(zip(("a", "dot(a)", "b"), rows[k], strict=True))
    assert [*many.rows(4093, 4101)] == rows[4093:4101]
    assert [*drawn(KINDS, 4, 8).rows()] != rows[:4]


def test_draws_are_distributed_as_they_say():
    a, v, b = np.array([*drawn(KINDS, 20_000, 3).rows()], dtype=float).T
    for values, distribution in (
        (a, stats.uniform(-np.pi, 2 * np.pi)),
        (v, stats.norm(1, 2)),
        (b, stats.loguniform(0.1, 10)),
    ):
        assert stats.kstest(values, distribution.cdf).pvalue > 1e-3
    assert abs(np.corrcoef([a, v, b])[np.triu_indices(3, 1)]).max() < 0.03


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2])
def test_drawn_members_are_simulated(jobs):
    derivation = load("systems/pendulums/pendulum.yaml").derive()
    members = sampled({"theta": "uniform(-1, 1)", "l": "loguniform(0.5, 2)"}, 40, seed=5)
    found = derivation.ensemble(members, until=1.0, columns=[], final=True, jobs=jobs)
    assert set(found.status) == {"ok"}
    alone = derivation.simulate(
        until=1.0,
        initial={"theta": members.values(17)["theta"]},
        parameters={"l": members.values(17)["l"]},
    )
    assert found.final["theta"][17] == pytest.approx(alone.columns["theta"][-1], abs=1e-6)
