"""Sums that are only sorted, beside those that SymPy makes."""

import random

import pytest
import sympy as sp

from lagrange_cli.mechanics.algebra.arithmetic import negative, plain_sum
from lagrange_cli.mechanics.algebra.substitution import Substitution

X, Y, Z = sp.symbols("x y z", real=True)
ATOMS = [X, Y, Z, *sp.symbols("theta_1:4", real=True), sp.pi, sp.sqrt(2), sp.E]
NUMBERS = [sp.S.Zero, sp.S.One, sp.S.NegativeOne, sp.Rational(1, 2), sp.Integer(-3)]


def expression(draw: random.Random, depth: int) -> sp.Expr:
    """A random expression; numbers stay in front of some sums."""
    kind = draw.random()
    if depth == 0 or kind < 0.2:
        return draw.choice([*ATOMS, *NUMBERS])
    parts = [expression(draw, depth - 1) for _ in range(draw.randint(1, 4))]
    if kind < 0.45:
        return sp.Add(*parts)
    if kind < 0.75:
        return sp.Mul(*parts[:3])
    if kind < 0.8 and parts[0].is_Add:
        return sp.Mul(draw.choice([2, -1]), parts[0], evaluate=False)
    if kind < 0.88:
        return parts[0] ** draw.choice([2, -1, sp.Rational(1, 2)])
    return draw.choice([sp.sin, sp.cos, sp.exp, sp.Abs, sp.sign])(parts[0])


def terms(draw: random.Random) -> list[sp.Expr]:
    """Terms some of which are like others, or cancel."""
    drawn = [expression(draw, 3) for _ in range(draw.randint(0, 6))]
    drawn += [-e for e in drawn[:2] if draw.random() < 0.3]
    drawn += [2 * e for e in drawn[1:3] if draw.random() < 0.3]
    return [e for e in drawn if not e.has(sp.zoo, sp.nan, sp.oo)]


def same(ours: sp.Expr, sympys: sp.Expr) -> bool:
    return sp.srepr(ours) == sp.srepr(sympys) and hash(ours) == hash(sympys)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_sums_are_those_of_sympy(seed: int) -> None:
    draw = random.Random(seed)
    for _ in range(300):
        added = terms(draw)
        assert same(plain_sum(added), sp.Add(*added)), added


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_negatives_and_substitutions_are_those_of_sympy(seed: int) -> None:
    draw = random.Random(seed)
    values = {X: Y - sp.sin(Z), Z: sp.Add(*ATOMS), ATOMS[3]: sp.S.Zero}
    for _ in range(150):
        whole = sp.Add(*terms(draw))
        assert same(negative(whole), -whole), whole
        replaced = whole.xreplace(values)
        if not replaced.has(sp.zoo, sp.nan, sp.oo):
            assert same(Substitution(values).put_into(whole), replaced), whole


def test_terms_that_are_alone_stay_the_same_objects() -> None:
    product = 2 * X * sp.sin(Y)
    assert plain_sum([product, Z]).args[1] is product or plain_sum([product, Z]).args[0] is product


def test_what_sympy_evaluates_further_is_left_to_it() -> None:
    """Infinities that cancel are no number; products in products are one product."""
    nested = sp.Mul(2, sp.Mul(X, Y), evaluate=False)
    number = sp.Mul(2, sp.Integer(3), evaluate=False)
    for added in ([sp.oo * X, -sp.oo * X], [nested, X * Y], [number, X]):
        assert same(plain_sum(added), sp.Add(*added)), added


def test_long_sums_are_sorted_as_sympy_does() -> None:
    angles = sp.symbols("q_1:40", real=True)
    parts = [
        X**2 * sp.cos(a - b) * c for a, b, c in zip(angles, angles[1:], angles[:0:-1], strict=False)
    ]
    random.Random(0).shuffle(parts)
    assert same(plain_sum(parts), sp.Add(*parts))
