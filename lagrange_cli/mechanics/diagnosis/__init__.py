"""Refusals of scenes that cannot be reduced, and the proofs behind them.

Equations that leave nothing, or too much, go in; a refusal comes out that names the smallest set
of constraints at fault and says what to do. Read :mod:`.inconsistency` first.
"""

__all__ = ["errors", "inconsistency", "rod_lengths"]
