"""SymPy's order of the arguments of sums and products, as keys for sorting.

``Basic.compare`` walks two expressions at each comparison; a key is made once for each expression.
"""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy.core.basic import ordering_of_classes

#: Keys that are kept.
_KEPT = 2**18

#: ``id`` of an expression → the expression, which keeps its id from being given away, and its key.
#: By identity, since to compare with an equal expression of before takes longer than a new key.
_KEYS: dict[int, tuple[sp.Basic, tuple[Any, ...]]] = {}

_RANKS = {name: k for k, name in enumerate(ordering_of_classes)}


def sympy_order(expr: sp.Basic) -> tuple[Any, ...]:
    """Make a key by which expressions are sorted as by ``Basic.compare``."""
    known = _KEYS.get(id(expr))
    if known is None:
        if len(_KEYS) >= _KEPT:
            _KEYS.clear()
        known = _KEYS[id(expr)] = expr, _new_key(expr)
    return known[1]


def _new_key(expr: sp.Basic) -> tuple[Any, ...]:
    """Put classes first, those that SymPy does not list by their names, then the parts.

    Expressions of fewer parts stand before others of their class.
    """
    name = type(expr).__name__
    rank = _RANKS.get(name)
    kind = (len(_RANKS), name) if rank is None else (rank, "")
    content = expr._hashable_content()
    parts = [sympy_order(part) if isinstance(part, sp.Basic) else part for part in content]
    return (*kind, len(parts), *parts)
