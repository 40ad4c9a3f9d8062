"""Emitted code with closures: against the same systems in angles and in high precision."""

from __future__ import annotations

import ctypes
import shutil

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.emit.c.constraints import workspace_size
from lagrange_cli.program.emitted_functions import constraint_programs
from lagrange_cli.program.program import build_program
from lagrange_cli.program.solvers.blocks import MatrixBlock
from lagrange_cli.simulate.native.sources import lanes_source, library_source
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.closed_code import (
    CASES,
    TOLERANCE,
    Closed,
    Multipliers,
    massless,
    random_states,
    simulation_programs,
)
from tests.emit.emit_reference import difference
from tests.emit.emitted_c import WARNINGS, Compiled, compiler, in_types, run, write
from tests.parts import changed


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(("name", "real"), in_types(CASES))
def test_functions_agree_with_the_equations(name, real, tmp_path):
    equations = CASES[name]()
    compiled, reference = Closed(equations, tmp_path, real), Multipliers(equations)
    n, m = len(equations.system.coordinates), len(equations.system.closures)
    assert compiled.macro("COORDINATES") == n
    assert compiled.macro("MULTIPLIERS") == m
    size = compiled.macro("CONSTRAINTS")
    for t, y, p in random_states(equations):
        rhs, multipliers, constraints = reference.solve(t, y, p)
        assert len(constraints) == size
        for function, expected, loss in (
            ("rhs", rhs, 1e3),
            ("multipliers", multipliers, 1e3),
            ("constraints", constraints, 10),
        ):
            status, out = compiled(function, t, y, p, len(expected))
            assert status == 0
            assert difference(out, expected) < loss * TOLERANCE[real], function


@pytest.mark.compiler
def test_pendulum_agrees_with_its_angle_and_tension(tmp_path):
    equations = closures.pendulum()
    compiled = Closed(equations, tmp_path)
    m, g, length = p = compiled.defaults
    for angle, rate in ((0.0, 0.0), (0.4, 1.0), (2.0, -3.0), (-np.pi / 2, 0.5)):
        sin, cos = np.sin(angle), np.cos(angle)
        y = length * np.array([sin, -cos, cos * rate, sin * rate])
        acceleration = -g / length * sin
        expected = length * np.array(
            [cos * acceleration - sin * rate**2, sin * acceleration + cos * rate**2]
        )
        status, dydt = compiled("rhs", 0.0, y, p, 4)
        assert status == 0
        assert dydt[2:] == pytest.approx(expected, rel=1e-14, abs=1e-14)
        # The rod pulls inwards with its tension; the gradient of x² + z² is 2l outwards.
        tension = m * (g * cos + length * rate**2)
        status, out = compiled("multipliers", 0.0, y, p, 1)
        assert status == 0
        assert out[0] * 2 * length == pytest.approx(-tension, rel=1e-14)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("n", [2, 5])
def test_chain_agrees_with_its_angles(n, tmp_path):
    cartesian, angles = closures.chain(n), systems.pendulum_chain(n)
    compiled = Closed(cartesian, tmp_path)
    polar = Compiled(angles, tmp_path)
    p = compiled.defaults
    assert p == pytest.approx(polar.defaults)
    generator = np.random.default_rng(8)
    for _ in range(4):
        theta, rate = generator.uniform(-3, 3, n), generator.uniform(-2, 2, n)
        status, dydt = polar("rhs", 0.0, np.concatenate([theta, rate]), p, 2 * n)
        assert status == 0
        bend, lengths = dydt[n:], p[n : 2 * n]
        ax = np.cumsum(lengths * (np.cos(theta) * bend - np.sin(theta) * rate**2))
        az = np.cumsum(lengths * (np.sin(theta) * bend + np.cos(theta) * rate**2))
        y = closures.chain_state(n, theta, rate, lengths)
        status, dydt = compiled("rhs", 0.0, y, p, 4 * n)
        assert status == 0
        expected = np.stack([ax, az], 1).ravel()
        assert np.abs(dydt[2 * n :] - expected).max() < 1e-11 * np.abs(expected).max()


def pendulum_times(factor):
    """The pendulum with its closure multiplied by a number."""
    equations = closures.pendulum()
    (rod,) = equations.system.closures
    rod = closures.closure("rod", factor * rod.expression, equations.system.coordinates)
    return changed(equations, closures=(rod,), name="scaled")


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("mass", [2.0**-104, 1.0, 2.0**101])
@pytest.mark.parametrize("length", [2.0**-40, 2.0**53])
@pytest.mark.parametrize("factor", [2.0**-100, 1.0, 2.0**100])
def test_units_change_no_bit(mass, length, factor, tmp_path):
    own = Closed(closures.pendulum(), tmp_path)
    other = Closed(pendulum_times(sp.Rational(factor)), tmp_path)
    y, p = np.array([1.2, -1.6, 0.8, 0.6]), np.array([1.3, 9.81, 2.0])
    scaled = p * [mass, length, length]
    for function, size, unit in (("rhs", 4, length), ("multipliers", 1, mass / factor)):
        status, expected = own(function, 0.0, y, p, size)
        assert status == 0
        status, found = other(function, 0.0, y * length, scaled, size)
        assert status == 0
        assert (found == expected * unit).all()
    off = y + np.array([1e-3, 2e-3, -1e-3, 1e-2])
    status, expected = own.project(0.0, off, p)
    assert status == 0
    status, found = other.project(0.0, off * length, scaled)
    assert status == 0
    if factor == 1:
        assert (found == expected * length).all()
    assert found / length == pytest.approx(expected, rel=1e-15)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("ratio", [1e-30, 1e-12, 1e12, 1e30])
def test_masses_of_any_ratio(ratio, tmp_path):
    equations = closures.chain(2)
    compiled, reference = Closed(equations, tmp_path), Multipliers(equations)
    p = compiled.defaults.copy()
    p[1] = p[0] * ratio
    for angles in ([0.3, 1.2], [2.0, -1.0]):
        y = closures.chain_state(2, np.array(angles), np.array([1.0, -2.0]), p[2:4])
        rhs, multipliers, _ = reference.solve(0.0, y, p)
        status, dydt = compiled("rhs", 0.0, y, p, 8)
        assert status == 0
        assert difference(dydt, rhs) < 1e-13
        status, out = compiled("multipliers", 0.0, y, p, 2)
        assert status == 0
        assert difference(out, multipliers) < 1e-13


@pytest.mark.slow
@pytest.mark.compiler
def test_singular_configuration_is_refused(tmp_path):
    """Two rods from fixed points that pull along one line: no multipliers."""
    equations = closures.pendulum()
    x, z = equations.system.coordinates
    other = closures.closure("other", (x.q - 4) ** 2 + z.q**2 - 4, [x, z])
    both = changed(equations, closures=(*equations.system.closures, other), name="taut")
    compiled = Closed(both, tmp_path)
    p = compiled.defaults
    for angle in (0.0, 1e-17):
        y = np.array([2.0 * np.cos(angle), 2.0 * np.sin(angle), 0.0, 0.0])
        assert compiled("rhs", 0.0, y, p, 4)[0] == 1
        assert compiled("multipliers", 0.0, y, p, 2)[0] == 1
    assert compiled("rhs", 0.0, np.array([2.0, 0.01, 0.0, 0.0]), p, 4)[0] == 0
    centre = Closed(equations, tmp_path)
    assert centre("rhs", 0.0, np.zeros(4), p, 4)[0] == 1
    assert centre.project(0.0, np.zeros(4), p)[0] == 1
    assert centre("rhs", 0.0, np.full(4, np.inf), p, 4)[0] != 0


@pytest.mark.compiler
def test_coordinates_without_inertia_follow(tmp_path):
    compiled = Closed(massless(), tmp_path)
    p = compiled.defaults
    angle, rate = 0.7, 1.5
    y = np.zeros(8)
    y[:2] = 2 * np.array([np.cos(angle), np.sin(angle)])
    y[4:6] = 2 * rate * np.array([-np.sin(angle), np.cos(angle)])
    y[2], y[6], y[3], y[7] = angle + 0.1, 0.0, 0.3, 0.0
    status, y = compiled.project(0.5, y, p)
    assert status == 0
    assert y[2] == pytest.approx(angle, rel=1e-15)
    assert y[6] == pytest.approx(rate, rel=1e-14)
    assert y[3] == pytest.approx(np.arcsin(np.sin(0.5) / 1000), rel=1e-15)
    status, dydt = compiled("rhs", 0.5, y, p, 8)
    assert status == 0
    assert dydt[6] == pytest.approx(-9.81 / 2.0 * np.cos(angle), rel=1e-13)


STRICT = ["-Wconversion", "-Wsign-conversion", "-Wshadow", "-Wundef", "-Wdouble-promotion"]


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    ("name", "real"), [("pendulum", "float"), ("sleigh", "double"), ("chain2", "long-double")]
)
def test_text_is_strict_c99_and_cpp(name, real, tmp_path):
    source = write(CASES[name](), tmp_path, real, main=True)
    options = [*WARNINGS, *STRICT, "-O1", "-c", source, "-o", tmp_path / "object.o"]
    run(compiler(), "-std=c99", *options)
    if shutil.which("g++") and real == "double":
        run("g++", "-x", "c++", *WARNINGS, "-c", source, "-o", tmp_path / "object.o")


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", ["pendulum", "sleigh", "chain8"])
def test_functions_stay_within_their_arrays(name, tmp_path):
    equations = CASES[name]()
    if equations.system.initial is None:
        n = len(equations.system.coordinates) // 2
        y = closures.chain_state(n, np.ones(n), np.zeros(n), 1 - 0.01 * np.arange(1, n + 1))
        initial = systems.InitialState(tuple(map(float, y[: 2 * n])), (0.0,) * 2 * n)
        equations = changed(equations, initial=initial)
    source = write(equations, tmp_path, main=True)
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    run(compiler(), "-std=c99", "-g", *sanitize, source, "-o", tmp_path / "a.out", "-lm")
    assert len(run(tmp_path / "a.out", "until=0.01", "steps=1").splitlines()) == 502


@pytest.mark.slow
@pytest.mark.compiler
def test_main_stays_on_the_closures_and_conserves_energy(tmp_path):
    source = write(closures.pendulum(), tmp_path, main=True)
    run(compiler(), "-std=c99", "-O2", source, "-o", tmp_path / "a.out", "-lm")
    rows = run(tmp_path / "a.out", "dot(z)=-7", "until=20").splitlines()
    assert rows[0] == "t,x,z,dot(x),dot(z)"
    _, x, z, u, w = np.array([list(map(float, row.split(","))) for row in rows[1:]]).T
    assert np.abs(x**2 + z**2 - 4).max() < 1e-14
    assert np.abs(x * u + z * w).max() < 1e-13
    energy = (u**2 + w**2) / 2 + 9.81 * z
    assert np.abs(energy - energy[0]).max() < 1e-6
    assert z.max() > 1.9  # over the top


def test_blocks_couple_what_closures_hold():
    blocks = build_program(closures.moving_circle(), ["acceleration"]).blocks
    assert blocks == (
        MatrixBlock((0, 1), unrolled=False, definite=False, closures=(0,)),
        MatrixBlock((2,), unrolled=True, definite=True, exact=False),
    )
    assert [b.closures for b in build_program(closures.sleigh(), ["acceleration"]).blocks] == [(0,)]


def test_minimal_systems_have_no_functions_of_closures():
    equations = systems.masses_through_hole()
    assert constraint_programs(equations) == {}
    for text in EMITTERS["c"].emit(equations).values():
        assert "multipliers" not in text
        assert "project" not in text
        assert "closure" not in text


@pytest.mark.slow
@pytest.mark.compiler
def test_text_for_the_simulation(tmp_path):
    equations = closures.chain(2, name="secret")
    programs = simulation_programs(equations)
    text = library_source(programs)
    assert lanes_source(programs) == ""
    assert "secret" not in text
    assert "rod" not in text
    own = Closed(equations, tmp_path)
    (tmp_path / "system.c").write_text(text)
    library = tmp_path / "system.so"
    run(
        compiler(), "-std=c99", *WARNINGS, "-O1", "-shared", "-fPIC", tmp_path / "system.c",
        "-o", library, "-lm",
    )  # fmt: skip
    functions = ctypes.CDLL(str(library))
    p = own.defaults
    y = closures.chain_state(2, np.array([0.3, 1.0]), np.array([1.0, 2.0]), p[2:4]) + 1e-4
    work = np.empty(workspace_size(programs))
    for function, size in {"rhs": 8, "multipliers": 2, "constraints": 4}.items():
        out = np.empty(size)
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (y, p, work, out)]
        entry = getattr(functions, f"system_{function}")
        assert entry(ctypes.c_double(0), pointers[0], None, *pointers[1:]) == 0
        assert (out == own(function, 0.0, y, p, size)[1]).all()
    expected = own.project(0.0, y, p)[1]
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (y, p, work)]
    assert functions.system_project(ctypes.c_double(0), pointers[0], None, *pointers[1:]) == 0
    assert (y == expected).all()
