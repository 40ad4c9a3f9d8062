"""Normal modes of a linear system; poles where there is damping or gyroscopic coupling."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import mpmath
import numpy as np
import sympy as sp

from lagrange_cli.analysis.values import DIGITS, ExactMatrices, Linearization, Matrix, Mode
from lagrange_cli.mechanics.algebra.polynomials import cancelled, common_divisor, factored_form
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.elimination.solve_equation import solutions
from lagrange_cli.mechanics.numerics.autodiff import DomainError, evaluate

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from lagrange_cli.analysis.values import Mpf

# Thresholds lie between the rounding of doubles and parts that a reader would miss; budgets bound
# closed forms by the length that is worth reading.

#: Part of the largest entry below which one is rounding.
_ROUNDING = 1e-13
#: Amplitudes, and parts of them, that are rounding beside the largest.
_NOISE = 1e-12
#: Coordinates, and operations, of a characteristic polynomial in closed form.
_EXACT_SIZE, _EXACT_OPERATIONS = 8, 2_000
#: Operations of a squared frequency, and of an amplitude, that are worth reading.
_LONGEST = 60
#: Coordinates of a mode whose amplitudes are solved for in closed form.
_SHAPES = 3
#: Relative difference between a closed form and the number it stands for.
_AGREE = 1e-9


def modes(linear: Linearization, known: Mapping[sp.Symbol, Mpf]) -> tuple[Mode, ...]:
    """Find the modes at an equilibrium, by frequency.

    Parameters
    ----------
    linear
        The linear system.
    known
        Values of the parameters.
    """
    if not _is_conservative(linear):
        return _damped(linear)
    numeric = _normal(linear)
    if linear.exact is None:
        return numeric
    squares = exact_squares(linear.exact)
    if not {s for form in squares.plain for s in form.free_symbols} <= known.keys():
        return numeric
    return tuple(_with_closed_form(mode, linear.exact, squares, known) for mode in numeric)


def _is_conservative(linear: Linearization) -> bool:
    """Say whether C is zero, K is symmetric, M definite and positions as many as velocities."""
    stiff = linear.stiffness
    is_square = stiff.shape[0] == stiff.shape[1]
    if linear.states or not (is_square and _is_positive(linear.mass)):
        return False
    size = np.abs(stiff).max(initial=0.0)
    symmetric = np.abs(stiff - stiff.T).max(initial=0.0) <= _ROUNDING * size
    scale = np.sqrt(size * np.abs(linear.mass).max(initial=0.0))
    return bool(symmetric and np.abs(linear.damping).max(initial=0.0) <= _ROUNDING * scale)


def _is_positive(mass: Matrix) -> bool:
    """Say whether a mass matrix is positive definite."""
    inertia = np.diag(mass)
    if not (inertia > 0).all():
        return False
    scaled = mass / np.sqrt(np.outer(inertia, inertia))
    return bool(np.linalg.eigvalsh((scaled + scaled.T) / 2).min(initial=1.0) > _ROUNDING)


def _normal(linear: Linearization) -> tuple[Mode, ...]:
    """Solve K a = ω² M a, with coordinates in units of their inertia."""
    from scipy.linalg import eigh

    unit = 1 / np.sqrt(np.diag(linear.mass))
    mass, stiff = (unit[:, None] * m * unit for m in (linear.mass, linear.stiffness))
    squares, shapes = eigh((stiff + stiff.T) / 2, (mass + mass.T) / 2)
    size = np.abs(squares).max(initial=0.0)
    normal_modes = []
    for square, shape in zip(squares.tolist(), (unit[:, None] * shapes).T, strict=True):
        exact = 0.0 if abs(square) <= _ROUNDING * size else square
        pole = complex(np.sqrt(-exact), 0.0) if exact < 0 else None
        normal_modes.append(Mode(float(np.sqrt(max(exact, 0.0))), _normalized(shape), pole))
    return tuple(normal_modes)


def _normalized(shape: Matrix) -> tuple[complex, ...]:
    """Divide a shape by its largest amplitude, or the first of several as large."""
    sizes = np.abs(shape)
    largest = shape[int(np.argmax(sizes > sizes.max() * (1 - 1e-9)))]
    scaled = shape / largest
    for part in (scaled.real, scaled.imag) if np.iscomplexobj(scaled) else (scaled,):
        part[np.abs(part) <= _NOISE] = 0.0
    return tuple(scaled.tolist())


def _damped(linear: Linearization) -> tuple[Mode, ...]:
    """Find the poles in the upper half plane and on the real axis, by frequency, then decay."""
    space = linear.state_space
    poles, vectors = np.linalg.eig(space.a)
    size = np.abs(poles).max(initial=0.0)
    velocities = [k for k, name in enumerate(space.states) if name.startswith("dot(")]
    last = len(space.states) - len(linear.states)
    positions = [k for k in range(last) if k not in velocities]
    damped_modes = []
    for pole, vector in zip(poles.tolist(), vectors.T, strict=True):
        if pole.imag < 0:
            continue
        place = complex(*(0.0 if abs(x) <= 1e-12 * size else x for x in (pole.real, pole.imag)))
        moved = vector[positions]
        shape = _normalized(moved) if np.abs(moved).max(initial=0.0) else (0.0,) * len(positions)
        damped_modes.append(Mode(place.imag, shape, place))
    return tuple(sorted(damped_modes, key=lambda mode: (mode.frequency, -(mode.pole or 0).real)))


# Closed forms.


@dataclass(frozen=True)
class _Squares:
    """Squared frequencies in closed form.

    Attributes
    ----------
    plain
        With roots of sums, which algorithms on polynomials take.
    shown
        The same in their shortest form, in some order.
    """

    plain: tuple[sp.Expr, ...] = ()
    shown: tuple[sp.Expr, ...] = ()


def exact_squares(exact: ExactMatrices) -> _Squares:
    """Solve det(K − ω² M) = 0 in closed form: the roots of factors of first and second degree."""
    n = len(exact.mass)
    if n > _EXACT_SIZE or any(e != 0 for row in exact.damping for e in row):
        return _Squares()
    mass, stiff = sp.Matrix(exact.mass), sp.Matrix(exact.stiffness)
    if sum(sp.count_ops(e) for e in (*mass, *stiff)) > _EXACT_OPERATIONS:
        return _Squares()
    square = sp.Dummy("w", real=True)
    determinant = (
        (stiff - square * mass).det(method="berkowitz") if n > 1 else (stiff[0] - square * mass[0])
    )
    numerator = sp.fraction(cancelled(determinant))[0]
    plain: list[sp.Expr] = []
    shown: list[sp.Expr] = []
    for factor in sp.Mul.make_args(factored_form(numerator)):
        base = factor.as_base_exp()[0]
        if square not in base.free_symbols or sp.degree(base, square) > 2:
            continue
        roots = [factored_form(cancelled(r)) for r in solutions(base, square) or []]
        shorter = _shortest(sp.Poly(base, square), roots)
        if all(sp.count_ops(r) <= _LONGEST for r in shorter):
            plain += roots
            shown += shorter
    return _Squares(tuple(plain), tuple(shown))


def _shortest(factor: sp.Poly, roots: Sequence[sp.Expr]) -> Sequence[sp.Expr]:
    """Return the roots of a factor of first or second degree in their shortest form."""
    if factor.degree() == 1:
        return [min((r, sp.expand(r)), key=printed_length) for r in roots]
    products = _by_products(*map(factored_form, factor.all_coeffs()))
    return min(roots, products, key=lambda pair: sum(map(printed_length, pair)))


def _by_products(a: sp.Expr, b: sp.Expr, c: sp.Expr) -> list[sp.Expr]:
    """Return the roots of a u² + b u + c with what b² and 4 a c share as factors left as products.

    As in ω² = g/(2 m₁ l₁ l₂) {M (l₁ + l₂) ± √(M [M (l₁ + l₂)² − 4 m₁ l₁ l₂])} of a double pendulum,
    where M = m₁ + m₂. What is taken out of the root may be negative: the order of the two is any.
    """
    whole, taken = factored_form(b**2), factored_form(4 * a * c)
    shared = common_divisor([whole, taken])
    outside, inside = sp.S.One, sp.S.One
    for factor in sp.Mul.make_args(factored_form(shared)):
        base, exponent = factor.as_base_exp()
        halves = int(exponent) // 2 if exponent.is_Integer else 0
        outside *= base**halves
        inside *= factor / base ** (2 * halves)
    difference = factored_form(cancelled(whole / shared)) - factored_form(cancelled(taken / shared))
    common = common_divisor([outside, b])
    first = factored_form(cancelled(-b / common))
    root = cancelled(outside / common) * sp.sqrt(inside * difference)
    scale = factored_form(cancelled(common / (2 * a)))
    return [scale * (first + sign * root) for sign in (-1, 1)]


def _with_closed_form(
    mode: Mode,
    exact: ExactMatrices,
    squares: _Squares,
    known: Mapping[sp.Symbol, Mpf],
) -> Mode:
    """Add the closed form whose value is the mode's."""
    number = mode.frequency**2 if mode.pole is None else -(mode.pole.real**2)
    plain, shown = (
        [
            square
            for square, value in _valued(forms, known)
            if abs(value - number) <= _AGREE * max(abs(number), 1e-300) or value == number
        ]
        for forms in (squares.plain, squares.shown)
    )
    if not (plain and shown):
        return mode
    shape = (
        _exact_shape(exact, plain[0], mode, known) if sp.count_ops(plain[0]) <= _LONGEST else None
    )
    return Mode(mode.frequency, mode.shape, mode.pole, shown[0], shape)


def _valued(
    expressions: Sequence[sp.Expr], known: Mapping[sp.Symbol, Mpf]
) -> Iterator[tuple[sp.Expr, float]]:
    with mpmath.workdps(DIGITS):
        for expression in expressions:
            try:
                yield expression, float(evaluate([expression], known)[0])
            except DomainError:
                continue


def _exact_shape(
    exact: ExactMatrices, square: sp.Expr, mode: Mode, known: Mapping[sp.Symbol, Mpf]
) -> tuple[sp.Expr, ...] | None:
    """Solve (K − ω² M) a = 0 with the largest amplitude 1; None where that is long."""
    n = len(exact.mass)
    if n > _SHAPES:
        return None
    if n == 1:
        return (sp.S.One,)
    lead = next(k for k, a in enumerate(mode.shape) if abs(a - 1) < 1e-9)
    matrix = sp.Matrix(exact.stiffness) - square * sp.Matrix(exact.mass)
    others = [k for k in range(n) if k != lead]
    block = matrix.extract(others, others)
    right = -matrix.extract(others, [lead])
    determinant = block.det(method="berkowitz")
    solved = block.adjugate() * right
    ratios = [sp.radsimp(cancelled(e / determinant)) for e in solved] if determinant != 0 else []
    if not ratios or any(sp.count_ops(r) > _LONGEST for r in ratios):
        return None
    shape = [sp.S.One] * n
    for k, ratio in zip(others, ratios, strict=True):
        shape[k] = factored_form(ratio)
    numbers = [value for _, value in _valued(shape, known)]
    agrees = len(numbers) == n and np.allclose(numbers, np.real(mode.shape), rtol=1e-6, atol=1e-9)
    return tuple(shape) if agrees else None
