"""Names in messages: quoted, and not more than can be read."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["quoted"]

#: Names that are listed; of more the first and the last ones.
_MOST, _ENDS = 12, 4


def quoted(names: Sequence[object]) -> str:
    """``'a', 'b', 'c'``, each once; of many ``'a', 'b', …, 'z' (40 in all)``."""
    different = [f"'{name}'" for name in dict.fromkeys(map(str, names))]
    if len(different) <= _MOST:
        return ", ".join(different)
    shown = [*different[:_ENDS], "...", *different[-_ENDS:]]
    return f"{', '.join(shown)} ({len(different)} in all)"
