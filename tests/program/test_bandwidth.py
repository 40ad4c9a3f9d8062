"""Chains, nets and rings of many links: multipliers from a band."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

from lagrange_cli.mechanics.equations import TextbookForm
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.mechanics.system import Closure
from lagrange_cli.program import program as programs_of
from lagrange_cli.program.emitted_functions import constraint_programs
from lagrange_cli.program.program import build_program
from lagrange_cli.program.solvers import blocks as solve
from lagrange_cli.program.solvers.sparse_factorization import bandwidth, elimination_order
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.emitted_c import Compiled
from tests.parts import changed
from tests.program.interpreted import interpreted

M, L, G = (systems.parameter(n, v, positive=True) for n, v in (("m", 1.5), ("l", 0.5), ("g", 9.81)))


def rod(name, ends, coordinates):
    """The closure |r_a − r_b|² = l²; an end is the number of a particle, or None: the origin."""
    places = [coordinates[2 * e : 2 * e + 2] if e is not None else [] for e in ends]
    zero = [sp.Integer(0)] * 2
    q = [[c.q for c in of] or zero for of in places]
    v = [[c.v for c in of] or zero for of in places]
    apart = [a - b for a, b in zip(*q, strict=True)]
    gradient = {}
    for sign, end in zip((2, -2), ends, strict=True):
        for axis in range(2) if end is not None else ():
            gradient[2 * end + axis] = sign * apart[axis]
    bias = sp.Add(*(2 * (a - b) ** 2 for a, b in zip(*v, strict=True)))
    phi = sp.Add(*(a**2 for a in apart)) - L.symbol**2
    multiplier = sp.Symbol(f"lambda_{name}", real=True)
    return Closure(
        name,
        name,
        "position",
        phi,
        ExpressionRow(len(coordinates), gradient),
        zero[0],
        bias,
        multiplier,
        "",
    )


def truss(count, rods, name="truss"):
    """Particles in a vertical plane joined by rods."""
    axes = [f"{axis}{i}" for i in range(count) for axis in "xz"]
    coordinates = tuple(map(systems.coordinate, axes))
    base = closures.pendulum()
    zero, n = sp.Integer(0), 2 * count
    mass = tuple(ExpressionRow(n, {i: M.symbol}) for i in range(n))
    return changed(
        base,
        name=name,
        parameters=(M, L, G),
        coordinates=coordinates,
        mass_matrix=mass,
        forcing=tuple(sp.Integer(0) if i % 2 == 0 else -M.symbol * G.symbol for i in range(n)),
        closures=tuple(rod(f"rod{k}", ends, coordinates) for k, ends in enumerate(rods)),
        cartesian_names=(),
        particles=(),
        textbook=lambda: TextbookForm(()),
        initial=None,
        kinetic=zero,
        potential=zero,
        lagrangian=zero,
        energy=zero,
    )


def chain(n):
    return truss(n, [(None, 0), *((i, i + 1) for i in range(n - 1))], "chain")


def ring(n):
    return truss(n, [(i, (i + 1) % n) for i in range(n)], "ring")


def net(n):
    along = [(n * i + j, n * i + j + 1) for i in range(n) for j in range(n - 1)]
    across = [(n * i + j, n * i + n + j) for i in range(n - 1) for j in range(n)]
    return truss(n * n, along + across, "net")


def two_chains(n):
    rods = [(i, i + 1) for i in range(2 * n - 1) if i != n - 1]
    return truss(2 * n, [*rods, (None, 0)], "two_chains")


@pytest.fixture
def straight(monkeypatch):
    """Programs without kernels, as of systems with contacts."""
    monkeypatch.setattr(programs_of, "is_large_system", lambda _: False)


CASES = {
    "chain": lambda: chain(20),
    "ring": lambda: ring(16),
    "net": lambda: net(4),
    "two_chains": lambda: two_chains(12),
    "different_masses": lambda: closures.chain(12),
}


def state(equations, seed):
    generator = np.random.default_rng(seed)
    n = len(equations.system.coordinates)
    return generator.uniform(-2, 2, 2 * n)


def python_functions(equations):
    programs = {"rhs": build_program(equations, ["acceleration"]), **constraint_programs(equations)}
    return programs, interpreted(programs)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", list(CASES))
def test_a_band_gives_what_pivoting_gives(name, tmp_path, monkeypatch, straight):
    equations = CASES[name]()
    compiled = Compiled(equations, tmp_path)
    programs, python = python_functions(equations)
    assert all(b.band is not None for b in programs["rhs"].blocks if b.closures)
    monkeypatch.setattr(solve, "is_banded", lambda *_: False)
    programs, whole = python_functions(equations)
    assert not any(b.band is not None for b in programs["rhs"].blocks)
    n, m = len(equations.system.coordinates), len(equations.system.closures)
    p = compiled.defaults
    for seed in range(3):
        y = state(equations, seed)
        for function, size in (("rhs", 2 * n), ("multipliers", m)):
            expected = whole[function](0.0, y, p)
            close = 1e-9 * np.abs(expected).max()
            assert np.isfinite(expected).all()
            assert np.abs(python[function](0.0, y, p) - expected).max() < close
            status, found = compiled(function, 0.0, y, p, size)
            assert status == 0
            assert np.abs(found - expected).max() < close
        for function in ("position_change", "velocity_change"):
            expected = whole[function](0.0, y, p)
            assert (
                np.abs(python[function](0.0, y, p) - expected).max() < 1e-9 * np.abs(expected).max()
            )


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("kernels", [True, False])
def test_a_rod_without_length_is_singular(tmp_path, kernels, request):
    if not kernels:
        request.getfixturevalue("straight")
    equations = chain(20)
    compiled, (_, python) = Compiled(equations, tmp_path), python_functions(equations)
    y = state(equations, 1)
    y[20:22] = y[22:24]
    for function, size in (("rhs", 80), ("multipliers", 20)):
        status, _ = compiled(function, 0.0, y, compiled.defaults, size)
        assert status == 1
        assert np.isnan(python[function](0.0, y, compiled.defaults)).all()


def test_order_of_elimination():
    path = [{k, k + 1} for k in range(9)]
    assert elimination_order(path) == tuple(range(9))
    mixed = [path[k] for k in (4, 0, 7, 2, 8, 1, 6, 3, 5)]
    order = elimination_order(mixed)
    assert sorted(order) == list(range(9))
    assert bandwidth([mixed[k] for k in order]) == 1
    assert bandwidth(mixed) > 3
    round_about = [{k, (k + 1) % 9} for k in range(9)]
    assert bandwidth([round_about[k] for k in elimination_order(round_about)]) == 2
    assert elimination_order([{0}, {1}, {2}]) == (0, 1, 2)
