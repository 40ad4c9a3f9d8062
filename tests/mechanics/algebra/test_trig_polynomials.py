"""Trigonometric polynomials: identities are found, values never change."""

import pytest
import sympy as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from sympy import cos, sin

from lagrange_cli.mechanics.algebra.collect import Splitter, sympy_rational, trig_factors
from lagrange_cli.mechanics.algebra.trig_polynomials import refined

a, b, c = sp.symbols("a b c", real=True)
ARGUMENTS = {a, b, c, a - b, a - c, b - c}


def refine(expression, arguments=ARGUMENTS):
    """An expression through its map of monomials."""
    splitter = Splitter()
    polynomial = {}
    for term in sp.Add.make_args(expression):
        split = splitter.split(term)
        polynomial[splitter.canonical(split.trig)] = split.number
    found = refined(polynomial, arguments)
    return sp.Add(*(sp.Mul(sympy_rational(n), *trig_factors(m)) for m, n in found.items()))


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        (sin(a - b) + sin(b) * cos(a) - sin(a) * cos(b), 0),
        (sin(a) ** 4 + 2 * sin(a) ** 2 * cos(a) ** 2 + cos(a) ** 4, 1),
        (1 - cos(a) ** 2, sin(a) ** 2),
        (3 * sin(a) - 4 * sin(a) ** 3 - sin(a) + 2 * sin(a) * cos(a) ** 2, None),
        (sin(a) - cos(a - b) * sin(b), sin(a - b) * cos(b)),
        (sin(a - c) - cos(a - b) * sin(b - c), sin(a - b) * cos(b - c)),
        (cos(a - b) - cos(a - c) * cos(b - c), sin(a - c) * sin(b - c)),
        (
            sin(a - c) ** 2 + sin(b - c) ** 2 - 2 * cos(a - b) * sin(a - c) * sin(b - c),
            sin(a - b) ** 2,
        ),
        (2 * cos(a) ** 2 - sin(a) ** 2, None),  # negative at some angles
        (5 * cos(a) ** 2 - 1, None),
        (3 - sin(a) ** 2 - sin(b) ** 2, 1 + cos(a) ** 2 + cos(b) ** 2),
        (1 + sin(a) ** 2, None),  # is a sum of squares
        (sin(a) * cos(b) + cos(a) * sin(b), None),  # sin(a + b) is not among the arguments
    ],
)
def test_hidden_identities(written, expected):
    found = refine(written)
    assert found == (written if expected is None else expected)
    assert sp.expand_trig(found - written).rewrite(sp.exp).expand() == 0


factors = st.sampled_from([f(x) for f in (sin, cos) for x in sorted(ARGUMENTS, key=str)])
monomials = st.lists(factors, max_size=4).map(lambda of: sp.Mul(*of))
polynomials = st.lists(
    st.tuples(st.integers(-3, 3), monomials).map(lambda t: t[0] * t[1]), min_size=1, max_size=5
)


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(polynomials)
def test_values_do_not_change_and_no_argument_is_new(terms):
    written = sp.Add(*terms)
    found = refine(written)
    for at in ({a: 0.3, b: -1.1, c: 2.4}, {a: -0.7, b: 0.2, c: 0.9}):
        assert abs((found - written).subs(at).evalf()) < 1e-12
    assert {f.args[0] for f in found.atoms(sin, cos)} <= ARGUMENTS


def test_quotients_and_high_powers_are_left_alone():
    for kept in (sp.tan(a) + sin(b), sin(a) ** 9 - sin(a) ** 9 * cos(b) ** 2):
        assert refine(kept) == kept
