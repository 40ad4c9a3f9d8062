"""Large systems: loops for all functions, sparse elimination, work that is linear."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from lagrange_cli.emit.template_files import filled, python_template
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.program import program as programs_of
from lagrange_cli.program.emitted_functions import constraint_programs, program_of
from lagrange_cli.program.lowered.lowering import lowered
from lagrange_cli.program.lowered.stored import StoredFunctions
from lagrange_cli.program.operations import count_operations, elimination_operations
from lagrange_cli.program.program import build_program
from lagrange_cli.program.solvers.sparse_factorization import (
    BandFactors,
    SupernodalFactors,
    choose_factorization,
    couplings,
    supernodes,
)
from lagrange_cli.program.systems.loops import IndexedLoop, SparseSolve, supernode_tables
from lagrange_cli.scene import read_text
from lagrange_cli.simulate.native.rounding_model import perturb
from tests.emit import emit_closures as closures
from tests.emit import emit_systems as systems
from tests.emit.emitted_c import Compiled, write
from tests.parts import changed
from tests.program.interpreted import interpreted
from tests.program.test_bandwidth import (
    M,
    chain,
    net,
    python_functions,
    ring,
    state,
    truss,
    two_chains,
)

pytestmark = pytest.mark.slow


def tree(count, seed):
    """Particles each hung from one before it."""
    generator = np.random.default_rng(seed)
    above = [None, *(int(generator.integers(0, k)) for k in range(1, count))]
    return truss(count, [(a, k) for k, a in enumerate(above)], "tree")


def braced(columns):
    """Squares in a row, each with a diagonal: a truss of which no rod is too many."""
    up = [(2 * k, 2 * k + 1) for k in range(columns)]
    along = [(2 * k + s, 2 * k + 2 + s) for k in range(columns - 1) for s in range(2)]
    across = [(2 * k, 2 * k + 3) for k in range(columns - 1)]
    return truss(2 * columns, up + along + across, "braced")


def meshed(equations):
    """The same with masses of their own."""
    masses = [
        systems.parameter(f"m{k}", 1 + 0.1 * k) for k in range(len(equations.system.coordinates))
    ]
    n = len(masses)
    rows = tuple(ExpressionRow(n, {i: masses[i // 2].symbol}) for i in range(n))
    return changed(
        equations,
        parameters=(M, *equations.system.parameters[1:], *masses[: n // 2]),
        mass_matrix=rows,
    )


CASES = {
    "chain": lambda: chain(20),
    "ring": lambda: ring(16),
    "net": lambda: net(5),
    "large_net": lambda: net(10),
    "tree": lambda: tree(40, 1),
    "braced": lambda: braced(12),
    "two_chains": lambda: two_chains(12),
    "own_masses": lambda: meshed(net(4)),
    "different_masses": lambda: closures.chain(12),
}


def dense(equations):
    """M, f, Φ, biases and φ as functions of a state, by SymPy and NumPy."""
    e = equations
    arguments = [[c.q for c in e.system.coordinates], [c.v for c in e.system.coordinates]]
    arguments.append([p.symbol for p in e.system.parameters])
    n = len(e.system.coordinates)
    diagonal = [e.system.mass_matrix[i][i] for i in range(n)]
    held = [(k, j) for k, c in enumerate(e.system.closures) for j in c.coordinate_numbers]
    gradients = [e.system.closures[k].gradient[j] for k, j in held]
    columns = [
        e.system.forcing,
        [c.bias for c in e.system.closures],
        [c.expression for c in e.system.closures],
    ]
    function = sp.lambdify(arguments, [diagonal, gradients, *map(list, columns)], "math")

    def values(q, v, p):
        masses, entries, forcing, bias, phi = map(np.array, function(q, v, p))
        gradient = np.zeros((len(e.system.closures), n))
        gradient[tuple(np.transpose(held))] = entries
        return np.diag(masses), forcing, gradient, bias, phi

    return values


def solved(mass, forcing, gradient, bias):
    """Accelerations and multipliers, refined with residuals in long doubles."""
    n, m = len(mass), len(gradient)
    matrix = np.block([[mass, -gradient.T], [gradient, np.zeros((m, m))]])
    right = np.concatenate([forcing, -bias])
    found = np.linalg.solve(matrix, right).astype(np.longdouble)
    wide = matrix.astype(np.longdouble)
    for _ in range(3):
        residual = right - wide @ found
        found += np.linalg.solve(matrix, residual.astype(float))
    return np.asarray(found[:n], dtype=float), np.asarray(found[n:], dtype=float)


def near_rest(y):
    """States of particles about their places in two rows, in which no rods are parallel."""
    n = len(y) // 4
    at = np.stack([np.arange(n) // 2, np.arange(n) % 2], axis=1).ravel()
    return np.concatenate([at + 0.3 * y[: 2 * n], y[2 * n :]])


@pytest.mark.compiler
@pytest.mark.parametrize(
    "name",
    # The tree has supernodes too.
    [pytest.param(n, marks=pytest.mark.campaign if n == "large_net" else ()) for n in CASES],
)
def test_emitted_code_gives_what_a_dense_solution_gives(name, tmp_path):
    equations = CASES[name]()
    compiled, reference = Compiled(equations, tmp_path), dense(equations)
    programs, python = python_functions(equations)
    assert all(program.parts for program in programs.values())
    n, m = len(equations.system.coordinates), len(equations.system.closures)
    p = compiled.defaults
    for seed in range(3):
        y = near_rest(state(equations, seed))
        mass, forcing, gradient, bias, phi = reference(y[:n], y[n:], p)
        a, multipliers = solved(mass, forcing, gradient, bias)
        change, _ = solved(mass, 0 * forcing, gradient, phi)
        rates, _ = solved(mass, 0 * forcing, gradient, gradient @ y[n:])
        for function, expected in (
            ("rhs", np.concatenate([y[n:], a])),
            ("multipliers", multipliers),
        ):
            status, found = compiled(function, 0.0, y, p, len(expected))
            assert status == 0
            close = 1e-12 * np.abs(expected).max()
            assert np.abs(found - expected).max() < close
            assert np.abs(python[function](0.0, y, p) - expected).max() < close
        for function, expected in (("position_change", change), ("velocity_change", rates)):
            found = python[function](0.0, y, p)
            assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()
        status, found = compiled("constraints", 0.0, y, p, 2 * m)
        assert status == 0
        expected = np.concatenate([phi, gradient @ y[n:]])
        assert np.abs(found - expected).max() < 1e-13 * np.abs(expected).max()


@pytest.mark.compiler
@pytest.mark.parametrize(
    "make",
    [
        lambda: net(4),
        CASES["own_masses"],
        pytest.param(CASES["net"], marks=pytest.mark.campaign),
        pytest.param(CASES["braced"], marks=pytest.mark.campaign),
    ],
    ids=["small_net", "own_masses", "net", "braced"],
)
def test_all_functions_are_those_of_straight_code(make, tmp_path, monkeypatch):
    equations = make()
    energy = sp.Add(*(M.symbol * c.v**2 / 2 for c in equations.system.coordinates))
    energy += sp.Add(*(M.symbol * 9 * c.q for c in equations.system.coordinates[1::2]))
    equations = changed(
        equations,
        energy=energy,
        kinetic=energy,
        outputs=(("mean", sp.sqrt(1 + energy**2)), ("time", equations.system.t)),
    )
    (kernels := tmp_path / "kernels").mkdir()
    (straight := tmp_path / "straight").mkdir()
    loops = Compiled(equations, kernels)
    monkeypatch.setattr(programs_of, "is_large_system", lambda _: False)
    plain = Compiled(equations, straight)
    y = state(equations, 5)
    n = len(equations.system.coordinates)
    sizes = {"mass_matrix": n * n, "forcing": n, "energy": 3, "outputs": 2}
    for function, size in sizes.items():
        found = loops(function, 0.5, y, loops.defaults, size)
        expected = plain(function, 0.5, y, plain.defaults, size)
        assert found[0] == expected[0] == 0
        np.testing.assert_allclose(found[1], expected[1], rtol=1e-14, atol=0)


@given(st.integers(2, 40), st.data())
@settings(max_examples=60, deadline=None)
def test_supernodes_hold_what_elimination_fills(count, data):
    edges = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    held = [set(pair) for pair in data.draw(st.lists(edges, min_size=1, max_size=80))]
    touching = couplings(held)
    found = supernodes(touching)
    assert sorted(found.order) == list(range(len(held)))
    columns = [node.first + k for node in found.nodes for k in range(node.columns)]
    assert columns == list(range(len(held)))
    position = {k: place for place, k in enumerate(found.order)}
    pattern = [{position[j] for j in touching[k]} for k in found.order]
    for k in range(len(held)):
        later = {j for j in pattern[k] if j > k}
        for j in later:
            found.place(j, k)  # there is a place for it
            pattern[j] |= later - {j}
    matrix = np.zeros((len(held), len(held)))
    for node in found.nodes:
        assert list(node.rows) == sorted(node.rows)
        for update in node.updates:
            rows = found.nodes[update.source].rows[update.first :]
            assert [node.rows[at] for at in update.rows] == list(rows)
            for row in rows:
                matrix[row, node.first] = 1


@given(st.integers(3, 30), st.integers(0, 2**32))
@settings(max_examples=25, deadline=None)
def test_sparse_elimination_solves(count, seed):
    generator = np.random.default_rng(seed)
    held = [set(generator.integers(0, count, 2).tolist()) for _ in range(2 * count)]
    touching = couplings(held)
    m = len(held)
    matrix = np.zeros((m, m))
    for k, of in enumerate(touching):
        for j in of:
            if j < k:
                matrix[k, j] = matrix[j, k] = generator.uniform(-1, 1)
    matrix += np.diag(np.abs(matrix).sum(axis=1) + 0.1)
    right = generator.uniform(-1, 1, m)
    found = eliminated(supernodes(touching), matrix, right)
    expected = np.linalg.solve(matrix, right)
    assert np.abs(found - expected).max() < 1e-12 * np.abs(expected).max()


def eliminated(of, matrix, right):
    """The solution by the emitted solver in Python."""
    namespace = {"np": np}
    exec(filled(python_template("solve_sparse"), {"@NJIT@": ""}), namespace)
    a, b = np.zeros(of.numbers), np.zeros(len(right))
    for i, row in enumerate(of.order):
        for j, column in enumerate(of.order[: i + 1]):
            if matrix[row, column]:
                a[of.place(i, j)] = matrix[row, column]
    b[:] = right[list(of.order)]
    tables = (np.array(table) for table in supernode_tables(of))
    namespace["solve_sparse"](len(right), *tables, a, b)
    found = np.empty(len(right))
    found[list(of.order)] = b
    return found


def cost(equations):
    program = build_program(equations, ["acceleration"])
    return count_operations(program).total + elimination_operations(program)


def test_operations_are_linear_in_the_links():
    counts = {n: cost(chain(n)) for n in (10, 100, 400)}
    counts[10] = cost(chain(20))
    assert counts[400] - counts[100] == 300 * (counts[100] - counts[10]) / 80
    assert counts[400] < 50 * 400


def test_operations_of_a_net_grow_slowly():
    held = {}
    for n in (10, 20, 40):
        along = [{n * i + j, n * i + j + 1} for i in range(n) for j in range(n - 1)]
        across = [{n * i + j, n * i + n + j} for i in range(n - 1) for j in range(n)]
        held[n] = choose_factorization(along + across)
        assert isinstance(held[n], SupernodalFactors)
    # Four times as many closures: less than four times four as a band would, and the numbers
    # of the factors are almost in proportion.
    assert held[40].operations < 6 * held[20].operations * 2
    assert held[40].numbers < 6 * held[20].numbers
    assert held[20].numbers < 7 * held[10].numbers


def test_chains_are_bands():
    assert elimination(chain(30)) == BandFactors(tuple(range(30)), 1)
    assert elimination(two_chains(15)).width == 1
    assert isinstance(elimination(CASES["large_net"]()), SupernodalFactors)


def elimination(equations):
    parts = build_program(equations, ["acceleration"]).parts
    (found,) = [part.factors for part in parts if isinstance(part, SparseSolve)]
    return found


def test_code_does_not_grow_with_a_chain(tmp_path):
    lengths = [len(write(chain(n), tmp_path).read_text(encoding="utf-8")) for n in (30, 90)]
    assert lengths[1] < 1.05 * lengths[0]
    texts = []
    for n in (30, 90):
        programs = {"rhs": build_program(chain(n), ["acceleration"])}
        functions = (programs | constraint_programs(chain(n))).items()
        stored = {name: lowered(program, name) for name, program in functions}
        texts.append(StoredFunctions.from_functions(stored).text)
    assert len(texts[1]) < 1.05 * len(texts[0])


def test_a_net_has_the_same_loops_whatever_its_size():
    loops = [len(build_program(net(n), ["acceleration"]).parts) for n in (16, 20)]
    assert loops[0] == loops[1] < 40


@pytest.mark.compiler
def test_sums_of_pairs_are_those_of_floats(tmp_path):
    equations = chain(30)
    energy = sp.Add(
        *(c.v**2 * sp.Rational(1, 3 + k) for k, c in enumerate(equations.system.coordinates))
    )
    equations = changed(equations, energy=energy, kinetic=energy)
    y = state(equations, 4)
    for real, close in (("float", 1e-6), ("double", 1e-15), ("long-double", 1e-15)):
        (folder := tmp_path / real).mkdir()
        compiled = Compiled(equations, folder, real)
        status, found = compiled("energy", 0.0, y, compiled.defaults, 3)
        assert status == 0
        expected = sum(v**2 / (3 + k) for k, v in enumerate(y[60:].tolist()))
        assert abs(found[0] - expected) < close * expected


@pytest.mark.compiler
def test_closures_without_rank_are_singular(tmp_path):
    # A rod twice: the second one says nothing new.
    equations = truss(30, [(None, 0), *((i, i + 1) for i in range(29)), (3, 4)], "twice")
    compiled, (_, python) = Compiled(equations, tmp_path), python_functions(equations)
    y = state(equations, 3)
    for function, size in (("rhs", 120), ("multipliers", 31)):
        status, _ = compiled(function, 0.0, y, compiled.defaults, size)
        assert status == 1
        assert np.isnan(python[function](0.0, y, compiled.defaults)).all()
    equations = CASES["tree"]()
    y = state(equations, 3)
    y[0:2] = y[2:4]
    (folder := tmp_path / "tree").mkdir()
    compiled, (_, python) = Compiled(equations, folder), python_functions(equations)
    status, _ = compiled("rhs", 0.0, y, compiled.defaults, len(y))
    assert status == 1
    assert np.isnan(python["rhs"](0.0, y, compiled.defaults)).all()


def test_disturbed_programs_have_a_factor_for_each_operation():
    equations = net(5)
    program = build_program(equations, ["acceleration"])
    off = perturb(program)
    namespace = interpreted({"rhs": program, "disturbed": off})
    p = [x.value for x in equations.system.parameters]
    factors_of = off.parameters - program.parameters
    assert factors_of > 5 * len(equations.system.closures)
    y = state(equations, 2)
    rhs = namespace["rhs"](0.0, y, p)
    assert (namespace["disturbed"](0.0, y, [*p, *[1.0] * factors_of]) == rhs).all()
    generator = np.random.default_rng(0)
    ulps = 1 + 2.0**-52 * generator.choice([-1, 1], factors_of)
    moved = namespace["disturbed"](0.0, y, [*p, *ulps])
    assert 0 < np.abs(moved - rhs).max() < 1e-11 * np.abs(rhs).max()


NET = """
name: springs
sizes: {n: 7}
parameters: {m: 1.5, k: 3.0, l: 0.5}
particles:
  p[i=1..n, j=1..n]: {mass: m, position: ["x[i,j]", "y[i,j]", "z[i,j]"]}
potentials:
  along[i=1..n-1, j=1..n]: {spring: ["p[i,j]", "p[i+1,j]"], stiffness: k, length: l}
"""


def test_what_several_coordinates_need_is_computed_once():
    equations = derive(read_text(NET), points=1)
    program = build_program(equations, ["acceleration"])
    assert program.parts
    assert count_operations(program).calls == 6 * 7  # a root for each spring
    _, python = python_functions(equations)
    y = state(equations, 1)
    found = python["rhs"](0.0, y, [1.5, 3.0, 0.5])[147:].reshape(7, 7, 3)
    at = y[:147].reshape(7, 7, 3)
    apart = np.diff(at, axis=0)
    length = np.linalg.norm(apart, axis=2, keepdims=True)
    pull = 3.0 * (1 - 0.5 / length) * apart
    force = np.zeros_like(at)
    force[:-1] += pull
    force[1:] -= pull
    np.testing.assert_allclose(found, force / 1.5, rtol=1e-12, atol=1e-13)


SCRIPT = """
import sys
from hashlib import sha256
sys.path.insert(0, sys.argv[1])
from tests.program.test_large_systems import CASES, net
from lagrange_cli.api.emitters import EMITTERS
for make in (lambda: net(4), CASES["own_masses"]):
    for language in ("c", "python"):
        for text in EMITTERS[language].emit(make()).values():
            print(sha256(text.encode()).hexdigest())
"""


@pytest.mark.campaign
def test_output_does_not_depend_on_the_hash_seed():
    folder = str(Path(__file__).parents[2])
    found = {
        subprocess.run(
            [sys.executable, "-c", SCRIPT, folder],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
            timeout=300,
        ).stdout
        for seed in ("1", "77")
    }
    assert len(found) == 1
    assert len(next(iter(found)).split()) == 6


def test_members_of_a_kernel_are_many():
    program = program_of(chain(200), "rhs")
    kernels = [part for part in program.parts if isinstance(part, IndexedLoop)]
    assert len(kernels) < 25
    assert max(kernel.members for kernel in kernels) >= 199
