"""Text of messages: quoted names, and expressions as a scene writes them."""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sp

#: Most names that are listed in full. Set by hand.
_MOST = 12
#: Names that are listed at each end of a longer list. Set by hand.
_ENDS = 4

#: Largest denominator of a number that is written as a fraction. Set by hand.
_LONGEST = 10**6


def quoted(names: Sequence[object]) -> str:
    """List names as ``'a', 'b', 'c'``, each once; many as ``'a', 'b', …, 'z' (40 in all)``."""
    different = [f"'{name}'" for name in dict.fromkeys(map(str, names))]
    if len(different) <= _MOST:
        return ", ".join(different)
    shown = [*different[:_ENDS], "...", *different[-_ENDS:]]
    return f"{', '.join(shown)} ({len(different)} in all)"


def contradict(names: Sequence[object], alone: str = "cannot hold") -> str:
    """Say that constraints contradict each other; of one by itself, that it ``alone``."""
    several = len(set(names)) > 1
    what = "contradict each other" if several else alone
    return f"constraint{'s' if several else ''} {quoted(names)} {what}"


def leave_out(names: Sequence[object]) -> str:
    """Write the hint for an irreducible inconsistent set: each name is one to leave out."""
    different = list(dict.fromkeys(names))
    if len(different) == 1:
        return f"leave out {quoted(different)}"
    if len(different) > _MOST:
        return "leave out any one of them"
    *first, last = (f"'{name}'" for name in different)
    return f"leave out {', '.join(first)} or {last}"


def written(expr: sp.Expr) -> str:
    """Write an expression as a scene does, long fractions as decimals."""
    long = {r: sp.Symbol(repr(float(r))) for r in expr.atoms(sp.Rational) if r.q > _LONGEST}
    return with_carets(expr.xreplace(long))


def with_carets(expr: sp.Expr) -> str:
    """Write an expression as SymPy does, with the powers of the scene language."""
    return str(expr).replace("**", "^")
