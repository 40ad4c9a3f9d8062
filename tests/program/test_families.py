"""Order of the statements of large programs, and angles taken apart."""

from __future__ import annotations

from fractions import Fraction

import mpmath
import pytest
import sympy as sp

from lagrange_cli.program.graph.operands import FunctionCall, Product, Sum, Variable, variables
from lagrange_cli.program.graph.statement_groups import grouped_by_shape, in_canonical_order
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from tests.emit import emit_systems as systems
from tests.emit.emit_reference import Reference, states
from tests.parts import changed
from tests.program.test_program import one_coordinate, run, x


def w(number):
    return Variable(f"w{number}")


def plus(*parts):
    return Sum(tuple((Fraction(1), part) for part in parts))


def test_families_stand_together_and_keep_what_they_need():
    # s_k = sin q_k, then p_k s_k, interleaved; a running sum over the products.
    assignments = []
    for k in range(9):
        assignments.append((f"w{3 * k}", FunctionCall("sin", (Variable(f"q{k}"),))))
        assignments.append((f"w{3 * k + 1}", Product((w(3 * k), Variable(f"p{k}")), ())))
        before = w(3 * k - 1) if k else Variable("t")
        assignments.append((f"w{3 * k + 2}", plus(before, w(3 * k + 1))))
    grouped, new = grouped_by_shape(assignments)
    assert [name for name, _ in grouped] == [f"w{k}" for k in range(27)]
    seen = set()
    for name, operand in grouped:
        assert {v.name for v in variables(operand) if v.name[0] == "w"} <= seen
        seen.add(name)
    kinds = [type(operand) for _, operand in grouped]
    assert kinds == [FunctionCall] * 9 + [Product] * 9 + [Sum] * 9
    assert new["w0"] == w(0)
    assert new["w26"] == w(26)
    assert [operand.arguments[0].name for _, operand in grouped[:9]] == [f"q{k}" for k in range(9)]


def test_terms_and_factors_are_ordered_by_form_and_number():
    a, b, c = (Variable(f"q{k}") for k in (2, 10, 1))
    assert in_canonical_order(Product((b, a, c), ())) == Product((c, a, b), ())
    assert in_canonical_order(plus(b, Product((b, a), ()), c)) == plus(Product((a, b), ()), c, b)
    minus = Sum(((Fraction(-1), a), (Fraction(1), b)))
    assert in_canonical_order(minus).terms[0] == (Fraction(1), b)  # a positive term leads


@pytest.mark.slow
@pytest.mark.parametrize("n", [8, 13])
def test_large_programs_keep_their_values(n):
    equations = systems.collected_chain(n)
    program = build_program(equations, ["mass_matrix", "forcing", "energy", "positions"])
    assert program.is_large
    reference = Reference(equations)
    ((t, y, p),) = states(equations, count=1)
    with mpmath.workdps(40):
        got = run(program, t, y, p)
    full = reference.mass_matrix(t, y, p)
    upper = [full[i * n + j] for i in range(n) for j in range(i, n)]
    forcing = reference.forcing(t, y, p)
    for numbers, expected in ((got["mass_matrix"], upper), (got["forcing"], forcing)):
        assert max(abs(a - b) for a, b in zip(numbers, expected, strict=True)) < 1e-32


def of_differences(count):
    """Sines and cosines of the differences and sums of some angles, and the angles' names."""
    base = systems.charged_particle()
    angles = [systems.coordinate(f"a{k}") for k in range(count)]
    found = [
        f(a.q + sign * b.q)
        for k, a in enumerate(angles)
        for b in angles[:k]
        for f, sign in ((sp.sin, -1), (sp.cos, -1), (sp.sin, 1))
    ]
    cartesian = tuple(systems.CartesianName(f"c{k}", e, 0) for k, e in enumerate(found))
    return changed(base, coordinates=tuple(angles), cartesian_names=cartesian)


def test_few_differences_keep_their_own_sines():
    program = build_program(of_differences(3), ["positions"])
    assert count_operations(program).calls == 9
    assert count_operations(program).multiplications == 0


def test_many_differences_of_few_angles_become_products():
    equations = of_differences(12)
    program = build_program(equations, ["positions"])
    assert count_operations(program).calls == 24
    state = [mpmath.mpf(k * k - 20) / 7 for k in range(12)]
    with mpmath.workdps(40):
        got = run(program, 0, [*state, *state], (1, 1, 1, 1))["positions"]
        known = dict(zip((c.q for c in equations.system.coordinates), state, strict=True))
        for number, name in zip(got, equations.system.cartesian_names, strict=True):
            exact = mpmath.mpf(str(name.position.evalf(45, subs=known)))
            assert abs(number - exact) < mpmath.mpf(10) ** -35


def test_sums_within_sums_are_computed_once():
    names = sp.symbols("a:30")
    base = one_coordinate(x)
    parameters = [systems.parameter(str(s), 1.0) for s in names]
    masses = [p.symbol for p in parameters]
    tails = [sp.Add(*masses[k:]) * sp.sin((k + 1) * x) for k in range(29)]
    tails += [-3 * sp.Add(*masses[k:]) * sp.cos((k + 1) * x) for k in range(29)]
    cartesian = tuple(systems.CartesianName(f"c{k}", e, 0) for k, e in enumerate(tails))
    equations = changed(base, parameters=tuple(parameters), cartesian_names=cartesian)
    assert count_operations(build_program(equations, ["positions"])).additions == 29
