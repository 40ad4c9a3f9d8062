"""Emitted Python with closures: the same numbers as the C, and the same refusals."""

from __future__ import annotations

import sys
import types

import mpmath
import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.template_files import python_template
from lagrange_cli.simulate.native.rounding_model import perturb
from lagrange_cli.simulate.system.constraints import projection
from tests.emit import emit_closures as closures
from tests.emit.closed_code import (
    CASES,
    Closed,
    Multipliers,
    massless,
    random_states,
    simulation_programs,
)
from tests.emit.emit_reference import difference
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


def test_rhs_and_multipliers_share_the_function_that_solves():
    (text,) = EMITTERS["python"].emit(closures.pendulum(), {}).values()
    assert text.count("_solution(t, y, p)") == 3  # its head, and a call in each of the others
    system, _, _ = text.partition("def mass_matrix")
    assert system.count("= solve(matrix, vector)") == 1
    assert "solve(" not in text.partition("def multipliers")[2].partition("def ")[0]


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
    with np.errstate(all="ignore"):
        for y in (np.zeros(4), np.full(4, np.nan), np.full(4, 1e200)):
            assert np.isnan(module.rhs(0.0, y)[2:]).all()
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


def solver():
    namespace = {"np": np}
    exec(python_template("solve"), namespace)  # a constant of the program
    return namespace["solve"]


@pytest.mark.parametrize("depth", [0, 2, 4, 6, 8])
def test_solutions_where_an_inertia_vanishes(depth):
    """M u = 0 with the gradient u near the direction of a coordinate, as quaternions have it."""
    numbers, n = np.random.default_rng(depth), 4
    u = numbers.standard_normal(n) * 10.0**-depth
    u[2] = 1.0
    matrix, right = np.zeros((n + 1, n + 1)), numbers.standard_normal(n + 1)
    for k in range(n):
        for j in range(k):
            turn = np.zeros(n)
            turn[k], turn[j] = u[j], -u[k]
            matrix[:n, :n] += numbers.uniform(0.5, 2) * np.outer(turn, turn)
    matrix[n, :n] = u
    found = solver()(np.triu(matrix[:, :]) + np.tril(matrix, -1), right)
    whole = matrix + np.triu(matrix[n:].T @ np.eye(1, n + 1, n), 1)
    with mpmath.workdps(60):
        exact = mpmath.lu_solve(mpmath.matrix(whole.tolist()), mpmath.matrix(right.tolist()))
        off = [abs(x - y) for x, y in zip(found.tolist(), exact, strict=True)]
        assert max(off) < 1e-11 * mpmath.norm(exact, mpmath.inf)


@pytest.mark.parametrize("ratio", [1e-30, 1e-12, 1e12, 1e30])
def test_masses_of_any_ratio(ratio):
    equations = closures.chain(2)
    module, reference = emitted(equations), Multipliers(equations)
    p = np.array(module.DEFAULTS)
    p[1] = p[0] * ratio
    for angles in ([0.3, 1.2], [2.0, -1.0]):
        y = closures.chain_state(2, np.array(angles), np.array([1.0, -2.0]), p[2:4])
        rhs, multipliers, _ = reference.solve(0.0, y, p)
        assert difference(module.rhs(0.0, y, p), rhs) < 1e-13
        assert difference(module.multipliers(0.0, y, p), multipliers) < 1e-13


def test_a_singular_configuration_is_nan():
    """Two rods from fixed points that pull along one line: no multipliers."""
    equations = closures.pendulum()
    x, z = equations.system.coordinates
    other = closures.closure("other", (x.q - 4) ** 2 + z.q**2 - 4, [x, z])
    module = emitted(changed(equations, closures=(*equations.system.closures, other)))
    several = np.array([[2.0, 0.0, 0.0, 0.0], [2.0, 0.01, 0.0, 0.0]]).T
    assert np.isnan(module.rhs(0.0, several)[2:, 0]).all()
    assert np.isfinite(module.rhs(0.0, several)[:, 1]).all()
