"""The result of an analysis as a frozen value: the parts that were asked for, found or left out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from lagrange_cli.analysis.equilibria.state_coordinates import with_state_coordinates

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from lagrange_cli.analysis.branches.values import Branches
    from lagrange_cli.analysis.contacts.loss import ContactLosses
    from lagrange_cli.analysis.equilibria.steady import SteadyForm
    from lagrange_cli.analysis.symmetries.linear_symmetries import Symmetries
    from lagrange_cli.analysis.values import (
        Equilibria,
        FrequencyResponse,
        Linearization,
        Mode,
        SampledLoop,
    )
    from lagrange_cli.mechanics.equations import Equations


@dataclass(frozen=True)
class Exponents:
    """Lyapunov exponents of a motion, averaged over a span of time.

    Attributes
    ----------
    values, spreads
        The exponents, the largest first, and their standard errors, in the inverse unit of time.
    start, until
        The span of time.
    """

    values: tuple[float, ...]
    spreads: tuple[float, ...]
    start: float
    until: float


@dataclass(frozen=True)
class AlongMotion:
    """A linear system along a motion.

    Attributes
    ----------
    status
        ``ok``, or the way in which it is not.
    count, start, until
        Number of times, and the first and the last.
    states, inputs, outputs
        Names.
    is_constrained
        True if there is a matrix E, whose null space holds the changes that constraints allow.
    requested, estimated
        Largest error of a matrix, as it was asked for and as it is estimated.
    reason
        The reason why the promise is not kept; empty if it is kept.
    arrays
        Times ``t``, shape (m,), states ``y`` and inputs ``u``, shape (m, number of these), and
        matrices, shape (m, rows, columns), by name.
    """

    status: str
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
    arrays: Mapping[str, NDArray[Any]] = field(repr=False)


@dataclass(frozen=True)
class LeftOut:
    """A part of an analysis that was left out, and the reason."""

    part: str
    reason: str


@dataclass(frozen=True)
class Analysis:
    """Result of an analysis of equations of motion.

    Attributes
    ----------
    equations
        The equations.
    symmetries
        Symmetries other than cyclic coordinates; None if they were not asked for.
    equilibria
        The equilibria, or steady motions; None if they were not asked for, or left out.
    linearization, modes
        The linear system and its modes at the stable equilibrium nearest to the initial
        configuration, or at the one that was asked for; None if they were not asked for.
    left_out
        The parts that have no result, with reasons.
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
    contacts
        Forces and loss of contacts; None if they were not asked for, or left out.
    sampled
        The linear system from sample to sample; None without controllers.
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
    contacts: ContactLosses | None = None
    sampled: SampledLoop | None = None

    @property
    def rest_equations(self) -> Equations:
        """Equations of what is at rest in an equilibrium or steady motion, states among it."""
        if self.steady is not None:
            return self.steady.equations
        return with_state_coordinates(self.equations)
