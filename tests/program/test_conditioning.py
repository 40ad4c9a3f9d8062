"""Accelerations keep the digits that their inputs determine, whatever the masses are.

The error of emitted code is compared with what the data themselves leave
undetermined: the change of the accelerations when every input (coordinates,
velocities, parameters) is moved by its rounding error.
"""

from __future__ import annotations

import functools
import math
from pathlib import Path

import mpmath
import numpy as np
import pytest
import sympy as sp

from lagrange_cli import api
from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics.dynamics import solve_exactly as solving
from lagrange_cli.mechanics.dynamics.solve_exactly import solve_exactly
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import Reference
from tests.emit.emitted_c import Compiled
from tests.parts import changed
from tests.program.interpreted import interpreted
from tests.systems.shipped import SLICE

SYSTEMS = Path(__file__).parents[2] / "systems"
ROUNDING = 2.0**-53
DIGITS = 60

#: Errors of the code, in units of what the data leave undetermined (three links: measured 40).
FACTOR, FACTOR_OF_THREE = 30, 100


@functools.cache
def scene(name):
    return api.load(SYSTEMS / f"{name}.yaml").derive().equations


def coupled(n):
    """Springs between n masses whose coordinates are the distances between neighbours."""
    symbols = sp.symbols(f"m0:{n}", positive=True)
    x = [systems.coordinate(f"x{i}") for i in range(n)]
    masses = [systems.Parameter(str(m), m, 1.0, positive=True) for m in symbols]
    places = [sp.Add(*(c.q for c in x[: i + 1])) for i in range(n)]
    bodies = [(f"b{i}", m, (p, 0, 0)) for i, (m, p) in enumerate(zip(symbols, places, strict=True))]
    potential = sum((c.q - 1) ** 2 for c in x) / 2
    return systems.build("coupled", masses, x, bodies, potential)


NAMED = {
    "double_pendulum": lambda: scene("pendulums/double_pendulum"),
    "pendulum_on_cart": lambda: scene("pendulums/pendulum_on_cart"),
    "elastic_pendulum": lambda: scene("pendulums/elastic_pendulum"),
    "spherical_pendulum": lambda: scene("pendulums/spherical_pendulum"),
    "atwood": lambda: scene("pulleys/atwood"),
    "double_atwood": lambda: scene("pulleys/double_atwood"),
    "block_on_wedge": lambda: scene("sliding/block_on_wedge"),
    "heavy_top": lambda: scene("rigid/heavy_top"),
    "rigid_triangle": lambda: scene("lecture/rigid_triangle"),
    "driven_cart": systems.driven_cart,
    "expanded_double_pendulum": lambda: systems.pendulum_chain(2),
    "triple_pendulum": lambda: systems.collected_chain(3),
    "coupled": lambda: coupled(2),
}
INERTIAS = {"M", "m", *(f"{k}{i}" for k in "mI" for i in range(9))}


def python(equations):
    rhs = interpreted({"rhs": build_program(equations, ["acceleration"])})["rhs"]
    n = len(equations.system.coordinates)
    return lambda y, p: rhs(0.3, np.asarray(y), list(p))[n:]


def hard_states(equations, kind, count, seed=5):
    """States and parameters with inertias over 24 orders of magnitude.

    ``close``: all coordinates nearly equal; ``small``: all near zero.
    """
    random = np.random.default_rng(seed)
    n = len(equations.system.coordinates)
    heavy = [k for k, p in enumerate(equations.system.parameters) if p.name in INERTIAS]
    for _ in range(count):
        y = random.uniform(-2, 2, 2 * n)
        p = random.uniform(0.5, 2, len(equations.system.parameters))
        p[heavy] = 10.0 ** random.uniform(-12, 12, len(heavy))
        if kind == "close":
            y[1:n] = y[0] + 10.0 ** random.uniform(-14, -1, n - 1)
        if kind == "small":
            y[:n] *= 10.0 ** random.uniform(-12, -1)
        yield y.tolist(), p.tolist()


def undetermined(reference, y, p):
    """Exact accelerations, and what moving each input by its rounding error changes in them."""
    n = reference.n
    exact = reference.rhs(0.3, y, p)[n:]
    inputs = [mpmath.mpf(x) for x in (*y, *p)]
    change = [abs(x) * ROUNDING for x in exact]
    for k, x in enumerate(inputs):
        moved = [*inputs[:k], x * (1 + mpmath.mpf(ROUNDING)), *inputs[k + 1 :]]
        there = reference.rhs(0.3, moved[: 2 * n], moved[2 * n :])[n:]
        change = [c + abs(a - b) for c, a, b in zip(change, there, exact, strict=True)]
    return exact, change


def worst(equations, evaluate, kind, count=40):
    """Largest error of any acceleration, over what is undetermined of it or of the largest."""
    reference = Reference(equations)
    result = 0.0
    for y, p in hard_states(equations, kind, count):
        exact, change = undetermined(reference, y, p)
        floor = max(map(abs, exact)) * ROUNDING
        for got, a, c in zip(evaluate(y, p), exact, change, strict=True):
            assert math.isfinite(got)
            result = max(result, float(abs(mpmath.mpf(float(got)) - a) / (max(c, floor) or 1)))
    return result


@pytest.fixture(autouse=True)
def _digits(monkeypatch):
    monkeypatch.setattr("tests.emit.emit_reference.DIGITS", DIGITS)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["any", "close", "small"])
@pytest.mark.parametrize("name", NAMED)
def test_errors_are_those_of_the_data(name, kind):
    equations = NAMED[name]()
    bound = FACTOR_OF_THREE if len(equations.system.coordinates) > 2 else FACTOR
    assert worst(equations, python(equations), kind, 20) < bound


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("name", ["double_pendulum", "double_atwood", "triple_pendulum"])
def test_compiled_code_is_as_accurate(name, tmp_path):
    equations = NAMED[name]()
    compiled = Compiled(equations, tmp_path)
    n = len(equations.system.coordinates)

    def evaluate(y, p):
        status, dydt = compiled("rhs", 0.3, y, p, 2 * n)
        assert status == 0
        return dydt[n:]

    assert worst(equations, evaluate, "close") < FACTOR


def test_numerical_elimination_would_lose_the_digits(monkeypatch):
    """What the other tests would see without the exact solution."""
    monkeypatch.setattr("lagrange_cli.program.solvers.blocks.solve_exactly", lambda *_: None)
    equations = scene("pendulums/pendulum_on_cart")
    assert worst(equations, python(equations), "any") > 10 * FACTOR


# The solution itself.


def every_system():
    for path in sorted(SYSTEMS.glob("*/*.yaml")):
        if path.parent.name != "refused":
            yield path.stem, functools.partial(scene, f"{path.parent.name}/{path.stem}")
    for number, make in enumerate((*systems.ALL, lambda: coupled(3))):
        yield f"system {number}", make


def sliced_systems():
    """Systems as parameters; shipped scenes beside the slice are a campaign."""
    for name, make in every_system():
        # Its reference reads no inputs, which scenes of the slice with bodies have.
        chosen = name in set(SLICE) - {"cart_pole", "ballbot"} or name.startswith("system ")
        yield pytest.param(name, make, id=name, marks=() if chosen else pytest.mark.campaign)


def blocks_of(equations):
    return [b for b in build_program(equations, ["acceleration"]).blocks if len(b.coordinates) > 1]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "make"), list(sliced_systems()))
def test_the_exact_solution_solves_the_equations_and_its_pivots_hold_no_difference(name, make):
    equations = make()
    reference = Reference(equations)
    for block in blocks_of(equations):
        if not block.definite or len(block.coordinates) > 4:
            assert not block.exact
            continue
        of = block.coordinates
        solution = solve_exactly(
            [[equations.system.mass_matrix[i][j] for j in of] for i in of],
            [equations.system.forcing[i] for i in of],
            [c.q for c in equations.system.coordinates],
        )
        assert block.exact == (solution is not None)
        if solution is None:
            continue
        assert len(solution.pivots) == len(of)
        assert all(t.is_nonnegative for e in solution.pivots for t in sp.Add.make_args(e))
        for y, p in hard_states(equations, "any", 3):
            y = [abs(x) / 2 for x in y]  # where roots and logarithms are real
            exact = reference.rhs(0.3, y, p)[reference.n :]
            found = evaluated(solution, equations, y, p)
            for i, a in found.items():
                size = max(map(abs, exact))
                assert abs(a - exact[of[i]]) <= mpmath.mpf(10) ** -20 * size, name


def evaluated(solution, equations, y, p):
    """The accelerations that the steps give, in high precision."""
    n = len(equations.system.coordinates)
    symbols = [c.q for c in equations.system.coordinates] + [
        c.v for c in equations.system.coordinates
    ]
    symbols += [*(x.symbol for x in equations.system.parameters), equations.system.t]
    numbers = [*y[:n], *y[n:], *p, 0.3]
    found = {}
    with mpmath.workdps(DIGITS):
        point = [mpmath.mpf(x) for x in numbers]

        def value(expression):
            return sp.lambdify(symbols, expression, modules="mpmath", dummify=True)(*point)

        for step in solution.steps:
            rest = value(step.numerator)
            for other, coupling in step.coupling:
                rest -= value(coupling) * found[other]
            found[step.coordinate] = rest / value(step.denominator)
    return found


def test_what_is_too_long_or_not_proven_is_eliminated_numerically():
    (block,) = blocks_of(systems.collected_chain(4))
    assert block.unrolled
    assert not block.exact
    x, y = (systems.coordinate(name) for name in "xy")
    k = sp.Symbol("k", real=True)  # of unknown sign: 2 + k may be negative
    for mass in ([[2 + k, x.q], [x.q, 1]], [[1 + k, 1], [1, 2]]):
        assert solve_exactly(mass, [x.v, y.v], [x.q, y.q]) is None
    long = sp.Add(*(sp.Symbol(f"a{i}", positive=True) for i in range(300)))
    mass = [[long, sp.Integer(1)], [sp.Integer(1), long]]
    assert solve_exactly(mass, [x.v, y.v], [x.q, y.q]) is None


def test_a_wrong_solution_is_never_used(monkeypatch):
    equations = scene("pendulums/pendulum_on_cart")
    parts = (
        equations.system.mass_matrix,
        equations.system.forcing,
        [c.q for c in equations.system.coordinates],
    )
    monkeypatch.setattr(solving, "scaled", lambda number, rest: -number * rest)
    with pytest.raises(InternalError, match="does not solve"):
        solve_exactly(*parts)


def test_a_solution_that_no_point_confirms_is_not_used():
    x, y = (systems.coordinate(name) for name in "xy")
    nowhere = sp.sqrt(-1 - x.v**2)
    mass = [[sp.Integer(2), sp.Integer(1)], [sp.Integer(1), sp.Integer(1)]]
    assert solve_exactly(mass, [y.v, y.v], [x.q, y.q]) is not None
    assert solve_exactly(mass, [nowhere, y.v], [x.q, y.q]) is None


def test_squares_stay_squares_unless_products_must_be_multiplied_out():
    x, y = (systems.coordinate(name) for name in "xy")
    length, m, a = sp.symbols("l m a", positive=True)
    arm = length + x.q
    polar = [[2 * m, m * arm * sp.cos(y.q)], [m * arm * sp.cos(y.q), m * arm**2]]
    solution = solve_exactly(polar, [x.v, y.v], [x.q, y.q])
    assert any(arm**2 * m == pivot for pivot in solution.pivots)
    bowl = [[1 + a * x.q**2, a * x.q * y.q], [a * x.q * y.q, 1 + a * y.q**2]]
    solution = solve_exactly([[m * e for e in row] for row in bowl], [x.v, y.v], [x.q, y.q])
    assert sp.expand(solution.pivots[-1] - m**2 * (1 + a * x.q**2 + a * y.q**2)) == 0


# Singular or only ill-conditioned.


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("ratio", [1e-18, 1e-12, 1e12, 1e18])
def test_an_extreme_ratio_of_masses_is_not_singular(ratio, tmp_path):
    equations = changed(scene("pendulums/double_pendulum"), name="ratio")
    compiled, evaluate = Compiled(equations, tmp_path), python(equations)
    order = [p.name for p in equations.system.parameters]
    values = {"m1": 1.0, "m2": ratio, "l1": 1.0, "l2": 1.0, "g": 9.81}
    p = [values[name] for name in order]
    y = [1.0, 1.0, 0.0, 0.0]
    expected = [float(x) for x in Reference(equations).rhs(0.3, y, p)[2:]]
    status, dydt = compiled("rhs", 0.3, y, p, 4)
    assert status == 0
    assert dydt[2:] == pytest.approx(expected, rel=1e-15, abs=1e-15)
    assert evaluate(y, p) == pytest.approx(expected, rel=1e-15, abs=1e-15)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    ("name", "zero", "y"),
    [
        ("pendulums/double_pendulum", "m2", [0.3, 0.9, 0.0, 0.0]),
        ("pendulums/double_pendulum", "l1", [0.3, 0.9, 0.0, 0.0]),
        ("pendulums/double_pendulum", "l2", [0.3, 0.9, 0.0, 0.0]),
        ("pendulums/double_pendulum", "m1", [0.5, 0.5, 0.0, 0.0]),
        ("sliding/block_on_wedge", "m", [0.3, 0.9, 0.0, 0.0]),
        ("pulleys/double_atwood", "m2 m3", [0.3, 0.9, 0.0, 0.0]),
        ("rigid/heavy_top", "", [0.3, 0.0, 0.4, 0.1, 0.2, 0.3]),  # gimbal lock
        ("rigid/heavy_top", "I3", [0.3, 0.5, 0.4, 0.1, 0.2, 0.3]),
    ],
)
def test_a_singular_mass_matrix_is_refused(name, zero, y, tmp_path):
    equations = changed(scene(name), name="singular")
    p = [0.0 if x.name in zero.split() else 1.0 for x in equations.system.parameters]
    assert Compiled(equations, tmp_path)("rhs", 0.3, y, p, len(y))[0] == 1
    assert np.isnan(python(equations)(y, p)).all()


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize("light", [0.0, 1e-20, 1e-3])
def test_larger_blocks_are_judged_alike_in_python_and_c(light, tmp_path):
    """With its mass at the tip alone, a straight chain has inertia in one direction alone."""
    equations = systems.collected_chain(6)
    p = [
        light if x.name in ("m0", "m1", "m2", "m3", "m4") else 1.0
        for x in equations.system.parameters
    ]
    y = [*[0.5] * 6, *np.zeros(6)]
    got = python(equations)(y, p)
    status, dydt = Compiled(equations, tmp_path)("rhs", 0.3, y, p, 12)
    assert status == (0 if light > 1e-10 else 1)
    if status:
        assert np.isnan(got).all()
    else:
        assert got == pytest.approx(dydt[6:], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "bound"),
    [
        ("pendulums/double_pendulum", 35),
        ("pendulums/pendulum_on_cart", 18),
        ("sliding/block_on_wedge", 12),
        ("pulleys/double_atwood", 22),
        ("rigid/heavy_top", 26),
        ("lecture/rigid_tetrahedron", 22),
        ("lecture/rigid_triangle", 27),
    ],
)
def test_the_exact_solution_is_short(name, bound):
    assert count_operations(build_program(scene(name), ["acceleration"])).total <= bound
