"""Equilibria with their stability, linear systems, modes and responses as frozen values."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.drawn import Reported

if TYPE_CHECKING:
    from sympy import Expr


#: Digits of the numbers that analyses compute with, and judge by.
DIGITS = 50

Verdict: TypeAlias = Literal[
    "stable",
    "asymptotically stable",
    "stable but for drift",
    "stable in the linear approximation",
    "unstable",
    "undecided",
]
"""The strongest proven statement on motions that begin near an equilibrium."""


Matrix: TypeAlias = NDArray[np.float64]
"""Numbers in doubles, of any shape."""

Mpf: TypeAlias = Any
"""An mpmath.mpf, which carries no types."""


@dataclass(frozen=True)
class Existence:
    """The condition ``smaller ≤ larger``, or ``smaller = larger``, for an equilibrium to exist.

    With ``<`` it is one for it to be stable.
    """

    smaller: Expr
    larger: Expr
    relation: Literal["<=", "<", "="] = "<="


@dataclass(frozen=True)
class Stability:
    """Stability of an equilibrium.

    Attributes
    ----------
    verdict
        The strongest proven statement.
    reason
        The theorem, with the conditions that were verified, as a short phrase.
    stable_where
        Conditions on parameters without values under which it is stable; none if that is unknown.
    """

    verdict: Verdict
    reason: str
    stable_where: tuple[Existence, ...] = ()


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
        One mpf for each coordinate, true to ``uncertainty``; None if a parameter lacks its value.
    multipliers
        One mpf for each closure; None as before.
    exact
        The same in closed form, one a coordinate; None if it is known in numbers alone.
    exact_multipliers
        The multipliers in closed form; None as before.
    free
        Names of the coordinates that have any value there; their ``position`` is that of
        the initial configuration.
    conditions
        Conditions on the parameters for it to exist.
    uncertainty
        Proven bound of the error of the position, relative to 1 and to each coordinate.
    isolated
        False if it is proven to be one of a continuum besides that of free coordinates.
    stability
        Its stability, None if that was not asked for.
    turning
        Momenta and rates of the ignored coordinates in a steady motion; None at rest.
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
class NearBalance:
    """A configuration near which numbers balance, without a proof that there is an equilibrium.

    ``position``: one mpf for each coordinate; ``free``: names of those that have any value.
    """

    position: tuple[Mpf, ...]
    free: tuple[str, ...]


@dataclass(frozen=True)
class Equilibria:
    """The equilibria of a system.

    Attributes
    ----------
    points
        The equilibria that exist.
    absent
        Equilibria in closed form that exist for other values of the parameters only.
    complete
        True if it is proven that there are no others but those left out.
    nonzero
        Names of parameters without a value; ``complete`` holds where none of them is zero.
    starts
        Number of starts of the numeric search, 0 if none was needed.
    held_inputs
        Inputs that vary with time and states with two values, with what they are held at.
    unproven
        Configurations near which numbers balance, without a proof of an equilibrium.
    released
        Number of closed forms at singular coordinates that are left out by a measurement: beside
        them the system moves off.
    """

    points: tuple[Equilibrium, ...]
    absent: tuple[AbsentEquilibrium, ...] = ()
    complete: bool = False
    starts: int = 0
    held_inputs: tuple[tuple[str, float], ...] = ()
    nonzero: tuple[str, ...] = ()
    unproven: tuple[NearBalance, ...] = ()
    released: int = 0


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
class SampledLoop:
    """A linear system under sampled controllers, x after a period = A x + B u with u held.

    Attributes
    ----------
    period
        Time until all controllers sample together again; that between samples if there is one.
    states, inputs
        Names of x, and of what is held.
    a, b
        The matrices over a period; None with several controllers.
    poles
        Poles of the loop from period to period, memory included, that are not 0; the largest first.
    """

    period: float
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    a: Matrix | None
    b: Matrix | None
    poles: tuple[complex, ...]


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
    states
        States of first order, which M, C and K hold at rest; the state space has them last.
    """

    at: Equilibrium
    coordinates: tuple[str, ...]
    mass: Matrix
    damping: Matrix
    stiffness: Matrix
    state_space: StateSpace
    exact: ExactMatrices | None = None
    directions: Matrix = field(default_factory=lambda: np.zeros((0, 0)), repr=False)
    states: tuple[str, ...] = ()

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
    """A normal mode, or a mode of a damped or gyroscopic system.

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


Complexes: TypeAlias = NDArray[np.complex128]
"""Complex numbers of any shape."""


@dataclass(frozen=True)
class ResponsePeak:
    """A local maximum of the gain, or a frequency at which the gain is infinite.

    Attributes
    ----------
    frequency
        Angular frequency.
    gain, phase
        |G| and arg G there, in radians; None where an undamped pole makes the gain infinite.
    """

    frequency: float
    gain: float | None
    phase: float | None


@dataclass(frozen=True)
class Channel:
    """The response of one output to one input.

    Attributes
    ----------
    source, output
        Names of the input and the output.
    static
        G(0), the response to a constant input; None where a pole at zero makes it infinite.
    peaks
        Local maxima of the gain, and undamped poles, by frequency.
    """

    source: str
    output: str
    static: float | None
    peaks: tuple[ResponsePeak, ...]


@dataclass(frozen=True)
class FrequencyResponse(Reported):
    """Responses y = G(iω) u e^{iωt} of all outputs to all inputs.

    Attributes
    ----------
    low, high
        Lowest and highest angular frequency.
    inputs, outputs
        Names; rates of inputs are none of them, G holds what they do.
    frequencies
        Angular frequencies, ascending, shape (m,); closer where a pole is near.
    gains
        G, shape (m, outputs, inputs); not a number at undamped poles.
    channels
        One for each pair of an input and an output whose response is not zero.
    error
        Largest bound of the rounding errors of a value over its size, for the matrices in doubles.
    settles
        ``yes`` if all poles have negative real parts, so that motions settle to these responses;
        ``undamped`` if some are on the imaginary axis, ``unstable`` if some are beyond it.
    """

    low: float
    high: float
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    frequencies: NDArray[np.float64]
    gains: Complexes
    channels: tuple[Channel, ...]
    error: float
    settles: Literal["yes", "undamped", "unstable"]


def continuous_phase(gains: Complexes) -> NDArray[np.float64]:
    """Return phases in radians without jumps by whole turns; NaN where gains are NaN.

    ``gains``: shape (m,), as the result.
    """
    phases = np.angle(gains)
    known = np.isfinite(phases)
    phases[known] = np.unwrap(phases[known])
    return np.asarray(phases, dtype=float)
