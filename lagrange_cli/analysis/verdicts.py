"""What is said of the stability of an equilibrium."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias

Verdict: TypeAlias = Literal[
    "stable",
    "asymptotically stable",
    "stable but for drift",
    "stable in the linear approximation",
    "unstable",
    "undecided",
]
"""What is proven of the motions that begin near an equilibrium, at most as much as is proven."""


@dataclass(frozen=True)
class Stability:
    """Stability of an equilibrium.

    Attributes
    ----------
    verdict
        What is proven.
    reason
        The theorem and what of it was found to hold, a short phrase.
    """

    verdict: Verdict
    reason: str
