"""Equations → Model: what a simulation needs of them, without symbols.

Equations go in; numbers and texts of functions come out, which are kept in the cache, so that a
second run needs no SymPy. Read :mod:`.model`, then :mod:`.build`.
"""

__all__ = ["build", "inputs", "labels", "model", "requested_outputs", "sensitivities"]
