"""Infeasible one-sided constraints: refused with proof, or as not found by a search."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st

from lagrange_cli.mechanics.contacts import infeasible
from lagrange_cli.mechanics.proofs.farkas import false_sum
from tests.mechanics.mechanics_support import derived, generated, refusal

pytestmark = pytest.mark.slow

P = "particles: {p: {mass: 1, position: [x, y, z]}}\n"
SUM = "contradict each other: their sum"


@pytest.mark.parametrize(
    ("constraints", "message"),
    [
        ("ball: x^2+y^2+z^2 = 1, shelf: z >= 2", "where 'ball' holds, z is at most 1"),
        ("a: x >= 2, b: x <= 1, c: y >= 0", f"'a', 'b' {SUM} a + b says 0 >= 1"),
        ("a: x + y >= 3, b: x <= 1, c: y <= 1, d: z >= 0", f"'b', 'c' {SUM} a + b + c says 0 >= 1"),
        ("a: 2*x >= 4, b: x <= 1", f"{SUM} a + 2*b says 0 >= 2"),
        ("wall: x = 3, stop: x <= 1", None),
        ("wall: x + y = 3, stop: x + y <= 1", None),
        ("s: sin(x) >= 2", "constraint 's' cannot hold: it says 0 >= 1, as sin(x) <= 1"),
        (
            "s: z = sin(x), t: z >= 2, u: y >= 0",
            f"'s', 't' {SUM} t - s says 0 >= 1, as sin(x) <= 1",
        ),
        ("in: x^2+y^2 <= 1, out: x^2+y^2 >= 4", f"{SUM} in + out says 0 >= 3"),
        ("s: x*y >= 3, t: x^2+y^2 <= 1", "where 's' holds, x^2 + y^2 is at least 6"),
        ("a: x >= y + 1, b: y >= z + 1, c: z >= x", f"{SUM} a + b + c says 0 >= 2"),
        ("a: x >= exp(y), b: x <= -1", f"{SUM} a + b says 0 >= 1, as exp(y) > 0"),
        ("a: x >= 1, b: 'x^3 <= 0'", "no real x satisfies them"),
        ("a: x >= t + 2, b: x <= t + 1", f"{SUM} a + b says 0 >= 1"),
        ("a: x >= 1e16, b: x <= 0", f"{SUM} a + b says 0 >= 1e+16"),
        ("a: 'norm(x, y, z) <= 1', b: z >= 3", "where 'a' holds, z is at most 1"),
        ("a: (x-3)^2+y^2 <= 1, b: (x+3)^2+y^2 <= 1", "as x^2 >= 0, y^2 >= 0"),
        ("a: z >= 1 + x^2, b: z <= -x^2", f"{SUM} a + b says 0 >= 1, as x^2 >= 0"),
        ("a: x*sin(y) >= 2, b: x^2 <= 1", "where 'a' holds, x^2 is at least 4"),
        ("box: [x >= 2, x <= 1]", f"'box_1', 'box_2' {SUM} box_1 + box_2 says 0 >= 1"),
        (
            "flat: y = 0, ring: x^2 + z^2 = 4, one: x >= 1.9, two: z >= 1.9",
            "constraints 'ring', 'one', 'two' contradict each other",
        ),
    ],
)
def test_a_smallest_set_is_named_with_its_proof(constraints: str, message: str | None) -> None:
    problem = refusal(P + f"constraints: {{{constraints}}}\n")
    if message is None:  # a gap that no motion changes has a message of its own
        assert (
            problem.message == "the one-sided constraint 'stop' is violated at every configuration"
        )
        return
    assert problem.rule == "inconsistent"
    assert message in problem.message
    assert problem.hint.startswith("leave out '")


def test_parameters_without_a_value() -> None:
    text = "parameters: {a: {%s}}\n" + P + "constraints: {u: x >= a, v: x <= -a}\n"
    assert refusal(text % "positive: true").message.endswith("u + v says -2*a >= 0, as a > 0")
    assert len(derived(text % "").system.contacts) == 2


def test_at_the_values_of_parameters() -> None:
    text = (
        "parameters: {l: 1, h: %s}\n"
        + P
        + "constraints: {rope: 'norm(x, y, z) <= l', shelf: z >= h}\n"
    )
    assert "where 'rope' holds, z is at most 1" in refusal(text % 2).message
    assert len(derived(text % 0.5).system.contacts) == 2


def test_ropes_that_do_not_reach() -> None:
    text = (
        "plane: xz\npoints: {o: [0, 0, 0], e: [5, 0, 0]}\n"
        "particles: {a: {mass: 1}, b: {mass: 1}}\nconstraints:\n"
        "  one: 'norm(x_a, z_a) <= 1'\n  two: 'norm(x_b - x_a, z_b - z_a) <= %s'\n"
        "  three: 'norm(x_b - 5, z_b) <= 1'\n"
    )
    assert "constraints 'one', 'two', 'three' contradict each other" in refusal(text % 2).message
    assert len(derived(text % 3.5).system.contacts) == 3


def test_many_of_a_family() -> None:
    """Too many for anything but their sum: every bead is a step to the right of the one before."""
    text = """
sizes: {n: 60}
particles:
  p[i=1..n]: {mass: 1, position: ["x[i]", 0, 0]}
constraints:
  apart[i=2..n]: "x[i] - x[i-1] >= 1"
  left: "x[1] >= 0"
  right: "x[60] <= %s"
"""
    message = refusal(text % 58).message
    assert "(61 in all) contradict each other: their sum says 0 >= 1" in message
    assert len(derived(text % 60).system.contacts) == 61


def test_what_is_searched_for_only() -> None:
    constraints = (
        "one: y = exp(x) + sin(z), two: exp(2*x) + cos(z) + y >= 3, three: y <= -0.5,"
        " four: exp(x)*y >= 7"
    )
    message = refusal(P + f"constraints: {{{constraints}}}\n").message
    assert "no configuration found in 48 starts that satisfies" in message
    assert "contradict" not in message


@pytest.mark.parametrize(
    "constraints",
    [
        "a: x >= 0, b: x <= 0",
        "a: x >= 2 - t, b: x <= 1",
        "ball: x^2+y^2+z^2 = 1, shelf: z >= 1 - 1e-7",
        "in: x^2+y^2 <= 4.0001, out: x^2+y^2 >= 4",
        "a: x >= 1e9, b: y <= -1e9",
        "a: x >= 1e-9, b: x <= 2e-9",
        "a: x*y*z >= 1000, b: x + y + z <= -10",
        "a: sin(x) >= 0.999, b: x >= 100, c: x <= 107",
        "a: z >= x^2, b: z <= 1 + x, c: x >= 1.6",
        "a: 'norm(x - 3, y) <= 2.0001', b: 'norm(x + 1, y) <= 2.0001'",
    ],
)
def test_where_there_is_room(constraints: str) -> None:
    assert derived(P + f"constraints: {{{constraints}}}\n").system.contacts


def test_no_proof_is_sought_where_a_configuration_is_at_hand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def unneeded(*_: object) -> None:
        pytest.fail("a proof was sought")

    monkeypatch.setattr(infeasible, "false_sum", unneeded)
    assert derived(P + "constraints: {shelf: z >= 0}\n").system.contacts


@generated
@given(
    st.lists(
        st.tuples(st.lists(st.integers(-3, 3), min_size=3, max_size=3), st.integers(-4, 4)),
        min_size=2,
        max_size=6,
    )
)
def test_sums_against_linear_programming(rows: list[tuple[list[int], int]]) -> None:
    """A sum is found where SciPy finds no point, and no row of it can be left out."""
    from scipy.optimize import linprog

    def empty(chosen: list[tuple[list[int], int]]) -> bool:
        a, b = [[-x for x in r] for r, _ in chosen], [c for _, c in chosen]
        found = linprog([0, 0, 0], A_ub=a, b_ub=b, bounds=[(None, None)] * 3)
        return found.status == 2

    names = sp.symbols("x y z", real=True)
    phis = [sum((a * s for a, s in zip(r, names, strict=True)), sp.Integer(c)) for r, c in rows]
    with mpmath.workdps(50):
        total = false_sum([(phi, True) for phi in phis], {})
    assert (total is not None) == empty(rows)
    if total is not None:
        left = sum(sp.Float(x, 40) * phis[k] for k, x in total.shares.items())
        remainder = sp.Poly(left + sp.Float(total.shortfall, 40), *names).coeffs()
        assert max(map(abs, remainder)) < 1e-20 * max(total.shares.values())
        part = [rows[k] for k in total.shares]
        assert len(part) == 1 or not any(empty([r for r in part if r is not one]) for one in part)
