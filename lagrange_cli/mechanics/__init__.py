"""Scene → Reduced → Equations: reduction, derivation, structure facts, certificate.

A scene goes in; :class:`~.equations.Equations` come out, with mass matrix, forcing, closures, facts
and initial state, all of them certified, or a refusal that names the fault.
Read :mod:`.derivation` first: it calls the rooms in order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lagrange_cli.mechanics.derivation import derive
    from lagrange_cli.mechanics.dynamics.lagrange import derive_uncertified
    from lagrange_cli.mechanics.interpretation import interpret
    from lagrange_cli.mechanics.reduction.reduce import reduce

__all__ = ["derive", "derive_uncertified", "interpret", "reduce"]

#: Modules of the names above. They are imported when a name is used: equations from the cache are
#: read without any of them.
_MODULES = {
    "derive": "derivation",
    "derive_uncertified": "dynamics.lagrange",
    "interpret": "interpretation",
    "reduce": "reduction.reduce",
}


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"{__name__}.{_MODULES[name]}"), name)
