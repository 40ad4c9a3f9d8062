"""Fits as values: fitted values with their errors, columns with residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lagrange_cli.drawn import Drawn, Reported

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.fit.noise import SerialCorrelation


#: Kinds of findings; see :class:`FitFinding`.
FitKind = Literal[
    "undetermined", "not_converged", "contradicted", "ambiguous", "at_bound", "remark"
]


@dataclass(frozen=True)
class FittedValue:
    """A value that was fitted.

    Attributes
    ----------
    name
        Name of a parameter, or of a coordinate or its ``dot`` for its start.
    start, value
        The value of the scene, and the fitted one.
    error
        Its standard error; None if the measurements do not determine it.
    """

    name: str
    start: float
    value: float
    error: float | None


@dataclass(frozen=True)
class FittedColumn:
    """A measured column beside the motion that was fitted.

    Attributes
    ----------
    name
        The column.
    times, measured, fitted
        Times of the measurements, their values, and those of the motion.
    deviations
        Standard deviations of the measurements: given, or estimated as the one number that
        the residuals have.
    serial
        Test of the residuals for serial correlation; None if they are too few, or no more than
        errors of the motion.
    """

    name: str
    times: Array
    measured: Array
    fitted: Array
    deviations: Array
    serial: SerialCorrelation | None = None

    @property
    def root_mean_square(self) -> float:
        """The root mean square of the residuals."""
        return float(np.sqrt(np.mean((self.measured - self.fitted) ** 2)))


@dataclass(frozen=True)
class FitFinding:
    """A reason against a fit, or a remark on it.

    Attributes
    ----------
    kind
        ``undetermined``: other values near by fit as well; ``not_converged``; ``contradicted``:
        the residuals are no noise, or more than was stated; ``ambiguous``: values elsewhere fit as
        well; ``at_bound``: values are at their bounds; ``remark``: no reason against the fit.
    text
        Words that say more.
    """

    kind: FitKind
    text: str


@dataclass(frozen=True)
class FitMinimum:
    """A minimum of the sum of squares that starts led to.

    Attributes
    ----------
    values
        The values there, by name.
    root_mean_square
        Root mean square of the residuals over the ranges of their columns.
    starts
        Number of starts that ended there.
    """

    values: Mapping[str, float]
    root_mean_square: float
    starts: int


@dataclass(frozen=True)
class Fit(Drawn, Reported):
    """The result of a fit.

    Attributes
    ----------
    name
        Name of the scene.
    findings
        Reasons against the fit, the gravest first, then remarks.
    values
        Fitted values, in the order that was asked for.
    columns
        The measured columns.
    correlation
        Correlation of the errors of the values, shape (values, values); NaN if undetermined.
    chi_squared
        Sum of the squares of residuals over deviations.
    degrees_of_freedom
        Measurements less values.
    given_deviations
        True if the file gave them; else they are estimated, and ``chi_squared`` means nothing.
    chi_squared_probability
        That of a larger ``chi_squared`` if the deviations are as given; None if they are not given.
    derivatives
        ``variational equations`` or ``differences``.
    runs
        Motions that were simulated.
    starts
        Starts that were tried.
    minima
        Minima that starts led to, the fitted one first.
    motion
        The fitted motion.
    """

    name: str
    findings: tuple[FitFinding, ...]
    values: tuple[FittedValue, ...]
    columns: tuple[FittedColumn, ...]
    correlation: Array
    chi_squared: float
    degrees_of_freedom: int
    given_deviations: bool
    chi_squared_probability: float | None
    derivatives: str
    runs: int
    starts: int
    minima: tuple[FitMinimum, ...]
    motion: Trajectory

    @property
    def status(self) -> FitKind | Literal["ok"]:
        """The kind of the gravest reason against the fit, ``ok`` without one."""
        return next((f.kind for f in self.findings if f.kind != "remark"), "ok")

    @property
    def reason(self) -> str:
        """The gravest reason against the fit in words, empty without one."""
        return next((f.text for f in self.findings if f.kind != "remark"), "")

    @property
    def exit_code(self) -> int:
        """0 where nothing speaks against the fit, else 1."""
        return 0 if self.status == "ok" else 1

    def __repr__(self) -> str:
        """Return one line for a terminal."""
        listed = ", ".join(f"{v.name} = {v.value:.6g}" for v in self.values)
        return f"<Fit of {self.name}: {listed}; {self.status}>"
