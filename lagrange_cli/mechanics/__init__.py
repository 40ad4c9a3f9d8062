"""Scene → Reduced → Equations: reduction, derivation, structure facts, certificate."""

from lagrange_cli.mechanics.derivation import derive_uncertified
from lagrange_cli.mechanics.pipeline import derive, interpret
from lagrange_cli.mechanics.reduction import reduce

__all__ = ["derive", "derive_uncertified", "interpret", "reduce"]
