"""Scene → Reduced → Equations: reduction, derivation, structure facts, certificate.

A scene goes in; :class:`~.equations.Equations` come out, with mass matrix, forcing, closures, facts
and initial state, all of them certified, or a refusal that names the fault.
Read :mod:`.derivation` first: it calls the rooms in order.
"""

from lagrange_cli.mechanics.derivation import derive
from lagrange_cli.mechanics.dynamics.lagrange import derive_uncertified
from lagrange_cli.mechanics.interpretation import interpret
from lagrange_cli.mechanics.reduction.reduce import reduce

__all__ = ["derive", "derive_uncertified", "interpret", "reduce"]
