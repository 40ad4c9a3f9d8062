"""Speed against accuracy: which runs there are, what they cost and which are worth it."""

from __future__ import annotations

import gc
import time
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.errors import InputError
from lagrange_cli.simulate import INTEGRATORS, simulate
from lagrange_cli.simulate.accuracy.measured import start_alone
from lagrange_cli.simulate.system.functions import right_hand_side
from lagrange_cli.studies.reference import reference
from lagrange_cli.studies.tradeoff import measure as trading
from lagrange_cli.studies.tradeoff import runs as trade_runs
from lagrange_cli.studies.tradeoff.measure import trade
from lagrange_cli.studies.tradeoff.runs import Bench, Setting, has_stagnated, ladder
from tests.simulate.available import INSTALLED
from tests.studies.trade_systems import (
    ANGLE,
    BALL,
    OSCILLATOR,
    PENDULUM,
    ROD,
    STIFF,
    made,
    model,
    problem_and_coarse_run,
)

pytestmark = pytest.mark.usefixtures("frozen_garbage")


def bench_of(system, budget=1.0):
    request, functions, problem, coarse = problem_and_coarse_run(system)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    return Bench(system, functions, problem, request, coarse, known, budget)


def too_slow(trade):
    """Names of methods that can run, but were left out for their seconds."""
    words = " times the seconds of ", "made from Python"
    return {name for name, why in trade.left_out.items() if any(w in why for w in words)}


# Runs


@pytest.mark.slow
def test_every_method_runs_or_says_why_not(traded):
    names = {p.setting.method for p in traded.points}
    assert names.isdisjoint(traded.left_out)
    assert names.union(traded.left_out) == set(INTEGRATORS)
    assert set(traded.left_out) - too_slow(traded) == set(INTEGRATORS) - set(INSTALLED)
    assert {b.point.setting.accuracy for b in traded.automatic} == {1e-3, 1e-6, 1e-9, 1e-12}


@pytest.mark.slow
def test_errors_are_those_from_the_closed_form(oscillator, traded):
    bench = bench_of(oscillator)
    ok = [p for p in traded.points if p.outcome == "ok" and p.evaluations < 50_000]
    with np.errstate(all="ignore"):
        each = [
            bench.explore(Setting(name, rtol=1e-6) if method.adaptive else Setting(name, step=0.01))
            for name, method in INSTALLED.items()
        ]
    for point in [*ok[:: max(len(ok) // 15, 1)], *each]:
        setting = point.setting
        how = {"method": setting.method, "rtol": setting.rtol, "step": setting.step}
        run = simulate(oscillator, **how, samples=61)
        states = np.column_stack([run.columns["x"], run.columns["dot(x)"]])
        off = np.abs(states - np.column_stack([np.cos(run.t), -np.sin(run.t)]))
        error = (off / [run.scales["x"], run.scales["dot(x)"]]).max()
        # Scales are the reference's.
        assert point.error == pytest.approx(error, rel=0.05 + point.error, abs=5e-15)
        assert (point.evaluations, point.steps) == (run.rhs_evaluations, run.steps)
        assert point.drift == pytest.approx(run.energy_drift, rel=1e-3, abs=1e-16)


@pytest.mark.slow
def test_errors_of_methods_span_the_same_range(traded):
    for name in ("DOP853", "RK4", "Gauss4", "Gauss6"):
        known = [p.error for p in traded.points if p.setting.method == name and p.error]
        assert min(known) < 1e-9
        assert max(known) > (1e-6 if name in ("DOP853", "RK4") else 1e-12)


def test_finer_runs_of_fixed_step_take_smaller_steps_that_divide_the_samples(traded):
    steps = [p.setting.step for p in traded.points if p.setting.method == "Verlet"]
    assert len(steps) > 3
    assert all(b < a for a, b in pairwise(steps))
    assert all(abs(0.1 / h - round(0.1 / h)) < 1e-6 for h in steps)


@pytest.mark.slow
def test_seconds_of_a_run_are_within_those_of_its_call(oscillator):
    bench, started = bench_of(oscillator), time.perf_counter()
    seconds = bench.seconds(Setting("RK4", step=0.01))
    assert 0 < seconds < time.perf_counter() - started


def test_each_run_has_its_seconds_and_their_spread(traded):
    for point in traded.points:
        assert len(point.seconds) in ((1, 2) if point.outcome == "ok" else (0,))
        first, third = point.quartiles
        assert first <= point.median <= third


def test_recommended_runs_are_good_enough_and_no_worse_one_is(traded):
    assert [r.accuracy for r in traded.recommended][:3] == [1e-3, 1e-6, 1e-9]
    for found in traded.recommended:
        assert found.point.error + traded.reference.error <= found.accuracy
        good = [p for p in traded.points if p.distance + traded.reference.error <= found.accuracy]
        assert found.point.median <= 1.1 * min(p.median for p in good)


def test_fronts_are_those_of_seconds_and_of_right_hand_sides(traded):
    ok = [p for p in traded.points if p.error is not None and p.error <= 1]
    ok = [replace(p, error=max(p.error, 1e-13)) for p in ok]
    for cost, on in (("median", "pareto"), ("evaluations", "pareto_evaluations")):
        for p in ok:
            beaten = any(
                q.error <= p.error
                and getattr(q, cost) <= getattr(p, cost)
                and (q.error, getattr(q, cost)) != (p.error, getattr(p, cost))
                for q in ok
            )
            assert getattr(p, on) == (not beaten)


def test_auto_is_measured_as_simulate_runs_it(oscillator, traded):
    for found in traded.automatic[:2]:
        point = found.point
        run = simulate(oscillator, accuracy=point.setting.accuracy)
        assert (point.chosen, point.evaluations) == (run.method, run.rhs_evaluations)
        assert point.error <= point.setting.accuracy
        assert found.evaluations_needed >= 0.5


@pytest.mark.slow
def test_it_is_the_same_again_but_for_the_time(oscillator):
    def once():
        found = trade(oscillator, methods=["RK45", "Gauss4", "auto"], repeat=1, until=1.0)
        points = [*found.points, *(b.point for b in found.automatic)]
        return [
            replace(p, spent=0.0, seconds=(), pareto=False) for p in points
        ], found.reference.error

    assert once() == once()


def test_a_run_beyond_the_budget_is_given_up_with_its_count(oscillator):
    with np.errstate(all="ignore"):
        point = bench_of(oscillator, budget=-1.0).explore(Setting("RK45", rtol=1e-9))
    assert point.outcome == "given_up"
    assert point.error is None
    assert point.evaluations > 0
    assert "reached" in point.reason
    assert has_stagnated([point])


@pytest.mark.slow
def test_the_python_interface_measures_too():
    found = loads(OSCILLATOR).derive().tradeoff(methods=["RK4"], repeat=1, until=1.0)
    assert (found.name, found.until) == ("oscillator", 1.0)
    assert {p.setting.method for p in found.points} == {"RK4"}


def test_an_interrupt_during_auto_is_not_taken_for_a_spent_budget(oscillator, monkeypatch):
    def interrupted(problem, eps, watch):
        return start_alone(problem, 0.0)

    monkeypatch.setattr(trade_runs, "integrate_to_accuracy", interrupted)
    with pytest.raises(KeyboardInterrupt):
        trade(oscillator, methods=["auto"], repeat=1)


def test_the_end_of_a_method_is_where_it_gets_no_better():
    better = [made(10.0**-k) for k in range(2, 8)]
    assert not any(has_stagnated(better[:k]) for k in range(1, 7))
    assert has_stagnated([*better, made(1e-7), made(9e-8), made(2e-7)])
    assert not has_stagnated([*better, made(1e-7), made(9e-8), made(1e-9)])
    assert has_stagnated([made(1e-12, resolved=False)])
    assert has_stagnated([made(1e-13)])
    assert not has_stagnated([made(2e-13)])
    # Nothing is known of motions that are all wrong, or end early.
    assert not has_stagnated([made(3.0), made(4.0), made(2.0), made(5.0), made(None)])


def test_ladders_go_from_coarse_to_fine(oscillator):
    bench = bench_of(oscillator)
    for name, method in INSTALLED.items():
        settings = list(ladder(bench, name))
        given_values = [s.rtol if method.adaptive else s.step for s in settings]
        assert len(settings) > 10
        assert all(b < a for a, b in pairwise(given_values))


#: Method → seconds at a tolerance.
COSTS = {
    "DOP853": lambda rtol: 1e-3,
    "Gauss16": lambda rtol: 1e-4 if rtol > 1e-9 else 0.3,
    "BDF": lambda rtol: 0.21 + rtol,
    "LSODA": lambda rtol: 0.2 if rtol > 5e-4 else 2e-3,
}


class Recorder:
    """A bench that runs nothing and says what it was asked; errors are the tolerances."""

    def __init__(self):
        self.asked = []

    def seconds(self, setting):
        self.asked.append(setting.rtol)
        return float(len(self.asked))

    def explore(self, setting):
        seconds = COSTS[setting.method](setting.rtol)
        self.asked.append((setting.method, seconds))
        return made(max(setting.rtol, 2e-13), seconds, setting=setting)


@pytest.mark.slow
def test_short_runs_are_repeated_in_turn_and_long_ones_are_not():
    points = [made(1e-3, 1e-3, setting=Setting("RK45", rtol=x)) for x in (1e-3, 1e-4)]
    points.append(made(None, setting=Setting("RK45", rtol=1e-5)))
    points.append(made(1e-3, 0.02, setting=Setting("RK45", rtol=1e-6)))
    points.append(made(1e-3, 7.0, setting=Setting("RK45", rtol=1e-7)))
    bench, told = Recorder(), []
    timed = trading.timed_points(bench, points, 4, told.append)
    assert bench.asked == [1e-3, 1e-4, 1e-6] * 3 + [1e-3, 1e-4]
    assert [p.seconds for p in timed] == [(1, 4, 7, 10), (2, 5, 8, 11), (), (3, 6, 9), (7.0,)]
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_a_method_that_is_far_behind_ends_and_is_left_out_with_one_line():
    bench, told = Recorder(), []
    points, left_out = trading.explored_points(bench, [*COSTS], False, told.append)
    assert left_out == {"BDF": "BDF takes 2101 times the seconds of Gauss16 for the same error"}
    runs = [name for name, _ in bench.asked]
    assert runs.count("BDF") == 2
    assert "BDF" not in {p.setting.method for p in points}
    # Fast at first: its runs are kept, and the second that is far behind is its last.
    assert [p.setting.rtol for p in points if p.setting.method == "Gauss16"][-2:] == [1e-9, 1e-10]
    # Slow by chance in its first run.
    assert runs.count("LSODA") == runs.count("DOP853") == 13
    assert told == sorted(told)


def test_cheap_runs_come_first_and_methods_asked_for_go_on_however_slow():
    bench = Recorder()
    points, left_out = trading.explored_points(bench, [*COSTS], True, lambda _: None)
    assert left_out == {}
    assert len(points) == 4 * 13
    # The first runs are of all; then ladders that are cheap go on to their ends.
    assert [seconds for _, seconds in bench.asked[4:10]] == [1e-4] * 5 + [0.3]
    assert {name for name, _ in bench.asked[10:34]} == {"DOP853", "LSODA"}
    assert {seconds > 0.1 for _, seconds in bench.asked[34:]} == {True}


@pytest.mark.slow
def test_no_garbage_is_collected_while_runs_are_timed(oscillator, monkeypatch):
    enabled = []
    run = Bench.run

    def watched(bench, setting):
        enabled.append(gc.isenabled())
        return run(bench, setting)

    monkeypatch.setattr(Bench, "run", watched)
    assert gc.isenabled()
    trade(oscillator, methods=["DOP853"], repeat=2, until=1.0)
    assert gc.isenabled()
    assert not any(enabled)


@pytest.mark.slow
def test_progress_never_falls_and_ends_at_one(oscillator):
    told = []
    trade(oscillator, methods=["RK4", "auto"], repeat=1, until=2.0, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


# Kinds of scenes


@pytest.mark.slow
def test_constraints_beside_coordinates_are_measured_like_closed_ones():
    minimal, rod = model(PENDULUM, ANGLE), model(PENDULUM, ROD)
    assert rod.formulation == "multiplier"
    found = trade(rod, methods=["DOP853", "RK4"], repeat=1)
    exact = simulate(minimal, accuracy=1e-12)
    _, _, problem, coarse = problem_and_coarse_run(rod)
    with np.errstate(all="ignore"):
        states = reference(problem, coarse, 30.0).motion.states
    assert np.abs(states[:, 0] - exact.columns["x"]).max() < 1e-11
    assert {p.setting.method for p in found.points} == {"DOP853", "RK4"}
    assert min(p.distance for p in found.points) < 1e-10


@pytest.mark.slow
def test_methods_stepped_from_python_are_tried_where_motion_is_stiff_or_interpreted(
    oscillator, traded, monkeypatch
):
    if right_hand_side(oscillator).native:
        assert "CVODE" not in {p.setting.method for p in traded.points}
        assert set(traded.left_out) >= {"RK45", "BDF", "LSODA", "taylor", "CVODE", "IDA"} & {
            *INSTALLED
        }
    tried = []

    def chosen(bench, methods, *args):
        tried.append(methods)
        return [], {}

    monkeypatch.setattr(trading, "explored_points", chosen)
    trade(model(STIFF), repeat=1)
    monkeypatch.setenv("CC", "/nowhere/cc")
    trade(oscillator, repeat=1, until=1.0)
    assert all({"BDF", "LSODA"} <= {*methods} for methods in tried)
    assert len(tried) == 2


@pytest.mark.slow
def test_methods_that_cannot_project_or_stop_at_events_are_left_out():
    of_rod = trade(model(PENDULUM, ROD), repeat=1, budget=0.05, until=0.2)
    assert set(of_rod.left_out) >= {"LSODA"}
    assert "rod" in of_rod.left_out["LSODA"]
    of_ball = trade(model(BALL), repeat=1, budget=0.2, until=1.2)
    events = {n for n, m in INSTALLED.items() if m.interpolates and m.projects}
    assert {p.setting.method for p in of_ball.points} | too_slow(of_ball) == events
    assert set(of_ball.left_out) - too_slow(of_ball) == set(INTEGRATORS) - events


@pytest.mark.slow
def test_the_bounces_of_a_ball_are_those_of_the_closed_form():
    ball = model(BALL)
    _, _, problem, coarse = problem_and_coarse_run(ball)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    # Falls for 1 s; flights last 2 e^k s.
    expected, end = [1.0], 1.0
    while end + 2 * 0.5 ** len(expected) < 2.4:
        end += 2 * 0.5 ** len(expected)
        expected.append(end)
    assert [s.t for s in known.motion.switches] == pytest.approx(expected, abs=1e-12)
    found = trade(ball, methods=["DOP853", "auto"], repeat=1)
    assert all(p.error < 1e-9 for p in found.points)
    assert found.points[0].drift < 1e-12


def test_a_method_that_cannot_run_is_refused_where_it_was_asked_for(oscillator):
    with pytest.raises(InputError, match="did you mean 'DOP853'"):
        trade(oscillator, methods=["DOP835"])
    with pytest.raises(InputError, match="LSODA cannot") as caught:
        trade(model(PENDULUM, ROD), methods=["LSODA"])
    assert caught.value.problems[0].hint.startswith("--methods auto,DOP853,")
    assert "LSODA" not in caught.value.problems[0].hint
