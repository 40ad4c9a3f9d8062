"""Whatever is wrong with a gap, its certificate does not pass."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.errors import InputError, InternalError
from lagrange_cli.mechanics import derive_uncertified, reduce
from lagrange_cli.mechanics.certify.certificate import certify
from lagrange_cli.mechanics.certify.printed import certify_shown
from lagrange_cli.mechanics.dynamics.lagrange import Uncertified
from lagrange_cli.mechanics.dynamics.textbook_form import shown_equations
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.scene import read_text
from tests.mechanics.mechanics_support import derived, few

#: Particles of which definitions, a point that moves, t and a closure take part in gaps.
SCENE = """
parameters: {m: 2, k: 3, A: 0.5, w: 2, R: 4}
particles:
  puck: {mass: m, position: [r*cos(theta), r*sin(theta), z]}
  bead: {mass: m, position: [x, y, 0]}
points: {hand: [A*cos(w*t), A*sin(w*t), 0]}
constraints:
  wire: x^2 + y^4 = R^2
  wave: z >= A*sin(w*t - r)
  rope: (x - x_hand)^2 + (y - y_hand)^2 <= 9*R^2
  apart: (x - x_puck)^2 + (y - y_puck)^2 >= A^2
coordinates: [r, theta, z, x, y]
potentials: {spring: k*r^2/2}
near: {r: 1, theta: 0.3, z: 2, x: 4, y: 0}
"""


@cache
def derivation() -> Uncertified:
    return derive_uncertified(reduce(read_text("name: tested\n" + SCENE)))


def with_gap(number: int, **changed: object) -> Uncertified:
    right = derivation()
    contacts = list(right.contacts)
    closure = replace(contacts[number].closure, **changed)
    contacts[number] = replace(contacts[number], closure=closure)
    return replace(right, contacts=tuple(contacts))


def require_caught(wrong: Uncertified) -> None:
    with pytest.raises(InternalError) as caught:
        certify(wrong, 30, 3)
    assert caught.value.exit_code == 3


def test_what_is_right_passes() -> None:
    right = derivation()
    assert [c.name for c in right.closures] == ["wire"]
    assert [c.name for c in right.contacts] == ["wave", "rope", "apart"]
    certificate = certify(right, 30, 3).certificate
    assert certificate.mismatch < 1e-29


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("part", ["rate", "bias", "expression"])
def test_wrong_rate_bias_or_gap(number: int, part: str) -> None:
    value = getattr(derivation().contacts[number].closure, part)
    factors = (1 + sp.Rational(1, 10**18),) if value == 0 else (1 + sp.Rational(1, 10**18), -1)
    for factor in factors:
        wrong = value * factor if value != 0 else sp.Rational(1, 10**18)
        require_caught(with_gap(number, **{part: wrong}))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
def test_a_gap_is_no_other_by_a_constant(number: int) -> None:
    """An offset changes no derivative, only where contact is made."""
    gap = derivation().contacts[number].closure.expression
    require_caught(with_gap(number, expression=gap + sp.Rational(1, 10**15)))


@pytest.mark.slow
@pytest.mark.parametrize("number", range(3))
@pytest.mark.parametrize("change", ["sign", "digit", "missing", "added"])
def test_wrong_gradient(number: int, change: str) -> None:
    closure = derivation().contacts[number].closure
    row = {j: closure.gradient[j] for j in closure.coordinate_numbers}
    first = min(row)
    if change == "missing":
        del row[first]
    elif change == "added":
        row[next(j for j in range(6) if j not in row) % 5] = sp.Rational(1, 10**12)
    else:
        row[first] *= -1 if change == "sign" else 1 + sp.Rational(1, 10**18)
    require_caught(with_gap(number, gradient=ExpressionRow(5, row)))


def test_contacts_in_the_wrong_order() -> None:
    right = derivation()
    require_caught(replace(right, contacts=right.contacts[::-1]))


@pytest.mark.parametrize("number", range(3))
def test_shown_equations_must_hold_what_contacts_exert(number: int) -> None:
    right = derivation()
    evidence = certify(right, 30, 1)
    shown = shown_equations(right, [False] * 5, None)
    certify_shown(evidence, shown)
    push = right.contacts[number].closure.multiplier
    (row,) = [s for s in shown if any(f == push for _, f in s.terms)][:1]
    for terms in (
        tuple((c, f) for c, f in row.terms if f != push),
        tuple((-c if f == push else c, f) for c, f in row.terms),
    ):
        wrong = [replace(s, terms=terms) if s is row else s for s in shown]
        with pytest.raises(InternalError):
            certify_shown(evidence, wrong)


_SIDES = st.sampled_from(["x", "z - t", "2*sin(x)", "x*z + 1", "exp(z)", "x^2/(1 + z^2)", "3"])


@pytest.mark.slow
@few
@given(left=_SIDES, right=_SIDES)
def test_both_ways_of_writing_say_the_same(left: str, right: str) -> None:
    text = "particles: {p: {mass: 1, position: [x, 0, z]}}\nconstraints: {c: 'THIS'}\n"
    try:
        one = derived(text.replace("THIS", f"{left} >= {right}"))
    except InputError:
        with pytest.raises(InputError):
            derived(text.replace("THIS", f"{right} <= {left}"))
        return
    other = derived(text.replace("THIS", f"{right} <= {left}"))
    turned = derived(text.replace("THIS", f"-({right}) >= -({left})"))
    for e in (other, turned):
        ours, theirs = one.system.contacts[0].closure, e.system.contacts[0].closure
        assert sp.expand(ours.expression - theirs.expression) == 0
        assert [sp.expand(ours.gradient[j] - theirs.gradient[j]) for j in range(2)] == [0, 0]
