"""Names in messages: quoted, and not more than can be read."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

__all__ = ["leave_out", "quoted", "with_carets", "written"]

#: Names that are listed; of more the first and the last ones.
_MOST, _ENDS = 12, 4

#: Denominators beyond which a number is written as a decimal.
_LONGEST = 10**6


def quoted(names: Sequence[object]) -> str:
    """``'a', 'b', 'c'``, each once; of many ``'a', 'b', …, 'z' (40 in all)``."""
    different = [f"'{name}'" for name in dict.fromkeys(map(str, names))]
    if len(different) <= _MOST:
        return ", ".join(different)
    shown = [*different[:_ENDS], "...", *different[-_ENDS:]]
    return f"{', '.join(shown)} ({len(different)} in all)"


def leave_out(names: Sequence[object]) -> str:
    """The hint at a smallest set of which no member is consistent with all the others."""
    different = list(dict.fromkeys(names))
    if len(different) == 1:
        return f"leave out {quoted(different)}"
    if len(different) > _MOST:
        return "leave out any one of them"
    *first, last = (f"'{name}'" for name in different)
    return f"leave out {', '.join(first)} or {last}"


def written(expr: sp.Expr) -> str:
    """An expression as a scene writes it; long fractions as the decimals that they are."""
    long = {r: sp.Symbol(repr(float(r))) for r in expr.atoms(sp.Rational) if r.q > _LONGEST}
    return with_carets(expr.xreplace(long))


def with_carets(expr: sp.Expr) -> str:
    """An expression as SymPy writes it, with the powers of the scene language."""
    return str(expr).replace("**", "^")
