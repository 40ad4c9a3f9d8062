"""Frequency responses as frozen values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

Complexes: TypeAlias = NDArray[np.complex128]
"""Complex numbers of any shape."""


@dataclass(frozen=True)
class ResponsePeak:
    """A largest gain, or a frequency at which there is none.

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
        Largest gains between smaller ones, and undamped poles, by frequency.
    """

    source: str
    output: str
    static: float | None
    peaks: tuple[ResponsePeak, ...]


@dataclass(frozen=True)
class FrequencyResponse:
    """Responses y = G(iω) u e^{iωt} of all outputs to all inputs.

    Attributes
    ----------
    low, high
        The angular frequencies that were looked at.
    inputs, outputs
        Names.
    frequencies
        Angular frequencies, ascending, shape (m,); closer where a pole is near.
    gains
        G, shape (m, outputs, inputs); not a number at undamped poles.
    channels
        One a pair that is not zero.
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
    """Return phases in radians without jumps of whole turns, not a number where gains are not.

    ``gains``: shape (m,), as the result.
    """
    phases = np.angle(gains)
    known = np.isfinite(phases)
    phases[known] = np.unwrap(phases[known])
    return np.asarray(phases, dtype=float)
