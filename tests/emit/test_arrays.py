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
    start = np.full(n, 0.3) if functions["INITIAL"] is None else functions["INITIAL"]
    y = start[:, None] + 0.03 * random.standard_normal((n, STATES))
    t = random.uniform(0, 0.5, STATES)
    values = [1.0 if math.isnan(value) else value for value in functions["DEFAULTS"]]
    for k in range(0, len(values), 2):
        values[k] *= random.uniform(0.99, 1.01, STATES)
    return t, y, functions["Parameters"](*values)


def example(style, monkeypatch):
    """Run the example of the documentation that imports the double pendulum in a style."""
    page = (Path(__file__).parents[2] / "docs" / "emitted-code.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    told = "" if style == "numpy" else f"  # --style {style}"
    (code,) = [b for b in blocks if re.search(f"double_pendulum[^#\n]*{told}\n", b)]
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
    found = []
    for name in names:
        function = functions.get(name)
        if function is None:
            continue
        found.append(name)
        for more in modes(functions, function):
            with np.errstate(all="ignore"):
                expected = column_by_column(function, t, y, p, **more)
                got = function(t, y, p, **more)
            assert got.shape == expected.shape
            assert np.array_equal(np.isfinite(got), np.isfinite(expected))
            finite = np.isfinite(got)
            off = np.abs(got - expected)[finite]
            assert np.max(off, initial=0) <= CLOSE * np.max(np.abs(expected[finite]), initial=1e-3)
    return found


FUNCTIONS = ["rhs", "mass_matrix", "forcing", "energy", "positions", "velocities", "inputs"]
FUNCTIONS += ["outputs", "multipliers", "constraints"]
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
    assert "multipliers" in compared(module(bands.chain(20)), FUNCTIONS)


def test_events_of_many_states():
    functions = module(derived("dropped_rod"))
    t, y, p = states(functions)
    for mode in ((0, 0), (1, 0), (1, 1)):
        got = functions["events"](t, y, p, mode=mode)
        expected = column_by_column(functions["events"], t, y, p, mode=mode)
        assert np.abs(got - expected).max() < CLOSE * np.abs(expected).max()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
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
    assert np.abs(np.delete(got - expected, wrong, axis=1)).max() < CLOSE * np.abs(expected).max()


def test_a_domain_error_changes_no_other_state():
    functions = module(one_coordinate(sp.log(x) / x))
    y = np.array([np.linspace(0.1, 0.9, 50), np.zeros(50)])
    y[0, 7], y[0, 9] = 0.0, -1.0
    with np.errstate(all="ignore"):
        (got,) = functions["positions"](0.0, y)
    assert np.flatnonzero(~np.isfinite(got)).tolist() == [7, 9]


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
    several = p._replace(**{p._fields[0]: np.ones(3)})
    for y, parameters in ((np.ones((3, 5)), p), (np.ones((4, 5)), several), (np.ones(4), several)):
        with pytest.raises(ValueError, match=r"shape|unpack|sequence|broadcast"):
            rhs(0.0, y, parameters)


def test_inputs_of_the_caller():
    functions = module(derived("seismometer"))
    t, y, p = states(functions)

    def force(t, y, p):
        return [np.sin(t) * np.tanh(y[0])]

    expected = column_by_column(functions["rhs"], t, y, p, u=force)
    got = functions["rhs"](t, y, p, u=force)
    assert np.abs(got - expected).max() < CLOSE * np.abs(expected).max()


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
    shown = example("numpy", monkeypatch)
    double = module(derived("double_pendulum"))
    last = double["energy"](0.0, double["INITIAL"], double["DEFAULTS"]._replace(l1=1.5))
    assert shown["energies"].shape == (1000,)
    assert math.isclose(shown["energies"][-1], last, rel_tol=1e-14)
    assert shown["run"].success
