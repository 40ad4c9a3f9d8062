"""Emitted functions of many states at once against those of one state."""

from __future__ import annotations

import inspect
import math
import re
import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp

from lagrange_cli.api.emitters import EMITTERS
from tests.emit import emit_systems as systems
from tests.emit.test_python import load
from tests.program import test_bandwidth as bands
from tests.program import test_large_systems as large
from tests.program.test_contact_families import chain_over_floors
from tests.program.test_program import one_coordinate, x
from tests.systems.shipped import NARROW, SCENES, derived, sliced

#: Every kind of system once: written out and by loops, free and with closures, inputs, a recording,
#: outputs, contacts.
FEW = [
    "double_pendulum",
    "pendulum_chain",
    "net_of_springs",
    "hanging_net",
    "four_bar_linkage",
    "chaplygin_sleigh",
    "ball_on_turntable",
    "seismometer",
    "pendulum_with_force",
    "dropped_rod",
    "slack_rope",
]

#: Results of a function of several states at once are off by no more than this, relative to the
#: largest number of all.
CLOSE = 1e-9

STATES = 40


def module(equations, **options):
    ((_, source),) = EMITTERS["python"].emit(equations, options).items()
    return load(source)


def states(functions, seed=0):
    """States near the initial one, times, and values of the parameters: one for each of them, but
    every other parameter alike for all.
    """
    random = np.random.default_rng(seed)
    n = 2 * len(functions["COORDINATES"])
    start = functions["INITIAL"] or [0.3] * n
    y = np.array(start)[:, None] + 0.03 * random.standard_normal((n, STATES))
    t = functions["START"] + random.uniform(0, 0.5, STATES)
    values = [1.0 if math.isnan(value) else value for value in functions["DEFAULTS"]]
    for k in range(0, len(values), 2):
        values[k] *= random.uniform(0.99, 1.01, STATES)
    return t, y, functions["Parameters"](*values)


def example(number, monkeypatch, style):
    """Run one of the examples of the documentation that import the double pendulum."""
    page = (Path(__file__).parents[2] / "docs" / "emitted-code.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    code = [block for block in blocks if "import double_pendulum" in block][number]
    imported = ModuleType("double_pendulum")
    vars(imported).update(module(derived("double_pendulum"), style=style))
    monkeypatch.setitem(sys.modules, "double_pendulum", imported)
    names: dict[str, object] = {}
    exec(compile(code, "<documentation>", "exec"), names)
    return names


def at(k, values):
    return type(values)(*(float(np.broadcast_to(value, STATES)[k]) for value in values))


def column_by_column(function, t, y, p, **more):
    columns = [function(t[k], y[:, k], at(k, p), **more) for k in range(STATES)]
    return np.stack([np.asarray(column) for column in columns], axis=-1)


def modes(functions, function):
    """Nothing, or contacts all open and all closed."""
    if "mode" not in inspect.signature(function).parameters:
        return [{}]
    return [{"mode": (closed,) * len(functions["CONTACTS"])} for closed in (0, 1)]


def compared(functions, names):
    """Compare functions, and return those that were."""
    t, y, p = states(functions)
    singly = []
    one = functions["_at"]
    functions["_at"] = lambda k, *given: singly.append(k) or one(k, *given)
    found = []
    for name in names:
        function = functions.get(name)
        if function is None:
            continue
        found.append(name)
        for more in modes(functions, function):
            expected = column_by_column(function, t, y, p, **more)
            singly.clear()
            got = function(t, y, p, **more)
            assert got.shape == expected.shape
            assert set(singly) == ({*range(STATES)} if name == "project" else {...})
            assert np.array_equal(np.isnan(got), np.isnan(expected))
            off = np.abs(got - expected)
            assert np.nanmax(off, initial=0) <= CLOSE * np.nanmax(np.abs(expected), initial=1e-3)
    return found


FUNCTIONS = ["rhs", "mass_matrix", "forcing", "energy", "positions", "velocities", "inputs"]
FUNCTIONS += ["outputs", "multipliers", "constraints", "project"]
DERIVATIVES = ["jacobian", "jacobian_u", "jacobian_p"]


def of_scene(name):
    functions = module(derived(name), jacobian=True)
    found = compared(functions, [*FUNCTIONS, *DERIVATIVES])
    assert {*FUNCTIONS[:6], "jacobian"} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize("name", FEW)
def test_many_states_at_once(name):
    of_scene(name)


@pytest.mark.slow
@sliced((name for name in SCENES if name not in FEW), NARROW)
def test_many_states_of_every_scene(name):
    of_scene(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "make",
    [
        lambda: large.chain(20),
        lambda: large.CASES["net"](),
        lambda: chain_over_floors(8),
        lambda: systems.pendulum_chain(7),
        systems.indefinite,
    ],
    ids=["chain", "net", "floors", "dense", "indefinite"],
)
def test_loops_and_dense_blocks(make):
    assert "rhs" in compared(module(make()), FUNCTIONS)


@pytest.mark.slow
def test_a_band_without_loops(monkeypatch):
    monkeypatch.setattr(bands.programs_of, "is_large_system", lambda _: False)
    assert "multipliers" in compared(module(bands.chain(20)), FUNCTIONS[:-1])


def test_events_of_many_states():
    functions = module(derived("dropped_rod"))
    t, y, p = states(functions)
    for mode in ((0, 0), (1, 0), (1, 1)):
        got = functions["events"](t, y, p, mode=mode)
        expected = column_by_column(functions["events"], t, y, p, mode=mode)
        assert np.abs(got - expected).max() < CLOSE * np.abs(expected).max()
    with pytest.raises(ValueError, match=r"reset takes one state, y of shape \(6,\)"):
        functions["reset"](0.0, y, p)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["masses_through_hole", "four_bar_linkage", "hanging_net"])
def test_a_state_without_result_leaves_the_others_alone(name):
    """States are not finite, or singular: all of a system in one place."""
    functions = module(derived(name))
    t, y, p = states(functions)
    expected = functions["rhs"](t, y, p)
    assert np.isfinite(expected).all()
    y[0, 3], y[-1, 17] = math.nan, math.inf
    y[:, [20, 31]] = 0.0
    got = functions["rhs"](t, y, p)
    wrong = [3, 17, 20, 31]
    assert not np.isfinite(got[:, wrong]).all(axis=0).any()
    assert np.array_equal(
        got[:, wrong], column_by_column(functions["rhs"], t, y, p)[:, wrong], equal_nan=True
    )
    assert np.abs(np.delete(got - expected, wrong, axis=1)).max() < CLOSE * np.abs(expected).max()


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        (sp.log(x), 0.0), (sp.sqrt(x), -1.0), (1 / x, 0.0), (sp.exp(-1 / x), 0.0),
        (sp.acos(x), 2.0),
        (sp.exp(sp.exp(x)), 50.0), (1 / sp.cosh(x), 1e3), (x**sp.Rational(1, 3), -1.0),
    ],
)  # fmt: skip
def test_a_domain_error_is_that_of_a_single_state(expression, value):
    """Also where NumPy would go on with what is infinite, to a finite result."""
    functions = module(one_coordinate(expression))
    y = np.array([np.linspace(0.1, 0.9, 50), np.zeros(50)])
    y[0, 7] = value
    (got,) = functions["positions"](0.0, y)
    assert np.flatnonzero(np.isnan(got)).tolist() == [7]
    expected = [functions["positions"](0.0, column)[0] for column in y.T]
    assert np.allclose(got, expected, rtol=1e-14, atol=0, equal_nan=True)


def test_constant_results_have_a_column_for_each_state():
    functions = module(systems.charged_particle())
    matrix = functions["mass_matrix"](0.0, np.ones((6, 5)))
    assert matrix.shape == (3, 3, 5)
    assert (matrix == functions["mass_matrix"](0.0, np.ones(6))[..., None]).all()


@pytest.mark.parametrize("count", [0, 1, 16, 17])
def test_any_number_of_states(count):
    functions = module(systems.masses_through_hole())
    y = np.array(functions["INITIAL"])[:, None] + np.linspace(0, 0.1, count)
    assert functions["rhs"](0.0, y).shape == (4, count)
    assert functions["energy"](0.0, y).shape == (count,)
    for k in range(count):
        assert np.allclose(functions["rhs"](0.0, y)[:, k], functions["rhs"](0.0, y[:, k]), 1e-14)


def test_shapes_that_do_not_fit_are_refused():
    functions = module(systems.masses_through_hole())
    rhs, p = functions["rhs"], functions["DEFAULTS"]
    with pytest.raises(ValueError, match=r"y has the shape \(3, 5\), not \(4,\) or \(4, m\)"):
        rhs(0.0, np.ones((3, 5)))
    with pytest.raises(ValueError, match=r"y has the shape \(4, 5, 2\)"):
        rhs(0.0, np.ones((4, 5, 2)))
    with pytest.raises(ValueError, match=r"t has the shape \(4,\), not \(\) or \(5,\)"):
        rhs(np.zeros(4), np.ones((4, 5)))
    several = p._replace(**{p._fields[0]: np.ones(3)})
    with pytest.raises(ValueError, match=rf"{functions['PARAMETERS'][0]} has the shape \(3,\)"):
        rhs(0.0, np.ones((4, 5)), several)
    with pytest.raises(ValueError, match="t and the parameters are numbers where y is one state"):
        rhs(0.0, np.ones(4), several)


def test_inputs_of_the_caller():
    """Functions of arrays, and those that only numbers can be given to."""
    functions = module(derived("seismometer"))
    t, y, p = states(functions)
    singly = []

    def of_numbers(t, y, p):
        singly.append(t)
        return [math.sin(t) * math.tanh(y[0])]

    expected = column_by_column(functions["rhs"], t, y, p, u=of_numbers)
    vectorized = functions["rhs"](t, y, p, u=lambda t, y, p: [np.sin(t) * np.tanh(y[0])])
    assert np.abs(vectorized - expected).max() < CLOSE * np.abs(expected).max()
    singly.clear()
    assert np.array_equal(functions["rhs"](t, y, p, u=of_numbers), expected)
    assert len(singly) > STATES


@pytest.mark.slow
def test_with_vectorized_scipy():
    functions = module(derived("double_pendulum"))
    rhs, start, p = functions["rhs"], np.array(functions["INITIAL"]), functions["DEFAULTS"]
    precise = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
    exact = solve_ivp(rhs, (0, 1), start, args=(p,), **precise).y[:, -1]
    for method in ("Radau", "DOP853"):
        tolerances = {"rtol": 1e-8, "atol": 1e-10}
        run = solve_ivp(rhs, (0, 1), start, method, args=(p,), vectorized=True, **tolerances)
        assert np.abs(run.y[:, -1] - exact).max() < 1e-6
    # Many motions as one, each with its own parameters.
    shape = (4, 30)
    several = p._replace(l1=np.linspace(1, 1.5, 30))
    run = solve_ivp(
        lambda t, y: rhs(t, y.reshape(shape), several).ravel(),
        (0, 1),
        np.tile(start[:, None], 30).ravel(),
        **precise,
    )
    assert np.abs(run.y[:, -1].reshape(shape)[:, 0] - exact).max() < 1e-8


def test_the_example_of_the_documentation(monkeypatch):
    shown = example(0, monkeypatch, "numpy")
    double = module(derived("double_pendulum"))
    last = double["energy"](0.0, double["INITIAL"], double["DEFAULTS"]._replace(l1=1.5))
    assert shown["energies"].shape == (1000,)
    assert math.isclose(shown["energies"][-1], last, rel_tol=1e-14)
    assert shown["run"].success
