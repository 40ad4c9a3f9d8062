"""Tapes against mpmath's own series and numerical derivatives, in high precision."""

from __future__ import annotations

import mpmath
import pytest
import sympy as sp
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mpf

from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate
from tests.mechanics.mechanics_support import generated

x, y, z = sp.symbols("x y z", real=True)
ZERO = mpf(0)

UNARY = {
    "sin": (sp.sin, mpmath.sin, "0.7"),
    "cos": (sp.cos, mpmath.cos, "0.7"),
    "tan": (sp.tan, mpmath.tan, "-1.3"),
    "asin": (sp.asin, mpmath.asin, "-0.4"),
    "acos": (sp.acos, mpmath.acos, "0.4"),
    "atan": (sp.atan, mpmath.atan, "-2.5"),
    "sinh": (sp.sinh, mpmath.sinh, "1.2"),
    "cosh": (sp.cosh, mpmath.cosh, "-1.2"),
    "tanh": (sp.tanh, mpmath.tanh, "0.3"),
    "asinh": (sp.asinh, mpmath.asinh, "-1.7"),
    "acosh": (sp.acosh, mpmath.acosh, "1.7"),
    "atanh": (sp.atanh, mpmath.atanh, "0.6"),
    "exp": (sp.exp, mpmath.exp, "-1.1"),
    "log": (sp.log, mpmath.log, "2.3"),
    "abs": (sp.Abs, abs, "-2.3"),
    "sign": (sp.sign, mpmath.sign, "-2.3"),
    "sqrt": (sp.sqrt, mpmath.sqrt, "2.3"),
    "inverse root": (lambda u: u ** sp.Rational(-1, 2), lambda u: 1 / mpmath.sqrt(u), "2.3"),
    "power 3/2": (lambda u: u ** sp.Rational(3, 2), lambda u: u ** mpf("1.5"), "0.8"),
    "cube root": (lambda u: u ** sp.Rational(1, 3), mpmath.cbrt, "0.8"),
    "square": (lambda u: u**2, lambda u: u**2, "-3.1"),
    "fifth power": (lambda u: u**5, lambda u: u**5, "-3.1"),
    "inverse cube": (lambda u: u**-3, lambda u: u**-3, "-3.1"),
    "2^u": (lambda u: 2**u, lambda u: mpf(2) ** u, "0.9"),
    "u^u": (lambda u: u**u, lambda u: u**u, "0.9"),
}


def close(found: mpf, expected: mpf, digits: int) -> bool:
    scale = max(abs(expected), mpf(1))
    return bool(abs(found - expected) <= mpf(10) ** -digits * scale)


@pytest.mark.parametrize("name", UNARY)
def test_value_first_and_second_derivative_along_a_curve(name: str) -> None:
    symbolic, numeric, at = UNARY[name]
    with mpmath.workdps(50):
        u0, u1, u2 = mpf(at), mpf("0.37"), mpf("-0.81")
        (found,) = Tape([symbolic(x)], [x]).run([(u0, u1, u2)]).outputs
        with mpmath.workdps(90):
            c = mpmath.taylor(lambda s: numeric(u0 + u1 * s + u2 * s * s / 2), 0, 2)
        for mine, theirs in zip(found, (c[0], c[1], 2 * c[2]), strict=True):
            assert close(mine, theirs, 40)


@pytest.mark.parametrize("name", UNARY)
def test_gradient_and_its_rate(name: str) -> None:
    symbolic, numeric, at = UNARY[name]
    with mpmath.workdps(50):
        u0, u1 = mpf(at), mpf("0.37")
        run = Tape([symbolic(x)], [x]).run([(u0, u1, ZERO)], order=1)
        ((slope, rate),) = run.moving_gradient()
        assert close(run.gradient({0: mpf("1.3")})[0], mpf("1.3") * slope, 48)
        with mpmath.workdps(90):
            first, second = (mpmath.diff(numeric, u0, k) for k in (1, 2))
        assert close(slope, first, 38)
        assert close(rate, second * u1, 38)


@pytest.mark.parametrize("name", UNARY)
def test_a_run_of_values_alone_gives_the_same_gradient(name: str) -> None:
    symbolic, _, at = UNARY[name]
    outputs = [symbolic(x) * y, sp.atan2(y, x) + z**2 * x, sp.Max(x, y) + sp.Min(z, y) * x]
    with mpmath.workdps(50):
        place = [(mpf(u), ZERO, ZERO) for u in (at, "1.3", "-0.2")]
        tape = Tape(outputs, [x, y, z])
        for k in range(len(outputs)):
            alone, along = (tape.run(place, order=order).moving_gradient(k) for order in (0, 1))
            for (found, rate), (known, change) in zip(alone, along, strict=True):
                assert close(found, known, 48)
                assert rate == change == 0


@pytest.mark.parametrize("place", [(1, 2), (-1, 2), (-1, -2), (1, -2), (0, -2), (3, 0)])
def test_atan2_in_every_quadrant(place: tuple[int, int]) -> None:
    with mpmath.workdps(50):
        ys, xs = [(mpf(p), mpf("0.3"), mpf("0.7") * p) for p in place]
        run = Tape([sp.atan2(y, x)], [y, x]).run([ys, xs])
        with mpmath.workdps(90):

            def turned(s: mpf) -> mpf:
                """The angle from the start, so that the cut is far away."""
                y_s, x_s = (c[0] + c[1] * s + c[2] * s * s / 2 for c in (ys, xs))
                return mpmath.arg(mpmath.mpc(x_s, y_s) / mpmath.mpc(xs[0], ys[0]))

            rates = [mpmath.diff(turned, 0, k) for k in (1, 2)]
            derivatives = [mpmath.atan2(ys[0], xs[0]), *rates]
        for mine, theirs in zip(run.outputs[0], derivatives, strict=True):
            assert close(mine, theirs, 35)
        gradient = run.gradient({0: mpf(1)})
        r2 = mpf(place[0]) ** 2 + mpf(place[1]) ** 2
        assert close(gradient[0], place[1] / r2, 45)
        assert close(gradient[1], -place[0] / r2, 45)


def test_min_and_max_take_the_branch_that_holds() -> None:
    with mpmath.workdps(40):
        inputs = [(mpf(2), mpf(3), mpf(5)), (mpf(7), mpf(11), mpf(13))]
        run = Tape([sp.Min(x, y), sp.Max(x, y), sp.Max(x, 5)], [x, y]).run(inputs)
        assert run.outputs[0] == inputs[0]
        assert run.outputs[1] == inputs[1]
        assert run.outputs[2] == (5, 0, 0)
        assert run.gradient({0: mpf(1)}) == [1, 0]


ATOMS = [x, y, z, sp.Integer(2), sp.Rational(-3, 7), sp.pi, sp.sqrt(2)]
EXPRESSIONS = st.recursive(
    st.sampled_from(ATOMS),
    lambda inner: st.one_of(
        st.tuples(inner, inner).map(lambda p: p[0] + p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] * p[1]),
        st.tuples(inner, inner).map(lambda p: p[0] / (2 + p[1] ** 2)),
        inner.map(sp.sin),
        inner.map(sp.cos),
        inner.map(sp.atan),
        inner.map(lambda e: sp.sqrt(1 + e**2)),
        inner.map(lambda e: e**3),
        st.tuples(inner, inner).map(lambda p: sp.atan2(p[0], 3 + p[1] ** 2)),
    ),
    max_leaves=7,
)


@pytest.mark.slow
@given(EXPRESSIONS, st.integers(1, 10**6))
@generated
def test_forward_and_backward_agree_with_symbolic_derivatives(expr: sp.Expr, seed: int) -> None:
    with mpmath.workdps(40):
        place = [mpf(seed % (7 + 4 * k)) / (9 + k) - mpf("0.3") for k in range(3)]
        speed = [mpf("0.3"), mpf("-0.7"), mpf("1.1")]
        run = Tape([expr], [x, y, z]).run([(p, u, ZERO) for p, u in zip(place, speed, strict=True)])
        gradient = run.moving_gradient()
        at = {s: sp.Float(p, 60) for s, p in zip((x, y, z), place, strict=True)}

        def exact(e: sp.Expr) -> mpf:
            return mpf(sp.sympify(e).xreplace(at).evalf(45))

        slopes = [exact(expr.diff(s)) for s in (x, y, z)]
        assert close(run.outputs[0][0], exact(expr), 32)
        for (found, rate), slope, s in zip(gradient, slopes, (x, y, z), strict=True):
            assert close(found, slope, 30)
            along = [
                exact(expr.diff(s, other)) * u for other, u in zip((x, y, z), speed, strict=True)
            ]
            assert abs(rate - sum(along)) <= mpf(10) ** -28 * (1 + sum(map(abs, along)))
        total = sum((a * u for a, u in zip(slopes, speed, strict=True)), ZERO)
        assert abs(run.outputs[0][1] - total) <= mpf(10) ** -30 * (1 + sum(map(abs, slopes)))


@pytest.mark.parametrize(
    ("expr", "at"),
    [
        (sp.sqrt(x), "-1"),
        (x ** sp.Rational(1, 3), "-1"),
        (sp.log(x), "0"),
        (sp.log(x), "-1"),
        (1 / x, "0"),
        (x**-2, "0"),
        (sp.acos(x), "2"),
        (sp.asin(x), "-1.5"),
        (sp.acosh(x), "0.5"),
        (sp.atanh(x), "2"),
        (sp.atanh(x), "1"),
        (x**x, "-2"),
        (sp.atan2(x, x), "0"),
        (sp.exp(sp.exp(sp.exp(x))), "100"),
        (sp.sqrt(-2 - x**2), "1"),
    ],
)
@pytest.mark.parametrize("order", [0, 2])
def test_outside_the_domain(expr: sp.Expr, at: str, order: int) -> None:
    with mpmath.workdps(30), pytest.raises((DomainError, OverflowError)):
        Tape([expr], [x]).run([(mpf(at), mpf(1), ZERO)], order)


@pytest.mark.parametrize(
    ("expr", "at", "value"),
    [(sp.sqrt(x), 0, 0), (sp.asin(x), 1, sp.pi / 2), (sp.acos(x), 1, 0), (sp.acosh(x), 1, 0)],
)
def test_values_exist_where_derivatives_do_not(expr: sp.Expr, at: int, value: sp.Expr) -> None:
    with mpmath.workdps(30):
        tape = Tape([expr], [x])
        assert close(tape.run([(mpf(at), ZERO, ZERO)], 0).values[0], mpf(sp.N(value, 35)), 29)
        with pytest.raises(DomainError):
            tape.run([(mpf(at), mpf(1), ZERO)], 2)


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf"])
def test_inputs_must_be_finite(bad: str) -> None:
    with pytest.raises(DomainError):
        Tape([x + 1], [x]).run([(mpf(bad), ZERO, ZERO)], 0)


@pytest.mark.parametrize("digits", [15, 30, 60, 200])
def test_precision_is_what_was_asked_for(digits: int) -> None:
    expr = sp.sqrt(2) * sp.sin(x) + sp.pi / 3 + sp.exp(-x) + x ** sp.Rational(2, 3) + sp.log(x)
    with mpmath.workdps(digits):
        at = mpf(1) / 3
        (found,) = evaluate([expr], {x: at})
        with mpmath.workdps(digits + 30):
            expected = (
                mpmath.sqrt(2) * mpmath.sin(at)
                + mpmath.pi / 3
                + mpmath.exp(-at)
                + at ** (mpf(2) / 3)
                + mpmath.log(at)
            )
        assert abs(found - expected) < mpf(10) ** (2 - digits)


def test_one_tape_at_two_precisions() -> None:
    """Constants are not remembered from a run of lower precision."""
    tape = Tape([sp.Rational(1, 3) + sp.sqrt(2) * x], [x])
    for digits in (15, 60, 20, 60):
        with mpmath.workdps(digits):
            (found,) = tape.run([(mpf(1), ZERO, ZERO)], 0).values
            assert abs(found - (mpf(1) / 3 + mpmath.sqrt(2))) < mpf(10) ** (1 - digits)


@pytest.mark.parametrize("size", ["1e300", "1e-300", "-1e300", "1e-5000", "1e5000"])
def test_huge_and_tiny_numbers(size: str) -> None:
    with mpmath.workdps(30):
        u = mpf(size)
        run = Tape([x**3, x * x, 1 / x, (x + x**2) / x, sp.atan(x)], [x]).run([(u, u, ZERO)])
        expected = [u**3, u * u, 1 / u, 1 + u, mpmath.atan(u)]
        for found, value in zip(run.values, expected, strict=True):
            assert abs(found - value) <= mpf(10) ** -28 * abs(value)
        # d/ds of u^3 along du/ds = u is 3 u^3.
        assert abs(run.outputs[0][1] / (3 * u**3) - 1) < mpf(10) ** -28


def test_cancellation_in_constants_is_resolved() -> None:
    tiny = sp.sqrt(2) - sp.sqrt(2 - sp.Rational(1, 10**40))
    with mpmath.workdps(30):
        (found,) = evaluate([tiny * x], {x: mpf(1)})
        assert close(found * mpf(10) ** 40 * 2 * mpmath.sqrt(2), mpf(1), 25)


def test_repeated_parts_are_recorded_once() -> None:
    shared = sp.sin(x + y)
    alone = len(Tape([shared * x], [x, y]).operations)
    again = len(Tape([shared * x, shared * y, shared * x], [x, y]).operations)
    assert again == alone + 1


def test_a_deep_expression_needs_no_deep_stack() -> None:
    expr = x
    for _ in range(200):
        expr = sp.sin(expr, evaluate=False)
    with mpmath.workdps(15):
        assert 0 < Tape([expr], [x]).run([(mpf(1), ZERO, ZERO)], 0).values[0] < 1


def test_an_unknown_function_is_an_internal_error() -> None:
    with pytest.raises(InternalError):
        Tape([sp.besselj(0, x)], [x])


def test_constants_that_are_no_real_numbers_have_no_value():
    x = sp.Symbol("x", real=True)
    for constant in (sp.sin(sp.oo), sp.zoo, sp.sqrt(-2)):
        with pytest.raises(DomainError):
            evaluate([sp.Mul(constant, x, evaluate=False)], {x: mpf(1)})
