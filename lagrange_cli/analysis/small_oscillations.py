"""Small oscillations about a stable equilibrium: quadratic energies, linear equations, modes.

With q = q₀ + x, T and V are ½ ẋ·M ẋ and ½ x·K x up to terms of third order, and
M ẍ + C ẋ + K x = 0 (H. Goldstein, C. Poole and J. Safko, Classical Mechanics, 3rd ed., chapter 6).
The matrices are those of :func:`.linearize.exact_matrices`, compared with the ones that
differentiation of the value graph gives; where there is no closed form, these stand as numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, cast

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.legendre import at_rest
from lagrange_cli.analysis.values import Equilibrium, Linearization, Matrix, Mode
from lagrange_cli.errors import InputError, InternalError, Mark, Problem
from lagrange_cli.mechanics.dynamics.textbook_form import RowSystem, shown_rows
from lagrange_cli.mechanics.equations import ShownEquation
from lagrange_cli.mechanics.numerics.autodiff import evaluate
from lagrange_cli.mechanics.sparse import ExpressionRow
from lagrange_cli.mechanics.system import Coordinate

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

#: The hint of refusals.
_ELSEWHERE = "'lagrange analyze SCENE --at NAME=VALUE' linearizes elsewhere, and holds inputs"

#: Largest part by which closed forms may differ from numbers in doubles.
_AGREEMENT = 1e-11

Rows = tuple[tuple[sp.Expr, ...], ...]


@dataclass(frozen=True)
class NormalMode:
    """A motion x = shape·cos(ω t).

    Attributes
    ----------
    square, shape
        ω² and the amplitudes of x, in closed form or as numbers.
    frequency
        ω with the scene's values.
    is_closed
        Both have closed forms.
    """

    square: sp.Expr
    shape: tuple[sp.Expr, ...]
    frequency: float
    is_closed: bool


@dataclass(frozen=True)
class SmallOscillations:
    """Motions near an equilibrium.

    Attributes
    ----------
    at
        The equilibrium.
    coordinates
        The independent coordinates.
    rest_values
        Their values there.
    displacements
        Coordinates of x: the coordinate itself if it rests at 0, else one of its own.
    mass, damping, stiffness
        M, C, K as rows.
    kinetic, potential
        The terms of ½ ẋ·M ẋ and ½ x·K x; no potential if forces without potential act.
    is_effective
        The potential holds centrifugal terms of moving frames.
    shown
        Textbook form of M ẍ + C ẋ + K x = 0.
    modes
        Normal modes, by frequency; none with damping or gyroscopic terms.
    poles
        Exponents s of exp(s t) with Im s ≥ 0, in place of modes.
    literals
        Numbers without a closed form → their text in print.
    """

    at: Equilibrium
    coordinates: tuple[Coordinate, ...]
    rest_values: tuple[sp.Expr, ...]
    displacements: tuple[Coordinate, ...]
    mass: Rows
    damping: Rows
    stiffness: Rows
    kinetic: tuple[sp.Expr, ...]
    potential: tuple[sp.Expr, ...]
    is_effective: bool
    shown: tuple[ShownEquation, ...]
    modes: tuple[NormalMode, ...]
    poles: tuple[complex, ...]
    literals: dict[Fraction, str]


def small_oscillations(equations: Equations, digits: int) -> SmallOscillations:
    """Write the form at the stable equilibrium that is nearest to the initial configuration.

    ``digits``: those of numbers that have no closed form.

    Raises
    ------
    InputError
        There is no equilibrium, none is stable, or as :func:`.analyze.analyze`.
    InternalError
        Closed forms disagree with numbers.
    """
    # Derivations without this form need no equilibria, nor SciPy.
    from lagrange_cli.analysis.analyze import analyze

    if equations.system.states:
        message = "there are no small oscillations of states, whose rates are of first order"
        hint = "lagrange analyze has the linear system and its poles"
        mark = Mark(equations.presentation.file, 1, 1)
        raise InputError(Problem(message, mark, hint, "no-oscillations"))
    try:
        linear = analyze(equations, ("linearization",)).linearization
        assert linear is not None
        _require_oscillations(linear)
        motions = analyze(equations, ("modes",)).modes or ()
    except InputError as refusal:
        located = (
            replace(
                problem,
                mark=problem.mark or Mark(equations.presentation.file, 1, 1),
                hint=_ELSEWHERE,
            )
            for problem in refusal.problems
        )
        raise InputError(*located) from refusal
    number = {c.name: j for j, c in enumerate(equations.system.coordinates)}
    independent = [number[name] for name in linear.coordinates]
    coordinates = tuple(equations.system.coordinates[j] for j in independent)
    numbers = _Numbers(digits)
    rest_values = tuple(_rest_value(linear.at, j, numbers) for j in independent)
    mass, damping, stiffness = _matrices(equations, linear, numbers)
    displacements = _displacements(equations, coordinates, rest_values)
    row_system = _rows(equations, displacements, mass, damping, stiffness)
    poles = tuple(mode.pole for mode in motions if mode.pole is not None)
    modes = () if poles else tuple(_normal(mode, numbers) for mode in motions)
    literals = [*(value for value, _ in equations.presentation.literals), *numbers.literals]
    return SmallOscillations(
        linear.at,
        coordinates,
        rest_values,
        displacements,
        mass,
        damping,
        stiffness,
        tuple(_quadratic(mass, [c.v for c in displacements])),
        ()
        if equations.system.forces
        else tuple(_quadratic(stiffness, [c.q for c in displacements])),
        at_rest(equations.system.kinetic, [c.v for c in equations.system.coordinates]) != 0,
        shown_rows(row_system, literals),
        modes,
        poles,
        numbers.literals,
    )


def _require_oscillations(linear: Linearization) -> None:
    """Refuse an unstable equilibrium, and fewer independent velocities than positions."""
    if linear.stiffness.shape[0] < linear.stiffness.shape[1]:
        message = "there are no small oscillations: constraints of velocities leave positions free"
        raise InputError(Problem(message, rule="no-oscillations"))
    stability = linear.at.stability
    if stability is not None and stability.verdict == "unstable":
        message = "there are no small oscillations: no equilibrium that was found is stable"
        raise InputError(Problem(message, rule="no-oscillations"))


class _Numbers:
    """Numbers without a closed form, as exact values of doubles with a text each."""

    def __init__(self, digits: int) -> None:
        self._digits = digits
        self.literals: dict[Fraction, str] = {}

    def expression_of(self, value: float) -> sp.Expr:
        """Return the value, rounded to the digits, as an exact expression."""
        rounded = Fraction(f"{value:.{self._digits}g}")
        size = abs(rounded)
        # Energies hold halves of them.
        for part, digits in ((size, self._digits), (size / 2, self._digits + 1)):
            if part.denominator != 1:
                self.literals[part] = f"{float(part):.{digits}g}"
        return sp.Rational(rounded.numerator, rounded.denominator)


def _normal(mode: Mode, numbers: _Numbers) -> NormalMode:
    square, shape = mode.exact_square, mode.exact_shape
    return NormalMode(
        numbers.expression_of(mode.frequency**2) if square is None else square,
        tuple(numbers.expression_of(x.real) for x in mode.shape) if shape is None else shape,
        mode.frequency,
        square is not None and shape is not None,
    )


def _rest_value(at: Equilibrium, j: int, numbers: _Numbers) -> sp.Expr:
    if at.exact is not None:
        return at.exact[j]
    assert at.position is not None
    return numbers.expression_of(float(at.position[j]))


def _matrices(
    equations: Equations, linear: Linearization, numbers: _Numbers
) -> tuple[Rows, Rows, Rows]:
    """Return M, C and K in closed form, compared with the numbers, or else the numbers."""
    matrices = (linear.mass, linear.damping, linear.stiffness)
    if linear.exact is None:
        return cast(
            tuple[Rows, Rows, Rows],
            tuple(
                tuple(tuple(map(numbers.expression_of, row)) for row in m.tolist())
                for m in matrices
            ),
        )
    exact = (linear.exact.mass, linear.exact.damping, linear.exact.stiffness)
    for closed, values in zip(exact, matrices, strict=True):
        _require_equal(equations, linear.at, closed, values)
    return exact


def _require_equal(equations: Equations, at: Equilibrium, closed: Rows, values: Matrix) -> None:
    assert at.position is not None
    known = {p.symbol: mpf(p.value) for p in equations.system.parameters if p.value is not None}
    # Closed forms hold coordinates that have any value there.
    known |= {c.q: x for c, x in zip(equations.system.coordinates, at.position, strict=True)}
    with mpmath.workdps(30):
        here = [[float(x) for x in evaluate([*row], known)] for row in closed]
    size = max(float(abs(values).max(initial=0.0)), 1e-300)
    for row, expected in zip(here, values.tolist(), strict=True):
        if any(abs(x - y) > _AGREEMENT * size for x, y in zip(row, expected, strict=True)):
            message = "matrices of small oscillations disagree with those of the value graph"
            raise InternalError(Problem(message, rule="certificate"))


def _displacements(
    equations: Equations, coordinates: Sequence[Coordinate], rest_values: Sequence[sp.Expr]
) -> tuple[Coordinate, ...]:
    """Make coordinates for the displacements from an equilibrium that is not at 0."""
    taken = {c.name for c in equations.system.coordinates} | {
        c.name for c in equations.system.cartesian_names
    }
    taken |= {p.name for p in equations.system.parameters} | {
        x.name for x in equations.system.external
    }
    letters = ("eta", "xi", "delta", "etaeta")
    letter = next(x for x in letters if not any(f"{x}_{c.name}" in taken for c in coordinates))
    return tuple(
        c if value == 0 else _displaced(c, f"{letter}_{c.name}", letter)
        for c, value in zip(coordinates, rest_values, strict=True)
    )


def _displaced(c: Coordinate, name: str, letter: str) -> Coordinate:
    symbols = [sp.Symbol(text, real=True) for text in (name, f"dot({name})", f"ddot({name})")]
    latex = None if c.latex is None else f"\\{letter}_{{{c.latex}}}"
    q, v, a = symbols
    return replace(c, name=name, q=q, v=v, a=a, latex=latex)


def _rows(
    equations: Equations,
    displacements: tuple[Coordinate, ...],
    mass: Rows,
    damping: Rows,
    stiffness: Rows,
) -> RowSystem:
    """Write M ẍ = −C ẋ − K x as a system of rows."""
    rates, places = [c.v for c in displacements], [c.q for c in displacements]
    forcing = [
        [
            *(-e * v for e, v in zip(damped, rates, strict=True) if e != 0),
            *(-e * x for e, x in zip(stiff, places, strict=True) if e != 0),
        ]
        for damped, stiff in zip(damping, stiffness, strict=True)
    ]
    inertia = [ExpressionRow(len(row), {j: e for j, e in enumerate(row) if e != 0}) for row in mass]
    constants = frozenset(p.symbol for p in equations.system.parameters)
    return RowSystem(displacements, constants, inertia, forcing, sums=equations.presentation.sums)


def _quadratic(matrix: Rows, x: Sequence[sp.Symbol]) -> list[sp.Expr]:
    """Return the terms of ½ x·A x for a symmetric A; none if A is not symmetric."""
    n = len(matrix)
    if any(sp.expand(matrix[i][j] - matrix[j][i]) != 0 for i in range(n) for j in range(i)):
        return []
    return [
        matrix[i][j] * x[i] * x[j] / (2 if i == j else 1)
        for i in range(n)
        for j in range(i, n)
        if matrix[i][j] != 0
    ]
