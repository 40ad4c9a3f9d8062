"""Speed against accuracy: references, errors against closed forms, fronts, reports, refusals."""

from __future__ import annotations

import gc
import json
import math
import sys
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli import loads
from lagrange_cli.errors import AccuracyError, InputError
from lagrange_cli.simulate import INTEGRATORS, simulate, trade_runs
from lagrange_cli.simulate import trade as trading
from lagrange_cli.simulate.accuracy import only_the_start
from lagrange_cli.simulate.front import behind, cheapest, pareto
from lagrange_cli.simulate.integrators.switching import Switch
from lagrange_cli.simulate.modelling import model_of
from lagrange_cli.simulate.pilot import pilot
from lagrange_cli.simulate.problem import InitialValueProblem, running_scales
from lagrange_cli.simulate.reference import Motion, errors, reference
from lagrange_cli.simulate.request import resolve
from lagrange_cli.simulate.right_hand_side import right_hand_side
from lagrange_cli.simulate.simulation import problem_of
from lagrange_cli.simulate.trade import trade
from lagrange_cli.simulate.trade_plot import draw_trade
from lagrange_cli.simulate.trade_report import character_plot, options_of, summary, text
from lagrange_cli.simulate.trade_runs import Bench, Point, Setting, at_the_end, ladder
from lagrange_cli.simulate.watch import Watch

OSCILLATOR = """
name: oscillator
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: x^2/2}
initial: {x: 1}
simulate: {until: 6, samples: 61}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1, g: 9.81}
particles: {bob: {mass: m, position: [x, 0, z]}}
FORM
potentials: {weight: m*g*z}
simulate: {until: 2, samples: 41}
"""

ANGLE = """
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
initial: {theta: 1}
"""

ROD = """
constraints: {rod: x^2 + z^2 = l^2}
coordinates: [x, z]
initial: {x: sin(1), z: -cos(1)}
"""

BALL = """
name: ball
parameters: {g: 10, e: 0.5}
plane: xz
particles: {ball: {mass: 1, position: [x, y, z]}}
constraints: {floor: {unilateral: z >= 0, restitution: e}}
potentials: {weight: {gravity: g}}
initial: {x: 0, z: 5, dot(x): 1}
simulate: {until: 2.4, samples: 25}
"""

DOUBLE = """
name: double
parameters: {g: 9.81}
particles:
  a: {mass: 1, position: [sin(p), 0, -cos(p)]}
  b: {mass: 1, position: [sin(p) + sin(q), 0, -cos(p) - cos(q)]}
coordinates: [p, q]
potentials: {weight: {gravity: g}}
initial: {p: 1.5, q: 2}
simulate: {until: 70, samples: 141}
"""

RUNAWAY = """
name: runaway
particles: {m: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {hill: -x^4/2}
initial: {x: 1, dot(x): 1}
simulate: {until: 2, samples: 21}
"""


def model(scene, form=""):
    return model_of(loads(scene.replace("FORM", form)).derive().equations)


@pytest.fixture(scope="module")
def oscillator():
    return model(OSCILLATOR)


@pytest.fixture(scope="module")
def traded(oscillator):
    return trade(oscillator, repeat=2, budget=0.3)


def problem_and_pilot(of):
    request = resolve(of, None, None, "DOP853", 1e-6, None, None, None, None)
    functions = right_hand_side(of)
    problem = problem_of(of, request, functions)
    with np.errstate(all="ignore"):
        return request, functions, problem, pilot(problem, 1e-9, Watch())


def made(error, seconds=1.0, method="DOP853", evaluations=100, **more):
    """A point that was made up."""
    outcome = "ok" if error is not None else "failed"
    given_seconds = (seconds,) if error is not None else ()
    setting = Setting(method, rtol=1e-6)
    point = Point(setting, outcome, "", error, True, 9, evaluations, None, given_seconds)
    return replace(point, **more)


# Fronts

number = st.sampled_from([0.0, 1e-12, 0.5, 1.0, 2.0, 3.0, math.inf])
pair = st.tuples(number, number)


@given(st.lists(pair, max_size=12))
def test_the_front_is_what_no_other_point_beats(points):
    def beats(a, b):
        return a != b and a[0] <= b[0] and a[1] <= b[1]

    expected = [
        all(map(math.isfinite, p)) and not any(beats(other, p) for other in points) for p in points
    ]
    assert pareto(points) == expected


@given(st.lists(st.tuples(st.floats(), st.floats()), max_size=8))
def test_the_front_of_anything_has_finite_points_only(points):
    front = [p for p, on in zip(points, pareto(points), strict=True) if on]
    assert all(math.isfinite(x) for p in front for x in p)
    assert bool(front) == any(all(map(math.isfinite, p)) for p in points)


@given(number, st.floats(0.1, 10), st.lists(st.tuples(number, st.floats(0.1, 10)), max_size=8))
def test_behind_is_a_factor_over_the_cheapest_that_is_as_good(error, cost, points):
    good = [c for e, c in points if e <= error]
    found = behind(error, cost, points)
    assert (found is None) == (not good)
    if found is not None:
        assert found * min(good) == pytest.approx(cost)


def test_of_runs_that_are_as_fast_the_one_of_least_work_is_the_cheapest():
    runs = [(1.0, 500), (1.05, 100), (1.5, 10)]
    assert cheapest(runs, lambda r: r[0], lambda r: r[1]) == (1.05, 100)
    assert cheapest([], lambda r: r[0], lambda r: r[1]) is None


# Errors


def plain(times, kinds=("length",)):
    return InitialValueProblem(lambda t, y: y, np.zeros(2 * len(kinds)), np.array(times), kinds)


def test_errors_are_the_largest_so_far_over_the_scales():
    problem = plain([0.0, 1.0, 2.0, 4.0])
    one = Motion(np.zeros((4, 2)), (), 4.0)
    other = Motion(np.array([[0, 0], [0.2, 0], [0, 6], [0.1, 0]]), (), 4.0)
    found = errors(problem, np.array([0.5, 10.0]), one, other)
    assert found.tolist() == [0, 0.4, 0.6, 0.6]


def test_what_is_not_finite_is_an_infinite_error():
    problem = plain([0.0, 1.0])
    other = Motion(np.array([[0, 0], [np.nan, 0]]), (), 1.0)
    found = errors(problem, np.ones(2), Motion(np.zeros((2, 2)), (), 1.0), other)
    assert found[1] == np.inf


def jump(t, contact=0, kind="contact"):
    return Switch(t, contact, kind, np.array([0.0, -1.0]), np.array([0.0, 1.0]), (False,))


def test_velocities_beside_a_jump_do_not_count_but_its_time_does():
    problem = plain([0.0, 1.0, 2.0])
    before, after = np.array([[0, -1], [0, -1], [0, 1.0]]), np.array([[0, -1], [0, 1], [0, 1.0]])
    one, other = Motion(before, (jump(1.01),), 2.0), Motion(after, (jump(0.99),), 2.0)
    found = errors(problem, np.ones(2), one, other)
    # The event is 0.02 off in a span of 2; the sample at 1 lies between both.
    assert found[-1] == pytest.approx(0.02 / 2)
    missed = Motion(after, (), 2.0)
    assert errors(problem, np.ones(2), one, missed)[-1] == np.inf
    elsewhere = Motion(after, (jump(0.99, contact=1),), 2.0)
    assert errors(problem, np.ones(2), one, elsewhere)[-1] == np.inf


# References


def test_a_reference_is_within_its_error_of_the_closed_form(oscillator):
    _, _, problem, found = problem_and_pilot(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, found, 30.0)
    t = problem.times
    off = np.abs(known.motion.states - np.column_stack([np.cos(t), -np.sin(t)])) / known.scales
    assert off.max() <= known.error + 2 * np.finfo(float).eps
    assert known.error < 1e-12
    assert known.scales == pytest.approx([2, 1], rel=1e-2)
    assert problem.until == 6


def test_a_reference_in_long_doubles_is_checked_by_another_method(traded):
    if "long doubles" not in traded.reference.method:
        pytest.skip("no wider arithmetic here")
    assert traded.reference.checked in INTEGRATORS
    assert traded.reference.checked != "DOP853"
    assert traded.reference.difference < 1e-11


def test_without_a_compiler_two_methods_are_compared(oscillator, monkeypatch):
    monkeypatch.setenv("CC", "/nowhere/cc")
    found = trade(oscillator, methods=["DOP853"], repeat=1, until=2.0, budget=10.0)
    assert "interpreted" in found.implementation
    assert found.reference.method == "Gauss16 against DOP853"
    assert found.reference.checked is None
    assert found.reference.error < 1e-12


def refusal(*args, **kwargs):
    with pytest.raises(AccuracyError) as caught:
        trade(*args, **kwargs)
    (problem,) = caught.value.problems
    assert caught.value.exit_code == 1
    return problem.message, problem.hint


def test_chaos_is_refused_with_an_end_that_has_a_reference():
    of = model(DOUBLE)
    message, hint = refusal(of, repeat=1)
    assert "chaotic" in message
    until = float(hint.removeprefix("--until "))
    assert 5 < until < 60
    found = trade(of, methods=["Gauss16"], repeat=1, until=until)
    assert found.reference.error < 1e-4
    assert found.until == until


def test_a_singularity_is_refused_with_an_end_before_it():
    # x = 1/(1 - t) solves it.
    message, hint = refusal(model(RUNAWAY), repeat=1)
    assert "cannot be continued past t = 1" in message
    assert 0.5 < float(hint.removeprefix("--until ")) < 1


def test_bounces_without_end_are_refused_with_an_end_before_them():
    # They end at sqrt(2 h/g) (1 + e)/(1 - e) = 3.
    message, hint = refusal(model(BALL), until=4.0, repeat=1)
    assert "infinitely many by t = 3" in message
    assert 2 < float(hint.removeprefix("--until ")) < 3


def test_no_time_for_a_reference_is_a_refusal(oscillator):
    message, hint = refusal(oscillator, budget=1e-12)
    assert "budget" in message
    assert hint == "--budget 60"


# Runs


def test_every_method_runs_or_says_why_not(traded):
    names = {p.setting.method for p in traded.points}
    assert names == set(INTEGRATORS)
    assert traded.left_out == {}
    assert {b.point.setting.accuracy for b in traded.automatic} == {1e-3, 1e-6, 1e-9, 1e-12}


def test_errors_are_those_from_the_closed_form(oscillator, traded):
    ok = [p for p in traded.points if p.outcome == "ok" and p.evaluations < 50_000]
    assert len({p.setting.method for p in ok}) == len(INTEGRATORS)
    for point in ok[:: max(len(ok) // 25, 1)]:
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


def test_each_run_has_its_seconds_and_their_spread(traded):
    for point in traded.points:
        assert len(point.seconds) == (2 if point.outcome == "ok" else 0)
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


def test_it_is_the_same_again_but_for_the_time(oscillator):
    def once():
        found = trade(oscillator, methods=["RK45", "Gauss4", "auto"], repeat=1, until=2.0)
        points = [*found.points, *(b.point for b in found.automatic)]
        return [replace(p, seconds=(), pareto=False) for p in points], found.reference.error

    assert once() == once()


def test_a_run_beyond_the_budget_is_given_up_with_its_count(oscillator):
    request, functions, problem, found = problem_and_pilot(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, found, 30.0)
        bench = Bench(oscillator, functions, problem, request, found, known, -1.0)
        point = bench.explore(Setting("RK45", rtol=1e-9))
    assert point.outcome == "given_up"
    assert point.error is None
    assert point.evaluations > 0
    assert "reached" in point.reason
    assert at_the_end([point])


def test_the_python_interface_measures_too():
    found = loads(OSCILLATOR).derive().tradeoff(methods=["RK4"], repeat=1, until=1.0)
    assert (found.name, found.until) == ("oscillator", 1.0)
    assert {p.setting.method for p in found.points} == {"RK4"}


def test_an_interrupt_during_auto_is_not_taken_for_a_spent_budget(oscillator, monkeypatch):
    def interrupted(problem, eps, watch):
        return only_the_start(problem, 0.0)

    monkeypatch.setattr(trade_runs, "integrate_to_accuracy", interrupted)
    with pytest.raises(KeyboardInterrupt):
        trade(oscillator, methods=["auto"], repeat=1)


def test_the_end_of_a_method_is_where_it_gets_no_better():
    better = [made(10.0**-k) for k in range(2, 8)]
    assert not any(at_the_end(better[:k]) for k in range(1, 7))
    assert at_the_end([*better, made(1e-7), made(9e-8), made(2e-7)])
    assert not at_the_end([*better, made(1e-7), made(9e-8), made(1e-9)])
    assert at_the_end([made(1e-16, resolved=False)])
    # Nothing is known of motions that are all wrong, or end early.
    assert not at_the_end([made(3.0), made(4.0), made(2.0), made(5.0), made(None)])


def test_ladders_go_from_coarse_to_fine(oscillator):
    request, functions, problem, found = problem_and_pilot(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, found, 30.0)
    bench = Bench(oscillator, functions, problem, request, found, known, 1.0)
    for name, method in INTEGRATORS.items():
        settings = list(ladder(bench, name))
        given_values = [s.rtol if method.adaptive else s.step for s in settings]
        assert len(settings) > 10
        assert all(b < a for a, b in pairwise(given_values))


class Recorder:
    """A bench that runs nothing and says what it was asked."""

    def __init__(self):
        self.asked = []

    def seconds(self, setting):
        self.asked.append((setting.rtol, gc.isenabled()))
        return float(len(self.asked))


def test_repetitions_are_interleaved_and_no_garbage_is_collected():
    points = [made(1e-3, setting=Setting("RK45", rtol=x)) for x in (1e-3, 1e-4)]
    points.append(made(None, setting=Setting("RK45", rtol=1e-5)))
    bench, told = Recorder(), []
    assert gc.isenabled()
    timed = trading._timed(bench, points, 3, told.append)
    assert gc.isenabled()
    assert bench.asked == [(1e-3, False), (1e-4, False)] * 3
    assert [p.seconds for p in timed] == [(1, 3, 5), (2, 4, 6), ()]
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_progress_never_falls_and_ends_at_one(oscillator):
    told = []
    trade(oscillator, methods=["RK4", "auto"], repeat=1, until=2.0, progress=told.append)
    assert told == sorted(told)
    assert told[-1] == pytest.approx(1.0)


# Kinds of scenes


def test_constraints_beside_coordinates_are_measured_like_closed_ones():
    minimal, rod = model(PENDULUM, ANGLE), model(PENDULUM, ROD)
    assert rod.formulation == "multiplier"
    found = trade(rod, methods=["DOP853", "RK4"], repeat=1)
    exact = simulate(minimal, accuracy=1e-12)
    _, _, problem, coarse = problem_and_pilot(rod)
    with np.errstate(all="ignore"):
        states = reference(problem, coarse, 30.0).motion.states
    assert np.abs(states[:, 0] - exact.columns["x"]).max() < 1e-11
    assert {p.setting.method for p in found.points} == {"DOP853", "RK4"}
    assert min(p.distance for p in found.points) < 1e-10


def test_methods_that_cannot_project_or_stop_at_events_are_left_out():
    of_rod = trade(model(PENDULUM, ROD), repeat=1, budget=0.05, until=0.2)
    assert set(of_rod.left_out) >= {"LSODA"}
    assert "rod" in of_rod.left_out["LSODA"]
    of_ball = trade(model(BALL), repeat=1, budget=0.2)
    events = {n for n, m in INTEGRATORS.items() if m.interpolates and m.projects}
    assert {p.setting.method for p in of_ball.points} == events
    assert set(of_ball.left_out) == set(INTEGRATORS) - events


def test_the_bounces_of_a_ball_are_those_of_the_closed_form():
    of = model(BALL)
    _, _, problem, coarse = problem_and_pilot(of)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    # Falls for 1 s; flights last 2 e^k s.
    expected, end = [1.0], 1.0
    while end + 2 * 0.5 ** len(expected) < 2.4:
        end += 2 * 0.5 ** len(expected)
        expected.append(end)
    assert [s.t for s in known.motion.switches] == pytest.approx(expected, abs=1e-12)
    found = trade(of, methods=["DOP853", "auto"], repeat=1)
    assert all(p.error < 1e-9 for p in found.points)
    assert found.points[0].drift < 1e-12


def test_a_method_that_cannot_run_is_refused_where_it_was_asked_for(oscillator):
    with pytest.raises(InputError, match="did you mean 'DOP853'"):
        trade(oscillator, methods=["DOP835"])
    with pytest.raises(InputError, match="LSODA cannot") as caught:
        trade(model(PENDULUM, ROD), methods=["LSODA"])
    assert caught.value.problems[0].hint.startswith("--methods auto,DOP853,")
    assert "LSODA" not in caught.value.problems[0].hint


# Reports


def test_summary_is_the_contract(traded):
    found = json.loads(json.dumps(summary(traded), allow_nan=False))
    assert found["name"] == "oscillator"
    assert set(found["reference"]) == {"method", "error", "checked"}
    contract = {"method", "rtol", "error", "seconds", "rhs_evaluations", "energy_drift", "pareto"}
    assert all(contract <= set(run) for run in found["runs"])
    assert len(found["runs"]) == len(traded.points)
    assert all({"accuracy", "method"} <= set(r) for r in found["recommended"])
    assert {(run["rtol"] is None) ^ (run["step"] is None) for run in found["runs"]} == {True}


def test_recommended_options_run_the_same(oscillator, traded):
    for found in traded.recommended:
        words = options_of(found.point.setting).split()
        how = dict(zip(words[::2], words[1::2], strict=True))
        run = simulate(
            oscillator,
            method=how["--method"],
            rtol=float(how["--rtol"]) if "--rtol" in how else None,
            step=float(how["--step"]) if "--step" in how else None,
            samples=traded.samples,
        )
        assert run.rhs_evaluations == found.point.evaluations


def test_text_has_every_run_and_what_follows(traded):
    shown = text(traded)
    rows = [line for line in shown.splitlines() if line.startswith("  DOP853 ")]
    assert len(rows) == sum(p.setting.method == "DOP853" for p in traded.points)
    assert "Recommended\n  1e-03  --method" in shown
    assert "--accuracy 1e-06" in shown
    assert shown.isascii()


def test_runs_that_fail_alike_are_one_row(traded):
    points = [made(None, reason="no", setting=Setting("RK4", step=h)) for h in (0.2, 0.1, 0.05)]
    shown = text(replace(traded, points=tuple(points), automatic=()))
    assert "step 0.2       failed, with 2 finer ones, after 300 evaluations: no" in shown
    assert "Recommended  nothing" in shown
    assert "no run to draw" in shown


def test_auto_alone_has_no_table(traded):
    shown = text(replace(traded, points=()))
    assert "Recommended" not in shown
    assert "--accuracy 1e-06" in shown


def test_the_picture_of_characters_has_each_run_at_its_place():
    points = [
        made(1e-2, 1e-3, pareto=True),
        made(1e-8, 1e-1, pareto=True),
        made(1e-2, 1e-1, method="RK4"),
        made(5.0, 1e-3, method="RK4"),
        made(None),
    ]
    lines = character_plot(points, 41, 7)
    picture = [line[8:].ljust(41) for line in lines[1:8]]
    assert (picture[0][0], picture[6][40], picture[0][40]) == ("A", "A", "b")
    assert sum(c != " " for row in picture for c in row) == 3
    assert lines[1].startswith(" 1e-02 |")
    assert lines[7].startswith(" 1e-08 |")
    assert lines[9].split() == ["1e-03", "1e-01", "s"]
    assert lines[10].split() == ["a", "DOP853", "b", "RK4"]


def test_one_run_makes_a_picture_too():
    assert any("A" in line for line in character_plot([made(1e-3, 1e-3, pareto=True)])[1:-1])


@given(st.lists(st.tuples(st.floats(0, 1e300), st.floats(1e-9, 1e6)), max_size=6))
def test_pictures_keep_their_width_whatever_is_drawn(pairs):
    lines = character_plot([made(e, s) for e, s in pairs], 40, 10)
    assert all(len(line) <= 8 + 40 for line in lines[:-1])


@pytest.mark.parametrize(("ending", "start"), [("png", b"\x89PNG"), ("svg", b"<?xml")])
def test_work_precision_pictures(traded, ending, start):
    pytest.importorskip("matplotlib")
    drawn = draw_trade(traded, ending)
    assert drawn.startswith(start)
    assert draw_trade(traded, ending) == drawn


def test_pictures_of_nothing_can_be_drawn(traded):
    pytest.importorskip("matplotlib")
    nothing = replace(traded, points=(made(None),), automatic=())
    assert draw_trade(nothing, "png").startswith(b"\x89PNG")


def test_pictures_say_what_they_need(traded, monkeypatch):
    pytest.importorskip("matplotlib")
    with pytest.raises(InputError, match=r"\.txt"):
        draw_trade(traded, "txt")
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(InputError, match=r"lagrange-cli\[plot\]"):
        draw_trade(traded, "png")


def test_scales_of_a_reference_are_those_of_the_promise(oscillator):
    _, _, problem, coarse = problem_and_pilot(oscillator)
    with np.errstate(all="ignore"):
        known = reference(problem, coarse, 30.0)
    assert known.scales.tolist() == running_scales(problem, known.motion.states)[-1].tolist()
