"""Every method goes on from a state that was written, bit by bit as if it had not stopped."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lagrange_cli.simulate.checkpoint.checkpoint import DamagedError, deserialize, serialize
from lagrange_cli.simulate.integrators import INTEGRATORS, Control, start_integrator
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED
from lagrange_cli.simulate.integrators.native.methods import COMPILED
from lagrange_cli.simulate.integrators.right_hand_side import FunctionRhs, InputPieces, PiecewiseRhs
from tests.simulate.available import BY_VALUES
from tests.simulate.constrained_systems import constrained
from tests.simulate.native_systems import native
from tests.simulate.switched_systems import ball

TIMES = np.linspace(0.0, 6.0, 151)
#: For methods in Python, with steps of a hundredth.
SHORT_TIMES = np.linspace(0.0, 1.5, 51)
METHODS = [method for method in BY_VALUES if method.resumes]


def pendulum(t, y):
    return np.array([y[1], -math.sin(y[0])])


def circle(t, y):
    """A point on a circle, in Cartesian coordinates."""
    q, v = y[:2], y[2:]
    gravity = np.array([0.0, -1.0])
    push = -(v @ v + gravity @ q) / (q @ q)
    return np.concatenate([v, gravity + push * q])


def onto_circle(t, y):
    q = y[:2] / np.hypot(*y[:2])
    return np.concatenate([q, y[2:] - (q @ y[2:]) * q])


def pushed():
    """A pendulum with a force that is another number in each piece of time."""
    pieces = InputPieces(np.array([0.0, 0.2, 0.5, 0.9, 1.1]), np.arange(5.0)[:, None])
    return PiecewiseRhs(pieces, lambda row: lambda t, y: pendulum(t, y) + np.array([0, row[0]]))


#: Right-hand sides with starts.
PROBLEMS = {
    "smooth": (lambda: pendulum, [2.0, 0.5]),
    "constrained": (lambda: FunctionRhs(circle, onto_circle), [1.0, 0.0, 0.0, 0.3]),
    "pieces": (pushed, [2.0, 0.5]),
}


def control(n):
    return Control(np.full(n, 1e-7), np.full(n, 1e-7), 1e-4, 0.5, 0.01)


def begun(method, name):
    rhs, y0 = PROBLEMS[name]
    return start_integrator(method, rhs(), 0.0, np.array(y0), SHORT_TIMES[-1], control(len(y0)))


def goes_on(begin, width, first, times=TIMES):
    """Compare a run with one that goes on after ``first`` steps; both take the samples."""
    states, count = np.full((len(times), width), np.nan), 0
    run = begin()
    found = run.advance(times, states, most_steps=first, most_evaluations=math.inf)
    count = found.filled
    written = serialize(run.state())
    rest = np.full((len(times) - count, width), np.nan)
    again = begin()
    again.restore(deserialize(written))
    limits = {"most_steps": 10**9, "most_evaluations": math.inf}
    one = run.advance(times[count:], states[count:], **limits)
    other = again.advance(times[count:], rest, **limits)
    assert one == other
    assert one.filled == len(rest) or one.failure
    assert np.array_equal(states[count:], rest, equal_nan=True)
    assert (run.t, run.steps, run.evaluations) == (again.t, again.steps, again.evaluations)
    assert np.array_equal(run.y, again.y)
    return run, again


@pytest.mark.slow
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.parametrize("method", METHODS, ids=lambda m: m.name)
def test_a_method_goes_on(method, name):
    if name == "constrained" and (not method.projects or method.needs):
        pytest.skip("this method does not project on values alone")
    for first in (0, 1, 7, 40):
        goes_on(lambda: begun(method, name), len(PROBLEMS[name][1]), first, SHORT_TIMES)


@pytest.mark.parametrize("method", COMPILED)
def test_a_compiled_method_goes_on(method):
    rhs, y0 = native("pendulum"), np.array([2.0, 0.5])
    for first in (0, 1, 7, 40):
        goes_on(
            lambda: start_integrator(INTEGRATORS[method], rhs, 0.0, y0, TIMES[-1], control(2)),
            2,
            first,
        )


@pytest.mark.slow
@pytest.mark.parametrize("method", [n for n, m in COMPILED.items() if m.projects and not m.needs])
@pytest.mark.parametrize("real", [DOUBLE, EXTENDED], ids=["double", "extended"])
def test_a_compiled_method_goes_on_with_constraints(method, real):
    if method == "Gauss16" and real is EXTENDED:
        pytest.skip("eight states at once are doubles")
    rhs, y0 = constrained("pendulum", 1.0, 9.81, real=real), np.array([1.0, 0.0, 0.0, 0.0])
    for first in (0, 7, 40):
        goes_on(
            lambda: start_integrator(INTEGRATORS[method], rhs, 0.0, y0, TIMES[-1], control(4)),
            4,
            first,
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", [m.name for m in METHODS if m.interpolates and m.projects])
def test_motion_with_contacts_goes_on(name):
    y0 = np.array([0.0, 2.0, 1.0, 0.0])

    def begin():
        return start_integrator(INTEGRATORS[name], ball(0.5), 0.0, y0, TIMES[-1], control(4))

    for first in (0, 30, 90):
        run, again = goes_on(begin, 4, first)
        assert [(s.t, s.kind, s.contact, s.flags) for s in run.switches] == [
            (s.t, s.kind, s.contact, s.flags) for s in again.switches
        ]
        pairs = list(zip(run.switches, again.switches, strict=True))
        assert pairs
        assert all(np.array_equal(a.before, b.before) for a, b in pairs)


def test_values_are_read_back_as_they_were():
    array = np.arange(3.0)
    value = {
        "same": (array, array, array.copy()),
        "empty": np.empty((0, 2)),
        "numbers": (1, 0.1, math.inf, None, True, "text"),
        "wide": np.array([np.longdouble(1) / 3]),
        "scalars": (np.float64(0.1), np.int64(7)),
    }
    found = deserialize(serialize(value))
    assert found["same"][0] is found["same"][1]
    assert found["same"][2] is not found["same"][0]
    assert all(np.array_equal(part, array) for part in found["same"])
    assert found["empty"].shape == (0, 2)
    assert found["numbers"] == value["numbers"]
    assert found["wide"] == value["wide"]
    assert [type(x) for x in found["scalars"]] == [np.float64, np.int64]


@pytest.mark.parametrize("at", [0, 40, 200, 300, -30, -1])
def test_damaged_bytes_are_noticed_or_mean_the_same(at):
    value = {"t": 1.0, "y": np.arange(40.0)}
    data = bytearray(serialize(value))
    data[at] ^= 0x55
    try:
        found = deserialize(bytes(data))
    except DamagedError:
        return
    # Some bytes of an archive, as its date, mean nothing here.
    assert found["t"] == 1.0
    assert np.array_equal(found["y"], value["y"])


@pytest.mark.parametrize("data", [b"", b"PK", b"text", serialize({})[:-20]])
def test_other_bytes_are_refused(data):
    with pytest.raises(DamagedError):
        deserialize(data)
