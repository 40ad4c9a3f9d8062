"""Sources of the equations of motion, from which code may derive them anew."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol


@dataclass(frozen=True, eq=False)
class DerivationSources:
    """The sources of the equations of motion beside positions and forces, for another derivation.

    Attributes
    ----------
    other_lagrangian
        The Lagrangian without ½ m ṙ² of the particles.
    forcing
        The forcing that was derived from this; equations with another one are not of these sources.
    collected_terms
        Number of terms of mass matrix and forcing; None if sums were left factored.
    state
        A state of the certificate: symbol → value with its digits, multipliers included.
    residuals
        M q̈ − f − Σ λ·gradient there, each with the size of its terms.
    energy
        The energy function that is shown, which the certificate compared with Σ q̇ ∂L/∂q̇ − L.
    energy_value
        The value of Σ q̇ ∂L/∂q̇ − L there.
    """

    other_lagrangian: Expr
    forcing: tuple[Expr, ...]
    collected_terms: int | None
    state: Mapping[Symbol, mpf]
    residuals: tuple[tuple[mpf, mpf], ...]
    energy: Expr
    energy_value: mpf
