"""The section ``simulate`` of a scene as numbers, which runs read without the scene."""

from __future__ import annotations

from dataclasses import dataclass

from lagrange_cli.errors import Mark

#: Samples of any run: rows of a table that a disk may hold.
MOST_SAMPLES = 10_000_000_000


@dataclass(frozen=True)
class SimulationDefaults:
    """The section ``simulate`` as numbers; keys that are absent are None.

    Attributes
    ----------
    until, start
        Last and first time.
    accuracy
        Largest error of each component, relative to its scale.
    samples, step
        Number of samples, or the time between them.
    method
        Name of the integration method.
    rtol, atol
        Tolerances of that method.
    formulation
        Minimal or multiplier form.
    mark
        Place of the section.
    """

    until: float | None = None
    start: float = 0.0
    accuracy: float | None = None
    samples: int | None = None
    step: float | None = None
    method: str | None = None
    rtol: float | None = None
    atol: float | None = None
    formulation: str | None = None
    mark: Mark | None = None
