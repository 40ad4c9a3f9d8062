"""Emitted Python with closures: the same numbers as the C, and the same refusals."""

from __future__ import annotations

import sys
import types
import warnings

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.simulate.native.rounding_model import perturb
from lagrange_cli.simulate.system.constraints import projection
from tests.emit import emit_closures as closures
from tests.emit.closed_code import (
    CASES,
    Closed,
    massless,
    random_states,
    simulation_programs,
)
from tests.emit.emitted_c import run
from tests.parts import changed
from tests.program.interpreted import interpreted

pytestmark = pytest.mark.slow


def loaded(text, name="module"):
    """The functions of a Python module by its text."""
    module = types.ModuleType(name)
    exec(compile(text, name, "exec"), module.__dict__)
    return module


def emitted(equations):
    (text,) = EMITTERS["python"].emit(equations).values()
    return loaded(text)


PYTHON_CASES = {**CASES, "massless": massless}


@pytest.mark.compiler
@pytest.mark.parametrize("name", list(PYTHON_CASES))
def test_python_agrees_with_c(name, tmp_path):
    equations = PYTHON_CASES[name]()
    compiled, module = Closed(equations, tmp_path), emitted(equations)
    assert tuple(equations.system.multipliers) == module.MULTIPLIERS
    sizes = {
        "rhs": 2 * len(equations.system.coordinates),
        "multipliers": len(equations.system.closures),
    }
    sizes["constraints"] = compiled.macro("CONSTRAINTS")
    for t, y, p in random_states(equations):
        for function, size in sizes.items():
            status, expected = compiled(function, t, y, p, size)
            assert status == 0
            found = getattr(module, function)(t, y, p)
            assert found.shape == (size,)
            assert np.abs(found - expected).max() <= 1e-11 * np.abs(expected).max()
        before = y.copy()
        status, expected = compiled.project(t, y, p)
        found = module.project(t, y, p)
        assert (y == before).all()
        assert np.isfinite(found).all() == (status == 0)
        if status == 0:
            constraints = module.constraints(t, found, p)
            assert np.abs(constraints).max() < 1e-9
            if np.abs(expected - y).max() < 3:  # else Newton's method may end elsewhere
                assert found == pytest.approx(expected, rel=1e-9, abs=1e-9)


def test_python_refuses_what_c_refuses():
    module = emitted(closures.pendulum())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for y in (np.zeros(4), np.full(4, np.nan), np.full(4, 1e200)):
            assert np.isnan(module.rhs(0.0, y)).all()
            assert np.isnan(module.multipliers(0.0, y)).all()
            assert np.isnan(module.project(0.0, y)).all()
    x, z = closures.pendulum().system.coordinates
    nowhere = closures.closure("rod", x.q**2 + z.q**2 + 1, [x, z])
    module = emitted(changed(closures.pendulum(), closures=(nowhere,)))
    assert np.isnan(module.project(0.0, [1.0, 0.3, 0.0, 0.0])).all()


def test_python_script_stays_on_the_closures(tmp_path):
    path = tmp_path / "pendulum.py"
    (text,) = EMITTERS["python"].emit(closures.pendulum()).values()
    path.write_text(text)
    rows = run(sys.executable, path, "dot(z)=-7", "until=0.5", "steps=1").splitlines()
    _, x, z, u, w = np.array([list(map(float, row.split(","))) for row in rows[1:]]).T
    assert len(x) == 501
    assert np.abs(x**2 + z**2 - 4).max() < 1e-14
    assert np.abs(x * u + z * w).max() < 1e-13


def test_python_for_the_simulation():
    equations = closures.chain(2, name="secret")
    programs = simulation_programs(equations)
    programs["disturbed"] = perturb(programs["rhs"])
    factors = programs["disturbed"].parameters - len(equations.system.parameters)
    assert factors > 4
    functions = interpreted(programs)
    own = emitted(equations)
    p = list(own.DEFAULTS)
    y = closures.chain_state(2, np.array([0.3, 1.0]), np.array([1.0, 2.0]), np.array(p[2:4])) + 1e-4
    for function in ("rhs", "multipliers", "constraints"):
        expected = getattr(own, function)(0.0, y)
        assert functions[function](0.0, y, p) == pytest.approx(expected, rel=1e-14, abs=1e-14)
    assert projection(functions, p)(0.0, y) == pytest.approx(own.project(0.0, y), rel=1e-15)
    exact = functions["disturbed"](0.0, y, [*p, *[1.0] * factors])
    assert (exact == functions["rhs"](0.0, y, p)).all()
    generator = np.random.default_rng(1)
    off = functions["disturbed"](0.0, y, [*p, *(1 + generator.uniform(-1, 1, factors) * 1e-10)])
    change = np.abs(off - exact)[4:].max() / np.abs(exact).max()
    assert 1e-12 < change < 1e-8
