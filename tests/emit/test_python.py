"""Emitted Python: the module, and the evaluators that simulation runs."""

from __future__ import annotations

import ast
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import solve_ivp
from sympy.core.function import AppliedUndef

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import Reference, difference, exact, states
from tests.emit.emitted_c import WARNINGS, compiler, run, write
from tests.emit.test_c import HOSTILE, ROWS, hostile
from tests.parts import changed
from tests.program.test_program import one_coordinate, x
from tests.systems.shipped import NARROW, SCENES, derived, sliced


def load(source):
    """The names that a module's source defines."""
    namespace = {"__name__": "emitted"}
    exec(compile(source, "<emitted>", "exec"), namespace)
    return namespace


def module(equations):
    ((_, source),) = EMITTERS["python"].emit(equations).items()
    return load(source)


@pytest.mark.slow
@pytest.mark.parametrize("make", systems.ALL)
def test_the_source_agrees_with_the_equations(make):
    equations = make()
    n = len(equations.system.coordinates)
    reference = Reference(equations)
    for source in EMITTERS["python"].emit(equations).values():
        functions = load(source)
        for t, y, p in states(equations):
            p = tuple(p)
            bound = 1e-13 * max(10, reference.condition(t, y, p))
            assert difference(functions["rhs"](t, y, p), reference.rhs(t, y, p)) < bound
            matrix = functions["mass_matrix"](t, y, p)
            assert matrix.shape == (n, n)
            assert difference(matrix.ravel(), reference.mass_matrix(t, y, p)) < 1e-13
            for name in ("forcing", "positions", "velocities"):
                expected = getattr(reference, name)(t, y, p)
                assert difference(functions[name](t, y, p), expected) < 1e-12
            energies = reference.energy(t, y, p)
            error = abs(functions["energy"](t, y, p) - float(energies[2]))
            assert error < 1e-13 * (1 + float(max(map(abs, energies))))


@pytest.mark.parametrize("row", list(ROWS))
def test_every_function_of_the_language(row):
    equations = one_coordinate(ROWS[row])
    functions, reference = module(equations), Reference(equations)
    for at in (-2.0, -0.5, 0.3, 1.0, 2.5):
        (got,) = functions["positions"](0.0, np.array([at, 0.0]))
        (expected,) = reference.positions(0.0, [at, 0.0], [1.0, 1.0, 1.0])
        assert abs(exact(got) - expected) < 1e-14 * (1 + abs(expected))


@pytest.mark.slow
def test_hostile_names_and_texts(tmp_path):
    ((name, source),) = EMITTERS["python"].emit(hostile()).items()
    tree = ast.parse(source)
    imported = {a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    imported |= {n.module for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert imported == {"numpy", "sys", "typing"}
    assert HOSTILE.split()[0] not in source
    functions = load(source)
    assert list(functions["DEFAULTS"]) == [p.value for p in hostile().system.parameters]
    reference = Reference(hostile())
    state = np.linspace(-1, 1, 14)
    got = functions["rhs"](0.0, state)
    assert difference(got, reference.rhs(0.0, state, functions["DEFAULTS"])) < 1e-13
    path = tmp_path / name
    path.write_text(source)
    done = subprocess.run(
        [sys.executable, path, "until=0.01", "steps=1", "lambda=3"],
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == 502


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_trouble_is_not_finite_and_never_raised():
    """As NumPy has it: infinite beyond the largest number, NaN outside of a domain."""
    functions = module(systems.simplified(systems.masses_through_hole()))
    for state in ([0.0, 0.0, 0.0, 3.0], [1.0, 0.0, math.nan, 0.0], [math.inf, 0.0, 0.0, 1.0]):
        assert not np.isfinite(functions["rhs"](0.0, np.array(state))).all()
    for expression, at in [
        (sp.log(x), 0.0), (sp.sqrt(x), -1.0), (1 / x, 0.0), (sp.exp(1000 * x), 1.0),
        (sp.sin(x), math.inf), ((x - 2) ** sp.Rational(1, 3), 1.0), (sp.cosh(x), 1e3),
        (sp.atanh(x), 1.0), (x**sp.pi, 1e300), (sp.acos(x), 2.0), (x, math.nan),
    ]:  # fmt: skip
        functions = module(one_coordinate(expression))
        assert not np.isfinite(functions["positions"](0.0, np.array([at, 0.0]))).any(), expression
    functions = module(systems.bead_on_parabola())
    assert math.isnan(functions["energy"](0.0, np.array([math.nan, 0.0])))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("n", [2, 6])
def test_a_singular_mass_matrix_gives_nan(n):
    equations = systems.pendulum_chain(n)
    functions = module(equations)
    values = [0.0 if p.name in ("m2", "m6") else p.value for p in equations.system.parameters]
    state = np.r_[np.linspace(0.1, 0.9, n), np.zeros(n)]
    dydt = functions["rhs"](0.0, state, functions["Parameters"](*values))
    assert np.array_equal(dydt[:n], state[n:])
    assert np.isnan(dydt[n:]).all()


def test_minimum_and_maximum_pass_nan_on():
    functions = module(one_coordinate(sp.Min(x, 1), sp.Max(x, 1), sp.sign(x)))
    assert np.isnan(functions["positions"](0.0, np.array([math.nan, 0.0]))).all()


def test_states_of_integers():
    """Results are floats, so that nothing is cut off."""
    functions = module(systems.bead_on_parabola())
    whole, exact = (functions["rhs"](0.0, np.array(y)) for y in ([1, 2], [1.0, 2.0]))
    assert np.array_equal(whole, exact)


def test_with_scipy():
    functions = module(systems.masses_through_hole())
    start = functions["INITIAL"]
    run = solve_ivp(
        functions["rhs"], (0, 2), start, args=(functions["DEFAULTS"],), rtol=1e-10, atol=1e-12
    )
    assert run.success
    end = run.y[:, -1]
    assert end[0] ** 2 * end[3] == pytest.approx(3.0, abs=1e-8)
    before, after = functions["energy"](0.0, start), functions["energy"](2.0, end)
    assert after == pytest.approx(before, abs=1e-8)
    by_steps = functions["integrate"](np.array(start), 0.0, 2.0, 4000)
    assert by_steps == pytest.approx(end, abs=1e-8)


def script(equations, tmp_path, *arguments):
    ((name, source),) = EMITTERS["python"].emit(equations).items()
    path = tmp_path / name
    path.write_text(source)
    done = subprocess.run(
        [sys.executable, "-W", "error", path, *arguments],
        capture_output=True,
        text=True,
        timeout=60,
    )
    return done.returncode, done.stdout, done.stderr.strip()


@pytest.mark.slow
def test_as_a_script(tmp_path):
    status, out, _ = script(systems.bead_on_parabola(), tmp_path, "until=1", "x=0.5", "g=0")
    assert status == 0
    lines = out.splitlines()
    assert lines[0] == "t,x,dot(x)"
    assert lines[1] == "0.0,0.5,0.0"
    assert lines[-1] == "1.0,0.5,0.0"


@pytest.mark.slow
def test_a_script_asks_for_what_is_missing(tmp_path):
    base = systems.bead_on_parabola()
    m, a, g = base.system.parameters
    equations = changed(base, parameters=(m, replace(a, value=None), g), initial=None)
    status, _, error = script(equations, tmp_path)
    assert (status, error) == (1, "values needed: x=VALUE, dot(x)=VALUE, a=VALUE")
    for wrong in ("nope=1", "x=np.float64(1)", "until=nan", "x=1e400", "steps=2.5", "steps=0"):
        status, _, error = script(equations, tmp_path, wrong)
        assert (status, error) == (1, f"{wrong}: not NAME=NUMBER with a known name")
    assert script(equations, tmp_path, "x=1", "dot(x)=0", "a=0.5", "until=0.1")[0] == 0


def test_a_script_stops_at_a_singular_matrix(tmp_path):
    status, out, error = script(systems.bead_on_parabola(), tmp_path, "m=0")
    assert status == 1
    assert error.startswith("stopped after t = 0.0")
    assert len(out.splitlines()) == 2


@pytest.mark.slow
@pytest.mark.compiler
def test_the_examples_of_the_documentation_agree(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "emitted-code.md").read_text(encoding="utf-8")
    c_example = re.findall(r"```c\n(#include.*?)```", page, re.DOTALL)[0]
    python_examples = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (python_example,) = (code for code in python_examples if "import bead_on_parabola" in code)
    equations = systems.bead_on_parabola()
    source = write(equations, tmp_path)
    (tmp_path / "example.c").write_text(c_example)
    (tmp_path / "example.py").write_text(python_example)
    ((name, text),) = EMITTERS["python"].emit(equations).items()
    (tmp_path / name).write_text(text)
    program = tmp_path / "example"
    run(compiler(), "-std=c99", *WARNINGS, tmp_path / "example.c", source, "-o", program, "-lm")
    a = 0.25
    expected = -2 * a * 9.81 / (1 + 4 * a**2)  # at x = 1, at rest
    for printed in (run(program), run(sys.executable, "example.py", cwd=tmp_path)):
        assert float(printed) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(
    ("equations", "expected"),
    [
        (systems.bead_on_parabola(), set()),
        (one_coordinate(sp.sign(x), sp.Max(x, 1), sp.atan2(x, 2)), set()),
        (systems.indefinite(), {"solve"}),
    ],
)
def test_only_what_is_used_is_imported_and_defined(equations, expected):
    (text,) = EMITTERS["python"].emit(equations, {}).values()
    tree = ast.parse(text)
    interface = {"rhs", "mass_matrix", "forcing", "energy", "positions", "velocities", "integrate"}
    functions = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    assert functions == interface | expected


@pytest.mark.parametrize(("scene", "most"), [("bead_on_parabola", 128), ("double_pendulum", 158)])
def test_modules_are_short(scene, most):
    (text,) = EMITTERS["python"].emit(derived(scene), {}).values()
    lines = text.splitlines()
    assert len(lines) <= most
    assert max(map(len, lines)) <= 100
    assert not re.search(r"exec|eval|globals|FunctionType|__code__|def .*\*\*", text)


def test_the_names_of_the_scene_are_those_of_the_code():
    """Also where the scene has names that the code would like to use."""
    (text,) = EMITTERS["python"].emit(derived("double_pendulum"), {}).values()
    assert "    theta1, theta2, theta1_dot, theta2_dot = y\n" in text
    assert "    m1, m2, l1, l2, g = p\n" in text
    scene = """
name: clash
parameters: {w0: 2, out: 3, regular: 0.5, np: 1, rhs: 4}
coordinates: [y, p]
kinetic: {T: out*dot(y)^2/2 + (w0 + regular*cos(y)^2)*dot(p)^2/2 + np*dot(y)*dot(p)/9}
potentials: {V: rhs*y^2*p}
"""
    functions = module(loads(scene).derive().equations)
    reference = Reference(loads(scene).derive().equations)
    state, p = np.array([0.3, 0.4, -0.2, 0.6]), functions["DEFAULTS"]
    assert p._fields == ("w0", "out", "regular", "np", "rhs")
    assert difference(functions["rhs"](0.0, state), reference.rhs(0.0, state, p)) < 1e-13


@pytest.mark.slow
@sliced([n for n, p in SCENES.items() if p.parent.name != "refused"], {*NARROW, "pleiades"})
def test_mass_matrices_of_shipped_scenes_are_those_of_the_equations(name):
    """Loops over zeros may stand before all other statements, as for seven bodies."""
    system = derived(name).system
    if system.initial is None:
        pytest.skip("the scene has no start")
    functions, start = module(derived(name)), np.array(system.initial.numbers)
    values = dict(zip([p.symbol for p in system.parameters], functions["DEFAULTS"], strict=True))
    values |= dict(zip(system.state_symbols, start, strict=True)) | {system.t: 0.0}
    matrix = functions["mass_matrix"](0.0, start)
    entries = [sp.sympify(x) for row in system.mass_matrix for x in row]
    # Inputs are left out.
    known = [x.free_symbols <= values.keys() and not x.atoms(AppliedUndef) for x in entries]
    pairs = zip(entries, known, strict=True)
    expected = [float(x.subs(values)) if is_known else np.nan for x, is_known in pairs]
    found = np.where(known, matrix.ravel(), np.nan)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(matrix).max())
