"""Fits as values: fitted values with their errors, columns with residuals."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from lagrange_cli.drawn import Drawn, Reported

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.results.trajectory import Trajectory


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
    """

    name: str
    times: Array
    measured: Array
    fitted: Array
    deviations: Array

    @property
    def root_mean_square(self) -> float:
        """The root mean square of the residuals."""
        return float(np.sqrt(np.mean((self.measured - self.fitted) ** 2)))


@dataclass(frozen=True)
class Fit(Drawn, Reported):
    """The result of a fit.

    Attributes
    ----------
    name
        Name of the scene.
    status
        ``ok``; ``undetermined``: other values fit as well; ``not_converged``.
    reason
        Words that say more, if the status is not ``ok``.
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
    derivatives
        ``variational equations`` or ``differences``.
    runs
        Motions that were simulated.
    motion
        The fitted motion.
    """

    name: str
    status: Literal["ok", "undetermined", "not_converged"]
    reason: str
    values: tuple[FittedValue, ...]
    columns: tuple[FittedColumn, ...]
    correlation: Array
    chi_squared: float
    degrees_of_freedom: int
    given_deviations: bool
    derivatives: str
    runs: int
    motion: Trajectory

    @property
    def exit_code(self) -> int:
        """0 where the values are determined, else 1."""
        return 0 if self.status == "ok" else 1

    def __repr__(self) -> str:
        """Return one line for a terminal."""
        listed = ", ".join(f"{v.name} = {v.value:.6g}" for v in self.values)
        return f"<Fit of {self.name}: {listed}; {self.status}>"
