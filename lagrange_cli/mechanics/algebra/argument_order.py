"""SymPy's order of the arguments of sums and products, as keys for sorting.

``Basic.compare`` walks two expressions at each comparison; a key is made once for each expression.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import sympy as sp
from sympy.core.basic import ordering_of_classes

#: Keys that are kept.
_KEPT = 2**16

_RANKS = {name: k for k, name in enumerate(ordering_of_classes)}


@lru_cache(maxsize=_KEPT)
def sympy_order(expr: sp.Basic) -> tuple[Any, ...]:
    """Make a key by which expressions are sorted as by ``Basic.compare``.

    Classes come first, those that SymPy does not list by their names, then the number of parts,
    then each part.
    """
    name = type(expr).__name__
    rank = _RANKS.get(name)
    kind = (len(_RANKS), name) if rank is None else (rank, "")
    content = expr._hashable_content()
    parts = [sympy_order(part) if isinstance(part, sp.Basic) else part for part in content]
    return (*kind, len(parts), *parts)
