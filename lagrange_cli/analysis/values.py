"""Equilibria, steady motions, linear systems and modes as frozen values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from lagrange_cli.analysis.branch_values import Branches
    from lagrange_cli.analysis.momenta import Momentum
    from lagrange_cli.analysis.response_values import FrequencyResponse
    from lagrange_cli.analysis.symmetries import Symmetries
    from lagrange_cli.analysis.verdicts import Stability
    from lagrange_cli.mechanics.equations import Equations

Matrix: TypeAlias = NDArray[np.float64]
"""Numbers in doubles, of any shape."""

Mpf: TypeAlias = Any
"""An mpmath.mpf, which carries no types."""


@dataclass(frozen=True)
class Existence:
    """The condition ``smaller ≤ larger``, or ``smaller = larger``, for an equilibrium to exist."""

    smaller: Expr
    larger: Expr
    relation: Literal["<=", "="] = "<="


@dataclass(frozen=True)
class Turning:
    """Momenta and rates of the ignored coordinates in a steady motion, in their order.

    Attributes
    ----------
    momenta, rates
        One mpf for each; None if a parameter lacks its value.
    exact_momenta, exact_rates
        The same in closed form; None where the configuration is known in numbers alone.
    """

    momenta: tuple[Mpf, ...] | None
    rates: tuple[Mpf, ...] | None
    exact_momenta: tuple[Expr, ...] | None = None
    exact_rates: tuple[Expr, ...] | None = None


@dataclass(frozen=True)
class Equilibrium:
    """A configuration in which the system can stay at rest, but for ignored coordinates.

    Attributes
    ----------
    position
        One mpf for each coordinate, true to 30 digits; None if a parameter lacks its value.
    multipliers
        One mpf for each closure; None as before.
    exact
        The same in closed form, one a coordinate; None if it is known in numbers alone.
    exact_multipliers
        Those of closures; None as before.
    free
        Names of the coordinates that have any value there; their ``position`` is that of
        the initial configuration.
    conditions
        What must hold of the parameters for it to exist.
    uncertainty
        Relative size of what is not known of the position.
    isolated
        False if it is known to be one of a continuum besides that of free coordinates.
    stability
        Its stability, None if that was not asked for.
    turning
        What the ignored coordinates do in a steady motion; None at rest.
    """

    position: tuple[Mpf, ...] | None
    multipliers: tuple[Mpf, ...] | None
    exact: tuple[Expr, ...] | None = None
    exact_multipliers: tuple[Expr, ...] | None = None
    free: tuple[str, ...] = ()
    conditions: tuple[Existence, ...] = ()
    uncertainty: float = 1e-30
    isolated: bool = True
    stability: Stability | None = None
    turning: Turning | None = None


@dataclass(frozen=True)
class AbsentEquilibrium:
    """An equilibrium in closed form that does not exist for the values of the parameters.

    ``exact``: one expression for each coordinate.
    """

    exact: tuple[Expr, ...]
    conditions: tuple[Existence, ...]


@dataclass(frozen=True)
class Equilibria:
    """The equilibria of a system.

    Attributes
    ----------
    points
        Those that exist.
    absent
        Those that exist for other parameters.
    complete
        True if it is proven that there are no others.
    starts
        Number of starts of the numeric search, 0 if none was needed.
    held
        Inputs that vary with time, and the values at which they are held.
    """

    points: tuple[Equilibrium, ...]
    absent: tuple[AbsentEquilibrium, ...] = ()
    complete: bool = False
    starts: int = 0
    held: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class StateSpace:
    """A linear system ẋ = A x + B u, y = C x + D u, in doubles.

    Attributes
    ----------
    states, inputs, outputs
        Names of the components of x, u and y, each the difference from its value at rest.
    a, b, c, d
        The matrices.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    a: Matrix
    b: Matrix
    c: Matrix
    d: Matrix


@dataclass(frozen=True)
class ExactMatrices:
    """Matrices in closed form, each as rows: M, C, K, and A and B where these are short."""

    mass: tuple[tuple[Expr, ...], ...]
    damping: tuple[tuple[Expr, ...], ...]
    stiffness: tuple[tuple[Expr, ...], ...]
    a: tuple[tuple[Expr, ...], ...] | None = None
    b: tuple[tuple[Expr, ...], ...] | None = None


@dataclass(frozen=True)
class Linearization:
    """The equations of motion near an equilibrium: M ẍ + C ẋ + K x = F u.

    Attributes
    ----------
    at
        The equilibrium.
    coordinates
        Names of the independent coordinates, whose differences from the equilibrium are x.
    mass, damping, stiffness
        M, C and K in doubles.
    state_space
        The same of first order.
    exact
        M, C, K in closed form; None if they are known in numbers alone.
    directions
        Displacements of all coordinates, one column for each that positions of the state space
        are of.
    """

    at: Equilibrium
    coordinates: tuple[str, ...]
    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    state_space: StateSpace
    exact: ExactMatrices | None = None
    directions: Matrix = field(default_factory=lambda: np.zeros((0, 0)), repr=False)

    @property
    def dissipative(self) -> Matrix:
        """The symmetric part of C, which takes energy or brings it in."""
        return (self.damping + self.damping.T) / 2

    @property
    def gyroscopic(self) -> Matrix:
        """The antisymmetric part of C, which does no work."""
        return (self.damping - self.damping.T) / 2


@dataclass(frozen=True)
class Mode:
    """A normal mode, or one of a damped or gyroscopic system.

    Attributes
    ----------
    frequency
        Angular frequency.
    shape
        Amplitude of each independent coordinate, the largest 1; complex if they have phases.
    pole
        The exponent s of exp(s t) with Im s ≥ 0; None for an undamped normal mode.
    exact_square
        ω² in closed form, None if it is known in numbers alone.
    exact_shape
        The amplitudes in closed form, or None.
    """

    frequency: float
    shape: tuple[complex, ...]
    pole: complex | None = None
    exact_square: Expr | None = None
    exact_shape: tuple[Expr, ...] | None = None


@dataclass(frozen=True)
class SteadyForm:
    """The reduced system whose equilibria are steady motions.

    Attributes
    ----------
    equations
        Routh's equations of the coordinates that rest, the momenta being parameters.
    momenta
        The momenta of the ignored coordinates, with these.
    given
        For each of them what was given: its symbol, that of the momentum or of the rate, and
        its value, None if that is not known.
    """

    equations: Equations
    momenta: tuple[Momentum, ...]
    given: tuple[tuple[Symbol, float | None], ...]


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents of a motion, averaged over a time.

    Attributes
    ----------
    values, spreads
        From the largest, and the standard error of each, in the inverse unit of time.
    start, until
        The time.
    """

    values: tuple[float, ...]
    spreads: tuple[float, ...]
    start: float
    until: float


@dataclass(frozen=True)
class AlongMotion:
    """A linear system along a motion, without its matrices.

    Attributes
    ----------
    count, start, until
        Number of times, and the first and the last.
    states, inputs, outputs
        Names.
    is_constrained
        True if there is a matrix E, whose null space holds the changes that constraints allow.
    requested, estimated
        Largest error of a matrix: what was asked for, and what is estimated.
    reason
        Why the promise is not kept; empty where it is.
    report
        Everything as values that JSON can hold.
    """

    count: int
    start: float
    until: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    is_constrained: bool
    requested: float
    estimated: float
    reason: str
    report: Mapping[str, Any] = field(repr=False)


@dataclass(frozen=True)
class LeftOut:
    """A part of an analysis that was left out, and the reason."""

    part: str
    reason: str


@dataclass(frozen=True)
class Analysis:
    """What was found of equations of motion.

    Attributes
    ----------
    equations
        The equations.
    symmetries
        Those beside cyclic coordinates; None if they were not asked for.
    equilibria
        None if they were not asked for, or left out.
    linearization, modes
        At the stable equilibrium nearest to the initial configuration, or at the one that was
        asked for.
    left_out
        What was asked for and is not here.
    steady
        The reduced system, if steady motions were asked for; None if equilibria are of rest.
    exponents
        Lyapunov exponents of the motion; None if they were not asked for.
    along
        The linear system along the motion; None if it was not asked for.
    branches
        Branches of equilibria over a parameter; None if they were not asked for.
    response
        Frequency responses at an equilibrium; None if they were not asked for.
    """

    equations: Equations
    symmetries: Symmetries | None = None
    equilibria: Equilibria | None = None
    linearization: Linearization | None = None
    modes: tuple[Mode, ...] | None = None
    left_out: tuple[LeftOut, ...] = field(default=())
    steady: SteadyForm | None = None
    exponents: Exponents | None = None
    along: AlongMotion | None = None
    branches: Branches | None = None
    response: FrequencyResponse | None = None

    @property
    def resting(self) -> Equations:
        """The equations of the coordinates that rest at an equilibrium."""
        return self.equations if self.steady is None else self.steady.equations
