"""What is kept of members: ends, columns, and numbers of their motion with estimates of errors."""

from __future__ import annotations

import functools
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipj, ellipk

from lagrange_cli import InputError, loads
from lagrange_cli.simulate.ensemble.reduce.defects import series_along
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Motions, Piece
from lagrange_cli.simulate.ensemble.reduce.enclosures import Expression
from lagrange_cli.simulate.ensemble.reduce.motion_series import Intervals
from lagrange_cli.simulate.ensemble.reduce.reductions import REDUCTIONS
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.requested_outputs import (
    read_reduction,
    reduction_outputs,
    with_reductions,
)

#: x = A cos t, and a column of its energy.
OSCILLATOR = """
name: oscillator
parameters: {m: 1, k: 1, A: 1}
particles: {p: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
initial: {x: 1, dot(x): 0}
outputs: {push: -k*x}
simulate: {until: 20, samples: 201, accuracy: 1e-9}
"""

PENDULUM = """
name: pendulum
parameters: {m: 1, l: 1, g: 1}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
initial: {theta: 1, dot(theta): 0}
simulate: {until: 30, samples: 601, accuracy: 1e-9}
"""

#: The accuracy is an implicit midpoint's, one member at a time: nothing is stepped side by side.
ALONE = {"method": "Gauss16", "rtol": 1e-12}


@pytest.fixture(scope="module")
def oscillator():
    return loads(OSCILLATOR).derive()


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, ALONE], ids=["side by side", "one by one"])
def test_what_is_kept_is_read_off_all_samples(oscillator, how):
    members = {"x": [0.5, 1.0, 2.0], "k": [1.0, 4.0]}
    whole = oscillator.ensemble(members, extra=["energy"], **how)
    some = oscillator.ensemble(
        members, extra=["energy"], columns=["push", "energy"], final=True, **how
    )
    assert sorted(some.columns) == ["energy", "push"]
    for name, column in some.columns.items():
        assert np.array_equal(column, whole.columns[name])
    assert some.final.keys() == whole.columns.keys()
    for name, end in some.final.items():
        assert np.allclose(end, whole.columns[name][:, -1], rtol=1e-14, atol=1e-14)
    assert np.array_equal(some.given["k"], whole.given["k"])


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, {"method": "DOP853", "rtol": 1e-12}])
def test_numbers_of_a_motion_in_closed_form(oscillator, how):
    amplitudes = np.array([0.5, 1.0, 2.0])
    found = oscillator.ensemble(
        {"x": amplitudes.tolist()},
        columns=[],
        reduce=["max(x)", "min(push)", "mean(x^2)", "first(x < 0)", "first(x > 3)", "max(energy)"],
        **how,
    )
    assert found.columns == {}
    quarter = np.pi / 2
    exact = {
        "max(x)": amplitudes,
        "min(push)": -amplitudes,
        "mean(x^2)": amplitudes**2 * (0.5 + np.sin(40) / 80),
        "first(x < 0)": [quarter] * 3,
        "max(energy)": amplitudes**2 / 2,
    }
    for name, values in exact.items():
        off = np.abs(found.reduced[name] - values)
        assert (off < 1e-7).all(), name
        if not how:
            assert (off <= found.reduced_error[name]).all(), name
            assert (found.reduced_error[name] < 2e-7).all(), name
        else:
            assert np.isnan(found.reduced_error[name]).all()
    assert np.isnan(found.reduced["first(x > 3)"]).all()


@pytest.mark.slow
def test_the_swing_of_a_pendulum_by_elliptic_functions():
    """Its largest velocity 2 k sqrt(g/l), and a quarter of its period K(k)."""
    angles = np.array([0.3, 1.5, 3.0])
    found = (
        loads(PENDULUM)
        .derive()
        .ensemble(
            {"theta": angles.tolist()},
            columns=[],
            reduce=["max(dot(theta))", "first(theta < 0)", "first(sin(theta) < sin(0.1))"],
        )
    )
    k = np.sin(angles / 2)
    off = np.abs(found.reduced["max(dot(theta))"] - 2 * k)
    assert (off <= found.reduced_error["max(dot(theta))"]).all()
    off = np.abs(found.reduced["first(theta < 0)"] - ellipk(k**2))
    assert (off <= found.reduced_error["first(theta < 0)"]).all()
    assert (found.reduced_error["first(theta < 0)"] < 1e-6).all()
    # sin(theta/2) = k cd(t)
    t = found.reduced["first(sin(theta) < sin(0.1))"]
    _, cn, dn, _ = ellipj(t[:2], k[:2] ** 2)
    assert np.allclose(2 * np.arcsin(k[:2] * cn / dn), 0.1, atol=1e-6)


def test_functions_of_a_motion(oscillator):
    found = oscillator.ensemble(
        {"x": [1.0, 2.0]},
        columns=[],
        functions={"reach": lambda motion: np.ptp(motion.columns["x"])},
    )
    assert np.allclose(found.reduced["reach"], [2, 4], rtol=1e-3)
    assert "reach" not in found.reduced_error


def test_another_function_of_one_name_is_another(oscillator):
    for function, expected in ((np.max, [1, 2]), (np.min, [-1, -2])):
        found = oscillator.ensemble(
            {"x": [1.0, 2.0]},
            columns=[],
            functions={"end": lambda motion, f=function: f(motion.columns["x"])},
        )
        assert np.allclose(found.reduced["end"], expected, rtol=1e-3)


def test_functions_are_not_resumed_since_they_may_be_others(oscillator, tmp_path):
    with pytest.raises(InputError, match="functions of motions does not go on"):
        oscillator.ensemble(
            {"x": [1.0]},
            functions={"end": lambda motion: motion.t[-1]},
            store=tmp_path / "out.npz",
            resume=True,
        )


@pytest.mark.slow
def test_a_member_that_ends_early_has_no_end_and_no_mean():
    scene = OSCILLATOR.replace("k*x^2/2", "-k*x^4/4").replace("until: 20", "until: 5")
    found = (
        loads(scene)
        .derive()
        .ensemble(
            {"x": [0.01, 1.0]}, columns=[], final=True, reduce=["mean(x)", "max(x)", "first(x > 2)"]
        )
    )
    assert found.status[0] == "ok"
    assert found.status[1] != "ok"
    assert np.isfinite(found.final["x"][0])
    assert np.isnan(
        [found.final["x"][1], found.reduced["mean(x)"][1], found.reduced["max(x)"][1]]
    ).all()
    assert found.reduced["first(x > 2)"][1] > 0


def test_names_that_are_none_are_refused(oscillator):
    for wrong in ({"columns": ["y"]}, {"reduce": ["max(y)"]}, {"reduce": ["sum(x)"]}):
        with pytest.raises(InputError):
            oscillator.ensemble({"x": [1.0]}, **wrong)


# Numbers of polynomials between samples alone.

#: x = A sin(w t + phase), whatever the parameters are: its motion is given by its samples.
POINT = """
name: point
parameters: {level: 0, w: 1}
particles: {p: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
potentials: {V: w^2*x^2/2}
initial: {x: 0}
simulate: {until: 1}
"""


@functools.cache
def model_with(*texts: str) -> Model:
    equations = loads(POINT).derive().equations
    return model_of(with_reductions(equations, [read_reduction(text) for text in texts]))


def reduced(
    text: str, t, x, v, level: float, error: float = 1e-12, frequency: float = 1.0
) -> tuple[float, float]:
    """A number of one motion of an oscillator with these samples."""
    expression = expression_along(text, t, x, v, level, error, frequency)
    (number,), (off,) = REDUCTIONS[read_reduction(text).kind](expression)
    return float(number), float(off)


def expression_along(
    text: str, t, x, v, level: float, error: float, frequency: float
) -> Expression:
    motions = Motions(
        (Piece(t, np.stack([x, v], axis=1)[None]),),
        np.array([[level, frequency]]),
        np.full((1, 2), error),
    )
    along = series_along(model_with(text), motions)
    assert along is not None
    value, *gradient = reduction_outputs(0, 2)
    return Expression(along, value, tuple(gradient))


@pytest.mark.slow
@settings(deadline=None, max_examples=25)
@given(
    st.floats(0.2, 200),
    st.floats(0, 6.3),
    st.integers(60, 300),
    st.floats(-0.99, 0.99),
)
def test_errors_of_numbers_are_bounds(frequency, phase, samples, level):
    """Of a sine that may be sampled too rarely: no number is off by more than is said."""
    t = np.linspace(0, 12, samples)
    x, v = np.sin(frequency * t + phase), frequency * np.cos(frequency * t + phase)
    turns = np.arange(-1, 400)
    tops = (np.pi / 2 + 2 * np.pi * turns - phase) / frequency
    largest = 1.0 if ((tops >= 0) & (tops <= 12)).any() else max(x[0], x[-1])
    number, error = reduced("max(x)", t, x, v, level, frequency=frequency)
    assert abs(number - largest) <= error + 1e-15
    number, error = reduced("mean(x)", t, x, v, level, frequency=frequency)
    exact = (np.cos(phase) - np.cos(12 * frequency + phase)) / (12 * frequency)
    assert abs(number - exact) <= error + 1e-14
    rises = (np.arcsin(level) + 2 * np.pi * turns - phase) / frequency
    rises = rises[(rises >= 0) & (rises < 12)]
    number, error = reduced("first(x > level)", t, x, v, level, frequency=frequency)
    if error == np.inf:
        return
    if x[0] > level:
        assert number <= max(error, 1e-12)
    elif len(rises):
        assert abs(number - rises.min()) <= error
    else:
        assert np.isnan(number)


@pytest.mark.parametrize(
    ("call", "exact"),
    [
        ("max(exp(-1e8*(x - 0.123)^2))", 1.0),
        ("max(exp(-1e11*(x - 0.123)^2))", 1.0),
        ("min(1 - 1/(1 + 1e9*(x - 0.4)^2))", 0.0),
        ("mean(exp(-1e10*(x - 0.123)^2))", 2 * np.sqrt(np.pi / 1e10 / (1 - 0.123**2)) / np.pi),
        ("first(abs(x - 0.5) < 1e-9)", np.arcsin(0.5 - 1e-9)),
        ("first(tanh(1e6*(x - 0.7)) > 0)", np.arcsin(0.7)),
        ("first(sqrt(1 - x) < 0.1)", np.arcsin(0.99)),
        ("max(abs(x - 0.3))", 0.7),
        ("max(min(x, 0.25))", 0.25),
        ("first(max(x, dot(x)) < 0.75)", np.arccos(0.75)),
        ("max(sign(x - 0.2)*x)", 1.0),
        ("max(log(x + 1) + asin(x/2) + atan2(x, 2) + cosh(x))", None),
        ("max(x^2.5 + 2^x + acos(x/3) + asinh(x) + atanh(x/2) + tan(x) + sinh(x))", None),
    ],
)
def test_narrow_places_are_found(call, exact):
    """Of half a turn of a sine with samples far wider than what is looked for."""
    t = np.linspace(0, np.pi, 41)
    number, error = reduced(call, t, np.sin(t), np.cos(t), 0.0, 1e-13)
    if exact is None:
        s = np.linspace(0, np.pi, 200_001)
        text = re.fullmatch(r"max\((.*)\)", call)[1].replace("^", "**").replace("atan2", "arctan2")
        text = re.sub(r"\ba(sin|cos|tan)", r"arc\1", text)
        exact = eval(text, {**vars(np), "x": np.sin(s)}).max()
        error += 1e-9
    assert abs(number - exact) <= error
    assert error < 1e-8


@pytest.mark.parametrize("sign", ["", "-"])
def test_the_top_of_a_polynomial_is_bounded_in_one_interval(sign):
    """Along x = t, from -1 to 1: ±x⁵/2 - x² is largest at 0, where it is far from a parabola."""
    t = np.linspace(-7, 7, 8)
    expression = expression_along(f"max({sign}x^5/2 - x^2)", t, t, np.ones(8), 0.0, 0.0, 0.0)
    middle = Intervals(np.array([0]), np.array([3]), np.array([-1.0]), np.array([1.0]))
    known = expression.enclosed(middle, np.array([-np.inf]))
    assert known.top <= 0 <= known.high
    assert known.high - known.top < 1e-8


@pytest.mark.parametrize(
    ("call", "proven"),
    [
        ("max(1/(x - 0.5))", np.inf),
        ("min(1/(x - 0.5))", -np.inf),
        ("max(2/(x - 0.5)^2 - 3/(x - 0.5))", np.inf),
        ("min(-1/abs(x - 0.5))", -np.inf),
        ("max(abs(tan(3*x)))", np.inf),
        ("max(-1/(x - 0.5)^2)", None),
        # A denominator that is negative throughout, beside a slope without a bound.
        ("max(1/(x - 2) - sqrt(abs(x - 0.5)))", None),
        # Zeros without a change of sign, and a change of sign without a zero.
        ("max(1/(x^2 - x + 1/4))", None),
        ("max(1/(sign(x - 0.5) + 0.5))", None),
        ("max(sin(x - 0.5)/(x - 0.5))", None),
    ],
)
def test_poles_are_proven_by_a_change_of_sign_of_a_denominator(call, proven):
    t = np.linspace(0, np.pi, 41)
    number, error = reduced(call, t, np.sin(t), np.cos(t), 0)
    assert (number, error) == (proven, np.inf) if proven else np.isfinite(number)


def test_places_without_values_are_told():
    t = np.linspace(0, np.pi, 41)
    number, error = reduced("mean(1/(x - 0.5))", t, np.sin(t), np.cos(t), 0)
    assert (np.isnan(number), error) == (True, np.inf)
    # Bounded, though no arithmetic of intervals shows it.
    number, error = reduced("max(sin(x - 0.5)/(x - 0.5))", t, np.sin(t), np.cos(t), 0)
    assert error == np.inf or abs(number - 1) <= error
    number, error = reduced("max(sqrt(x - 0.5))", t, np.sin(t), np.cos(t), 0)
    assert (np.isnan(number), error) == (True, np.inf)


def test_samples_that_meet_the_same_phase_do_not_hide_an_oscillation(oscillator):
    """Fifty-one samples, between which the motion turns round once or twice, or nearly."""
    members = {"k": ((2 * np.pi * np.array([1.0, 2.0, 0.9995]) / 0.4) ** 2).tolist()}
    calls = {"min(x)": -1, "max(x)": 1}
    run = {"samples": 51, "accuracy": 1e-6, "columns": [], "reduce": [*calls]}
    ensemble = oscillator.ensemble(members, **run)
    for call, exact in calls.items():
        assert (np.abs(ensemble.reduced[call] - exact) <= ensemble.reduced_error[call]).all()


def test_a_pulse_between_samples_that_leaves_no_trace_is_seen():
    """A velocity that rises to h/b and falls again within b, of a coordinate that comes back."""
    force = "2*h/b^2*(2*((t - 3)/b)^2 - 1)*exp(-((t - 3)/b)^2)"
    text = OSCILLATOR.replace("A: 1", "b: 1e-3, h: 1e-2")
    text += f"forces: {{kick: {{on: x, force: {force}}}}}\n"
    calls = ["max(dot(x))", "first(dot(x) > 2)"]
    run = {"samples": 51, "accuracy": 1e-4, "columns": [], "reduce": calls}
    ensemble = loads(text).derive().ensemble({"m": [1.0]}, **run)
    s = np.linspace(-3, 3, 100_001)
    speed = -np.sin(3 + 1e-3 * s) - 1e-2 / 1e-3 * 2 * s * np.exp(-(s**2))
    for call, exact in zip(calls, [speed.max(), 3 + 1e-3 * s[np.argmax(speed > 2)]], strict=True):
        (number,), (error,) = ensemble.reduced[call], ensemble.reduced_error[call]
        assert abs(number - exact) <= error + 1e-6
        assert error < 1e-2


def test_a_touch_is_open():
    t = np.linspace(0, np.pi, 41)
    number, error = reduced("first(x > 1)", t, np.sin(t), np.cos(t), 0, 1e-9)
    assert (np.isnan(number), error) == (True, np.inf)
    number, error = reduced("first(x > 1 - 1e-6)", t, np.sin(t), np.cos(t), 0, 1e-9)
    assert abs(number - np.arcsin(1 - 1e-6)) <= error < 1e-5
    assert reduced("first(x > 2)", t, np.sin(t), np.cos(t), 0)[1] == 0
