"""The result of an analysis as a frozen value: the parts that were asked for, found or left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.analysis.branches.values import Branches
    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries
    from lagrange_cli.analysis.values import Equilibria, FrequencyResponse, Linearization, Mode
    from lagrange_cli.mechanics.equations import Equations


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
