"""Programs: equal in value to the equations, and short."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import mpmath
import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy.physics.mechanics import LagrangesMethod, dynamicsymbols

from lagrange_cli.errors import InternalError
from lagrange_cli.program.graph.operands import Constant, FunctionCall, Product, Sum, Variable
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import OUTPUTS, build_program
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import Reference, states
from tests.parts import changed

CALLS = {
    "abs": abs,
    "min": min,
    "max": max,
    "sign": mpmath.sign,
    "pow": mpmath.power,
}


def value(operand, known):
    """An independent interpreter of operands."""
    if isinstance(operand, Constant):
        return mpmath.mpf(operand.value.numerator) / operand.value.denominator
    if isinstance(operand, Variable):
        return known[operand.name]
    if isinstance(operand, Sum):
        return mpmath.fsum(value(Constant(c), known) * value(o, known) for c, o in operand.terms)
    if isinstance(operand, Product):
        over = mpmath.fprod(value(o, known) for o in operand.denominator)
        return mpmath.fprod(value(o, known) for o in operand.numerator) / over
    assert isinstance(operand, FunctionCall)
    function = CALLS.get(operand.function) or getattr(mpmath, operand.function)
    return function(*(value(a, known) for a in operand.arguments))


def run(program, t, y, p):
    """All outputs of a program, in high precision."""
    n = program.coordinates
    known = {"t": mpmath.mpf(t)}
    known |= {f"q{i}": mpmath.mpf(y[i]) for i in range(n)}
    known |= {f"v{i}": mpmath.mpf(y[n + i]) for i in range(n)}
    known |= {f"p{i}": mpmath.mpf(x) for i, x in enumerate(p)}
    for name, operand in program.assignments:
        assert name not in known
        known[name] = value(operand, known)
    return {name: [value(o, known) for o in of] for name, of in program.outputs}


x = sp.Symbol("x", real=True)


def one_coordinate(*expressions):
    """A system of the coordinate x whose Cartesian names are the given expressions."""
    names = tuple(
        systems.CartesianName(f"c{k}", sp.sympify(e), sp.Integer(0))
        for k, e in enumerate(expressions)
    )
    return changed(systems.bead_on_parabola(), cartesian_names=names)


@pytest.mark.slow
@pytest.mark.parametrize("make", systems.ALL)
def test_every_output_has_the_value_of_its_expression(make):
    equations = make()
    n = len(equations.system.coordinates)
    program = build_program(equations, list(OUTPUTS))
    reference = Reference(equations)
    for t, y, p in states(equations, count=3):
        with mpmath.workdps(40):
            got = run(program, t, y, p)
        full = reference.mass_matrix(t, y, p)
        expected = {
            "mass_matrix": [full[i * n + j] for i in range(n) for j in range(i, n)],
            "forcing": reference.forcing(t, y, p),
            "positions": reference.positions(t, y, p),
            "velocities": reference.velocities(t, y, p),
        }
        kinetic, potential, energy = reference.energy(t, y, p)
        expected |= {"kinetic": [kinetic], "potential": [potential], "energy": [energy]}
        for name, numbers in expected.items():
            scale = 1 + max(map(abs, numbers), default=0)
            for a, b in zip(got[name], numbers, strict=True):
                assert abs(a - b) < 1e-33 * scale, name


def test_momenta_are_the_derivatives_of_the_lagrangian_by_velocities():
    equations = systems.charged_particle()
    program = build_program(equations, ["momenta"])
    (t, y, p), *_ = states(equations, count=1)
    m, charge, field, _ = p
    expected = [
        m * y[3] - charge * field * y[1] / 2,
        m * y[4] + charge * field * y[0] / 2,
        m * y[5],
    ]
    assert [float(x) for x in run(program, t, y, p)["momenta"]] == pytest.approx(expected)


symbols = sp.symbols("x y z", real=True)
atoms = st.sampled_from([*symbols, *map(sp.Integer, (-2, 1, 3)), sp.Rational(1, 3), sp.pi])


def larger(children):
    pairs = st.tuples(children, children)
    return st.one_of(
        pairs.map(lambda ab: ab[0] + ab[1]),
        pairs.map(lambda ab: ab[0] * ab[1]),
        pairs.map(lambda ab: ab[0] - 2 * ab[1]),
        st.tuples(children, st.integers(-3, 5)).map(lambda be: (sp.cosh(be[0]) + 2) ** be[1]),
        children.map(sp.sin),
        children.map(lambda e: sp.cos(-3 * e)),
        children.map(lambda e: (sp.sin(e) + 2) ** sp.Rational(-3, 2)),
    )


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(st.lists(st.recursive(atoms, larger, max_leaves=12), min_size=1, max_size=5))
def test_sharing_and_factoring_change_no_value(expressions):
    base = systems.charged_particle()
    x, y, z = (c.q for c in base.system.coordinates)
    moved = [sp.sympify(e).subs(dict(zip(symbols, (x, y, z), strict=True))) for e in expressions]
    names = tuple(systems.CartesianName(f"c{k}", e, 0) for k, e in enumerate(moved))
    program = build_program(changed(base, cartesian_names=names), ["positions"])
    point = dict(
        zip((x, y, z), (sp.Rational(3, 10), sp.Rational(-7, 5), sp.Rational(9, 8)), strict=True)
    )
    with mpmath.workdps(300):  # a sine of 1e36 needs many
        state = [mpmath.mpf(v.p) / v.q for v in point.values()]
        got = run(program, 0, [*state, 0, 0, 0], (1, 1, 1, 1))["positions"]
        for expression, number in zip(moved, got, strict=True):
            exact = expression.evalf(50, subs=point)
            # Terms may cancel; what is left is judged against 1.
            assert abs(number - mpmath.mpf(str(exact))) <= mpmath.mpf(10) ** -35 * (1 + abs(number))


def count(*expressions):
    return count_operations(build_program(one_coordinate(*expressions), ["positions"]))


@pytest.mark.parametrize(
    ("expressions", "total"),
    [
        ([x**2], 1),
        ([x**3], 2),
        ([x**4], 2),
        ([x**8], 3),
        ([x**15], 6),
        ([1 / x**2], 2),
        ([x**2, x**3, x**4], 3),
        ([sp.sqrt(x**2 + 1)], 3),
        ([1 / sp.sqrt(x), x / sp.sqrt(x)], 2),
        ([sp.sin(x), sp.sin(-x), -sp.sin(x)], 3),
        ([sp.cos(x - 1), sp.cos(1 - x)], 2),
        ([x * sp.sin(x) + x * sp.cos(x)], 4),
        ([3 * x + 3 * sp.sin(x), x + sp.sin(x)], 3),
        ([sp.sqrt(2) * sp.pi * x], 1),
        ([x / 3 + 1, x / 3 - sp.sin(x), -x / 3], 5),
        ([sp.sin(x) ** 2 / x**2], 3),
        ([x**2 + x * sp.sin(x)], 3),
        ([sp.Integer(0), sp.Rational(3, 7), sp.pi / 2], 0),
    ],
)
def test_operations_of_small_expressions(expressions, total):
    assert count(*expressions).total == total


def test_small_integer_powers_never_call_pow():
    for power in range(-12, 13):
        program = build_program(one_coordinate(x**power), ["positions"])
        assert count_operations(program).calls == 0, power


@pytest.mark.parametrize("constant", [sp.exp(-(sp.Integer(10) ** 18)), sp.exp(sp.exp(-60) - 10**9)])
def test_constants_beyond_all_fractions_are_calls(constant):
    program = build_program(one_coordinate(x + constant), ["positions"])
    assert count_operations(program).calls > 0


def test_functions_of_one_argument_are_called_once():
    angles = [sp.sin(x), sp.cos(x), sp.sin(x) ** 2, x * sp.cos(x), sp.cos(-x) + sp.sin(x) * x]
    assert count(*angles).calls == 2


def test_parts_made_of_parameters_come_together():
    base = systems.pendulum_chain(2)
    _, m2, l1, l2, _ = (p.symbol for p in base.system.parameters)
    q1, q2 = (c.q for c in base.system.coordinates)
    rows = [m2 * l1 * l2 * sp.sin(q1), m2 * l1 * l2 * sp.cos(q2), m2 * l1 * l2 * q1 * q2]
    names = tuple(systems.CartesianName(f"c{k}", e, 0) for k, e in enumerate(rows))
    program = build_program(changed(base, cartesian_names=names), ["positions"])
    assert count_operations(program).multiplications == 2 + 1 + 1 + 2


def test_only_what_is_asked_for_is_computed():
    equations = systems.bead_on_parabola()
    assert build_program(equations, ["potential"]).reads == {"p0", "p1", "p2", "q0"}
    assert build_program(equations, ["mass_matrix"]).reads == {"p0", "p1", "q0"}


def test_blocks_follow_the_zeros_of_the_mass_matrix():
    hole = build_program(systems.simplified(systems.masses_through_hole()), ["acceleration"])
    assert [b.coordinates for b in hole.blocks] == [(0,), (1,)]
    charge = build_program(systems.charged_particle(), ["acceleration"])
    assert [b.coordinates for b in charge.blocks] == [(0,), (1,), (2,)]
    assert count_operations(charge).divisions <= 4
    chain = build_program(systems.collected_chain(8), ["acceleration"])
    assert [(len(b.coordinates), b.unrolled, b.definite) for b in chain.blocks] == [
        (8, False, True)
    ]
    (block,) = build_program(systems.indefinite(), ["acceleration"]).blocks
    assert not block.unrolled
    assert not block.definite


def test_a_proven_diagonal_matrix_needs_no_visible_zeros():
    equations = systems.bead_on_parabola()
    two = systems.pendulum_chain(2)
    diagonal = changed(two, facts=replace(two.derivation.facts, diagonal_mass_matrix=True))
    assert [b.coordinates for b in build_program(diagonal, ["acceleration"]).blocks] == [(0,), (1,)]
    assert count_operations(build_program(equations, ["acceleration"])).divisions == 1


def lagranges_method(n):
    """SymPy's own derivation of the n-link pendulum, after its own elimination."""
    q = dynamicsymbols(f"q:{n}")
    time = dynamicsymbols._t
    m, lengths, g = sp.symbols(f"m:{n}"), sp.symbols(f"l:{n}"), sp.Symbol("g")
    px = pz = lagrangian = sp.Integer(0)
    for i in range(n):
        px += lengths[i] * sp.sin(q[i])
        pz -= lengths[i] * sp.cos(q[i])
        lagrangian += m[i] * (px.diff(time) ** 2 + pz.diff(time) ** 2) / 2 - m[i] * g * pz
    method = LagrangesMethod(lagrangian, q)
    method.form_lagranges_equations()
    replaced, reduced = sp.cse([*method.mass_matrix, *method.forcing])
    return sum(sp.count_ops(e) for _, e in replaced) + sum(map(sp.count_ops, reduced))


@pytest.mark.slow
@pytest.mark.parametrize("n", [2, 3, pytest.param(4, marks=pytest.mark.campaign)])
def test_fewer_operations_than_lagranges_method_with_cse(n):
    expected = lagranges_method(n)
    outputs = ["mass_matrix", "forcing"]
    expanded = count_operations(build_program(systems.pendulum_chain(n), outputs)).total
    collected = count_operations(build_program(systems.collected_chain(n), outputs)).total
    assert expanded < expected
    assert collected < expected


@pytest.mark.slow
def test_operations_of_the_chain_grow_with_the_square():
    counts = {
        n: count_operations(
            build_program(systems.collected_chain(n), ["mass_matrix", "forcing"])
        ).total
        for n in (4, 8, 16, 32)
    }
    assert counts[16] <= 1700
    assert counts[32] / counts[16] < 4.1
    assert counts[16] / counts[8] < 4.1


@pytest.mark.parametrize(
    ("make", "bound"),
    [
        (systems.bead_on_parabola, 13),
        (systems.masses_through_hole, 21),
        (systems.driven_cart, 39),
        (systems.charged_particle, 19),
        (lambda: systems.pendulum_chain(2), 35),
        (lambda: systems.collected_chain(2), 35),
        (lambda: systems.collected_chain(3), 93),
    ],
)
def test_operations_of_one_right_hand_side(make, bound):
    assert count_operations(build_program(make(), ["acceleration"])).total <= bound


@pytest.mark.slow
def test_long_sums_are_added_in_groups():
    terms = sp.Add(*(sp.sin(k * x) for k in range(1, 601)))
    program = build_program(one_coordinate(terms), ["positions"])

    def widest(operand):
        if isinstance(operand, Sum):
            return max(len(operand.terms), *(widest(o) for _, o in operand.terms))
        return 0

    assert max(widest(operand) for _, operand in program.assignments) <= 24
    with mpmath.workdps(30):
        (got,) = run(program, 0, [0.7, 0], (1, 1, 1))["positions"]
        assert (
            abs(got - mpmath.fsum(mpmath.sin(k * mpmath.mpf(0.7)) for k in range(1, 601))) < 1e-25
        )


def test_deep_expressions_do_not_exhaust_the_stack():
    deep = x
    for _ in range(150):
        deep = sp.sin(deep) + x
    program = build_program(one_coordinate(deep), ["positions"])
    assert count_operations(program).calls == 150


@pytest.mark.parametrize(
    "expression",
    [
        sp.gamma(x),
        sp.Function("f")(x),
        sp.Piecewise((x, x > 0), (0, True)),
        sp.DiracDelta(x),
        sp.I * x,
        sp.zoo,
        sp.oo,
        sp.nan,
        sp.sqrt(-2) * x,
        sp.Symbol("stranger") * x,
        sp.Derivative(sp.Function("f")(x), x),
    ],
)
def test_what_cannot_be_printed_is_refused(expression):
    with pytest.raises(InternalError, match="no counterpart in emitted code"):
        build_program(one_coordinate(expression), ["positions"])


def test_irrational_constants_keep_fifty_digits():
    program = build_program(one_coordinate(sp.sqrt(2) * sp.exp(1)), ["positions"])
    ((_, (number,)),) = program.outputs
    assert isinstance(number, Constant)
    with mpmath.workdps(60):
        exact = mpmath.sqrt(2) * mpmath.e
        assert abs(value(number, {}) - exact) < mpmath.mpf(10) ** -49


def test_rational_constants_are_exact():
    program = build_program(one_coordinate(sp.Rational(981, 100) * x), ["positions"])
    ((_, (operand,)),) = program.outputs
    assert operand == Sum(((Fraction(981, 100), Variable("q0")),))


DUMP = """
import sys; sys.path.insert(0, sys.argv[1])
from tests.emit import emit_systems as systems
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.simulate.model.build import model_of
for make in systems.ALL:
    equations = make()
    print(model_of(equations).code.functions.text)
    for name in ("c", "python"):
        print(*EMITTERS[name].emit(equations).items())
"""


@pytest.mark.campaign
@pytest.mark.slow
def test_output_does_not_depend_on_the_hash_seed():
    outputs = []
    for seed in ("1", "2"):
        environment = os.environ | {"PYTHONHASHSEED": seed}
        folder = str(Path(systems.__file__).parents[2])
        done = subprocess.run(
            [sys.executable, "-c", DUMP, folder],
            env=environment,
            capture_output=True,
            check=True,
            timeout=120,
        )
        outputs.append(done.stdout)
    assert len(outputs[0]) > 10_000
    assert outputs[0] == outputs[1]
