"""Sums, products and powers as SymPy evaluates them, built in less time.

``Basic.compare`` walks two expressions at each comparison; here a key is made once for each
expression, and arguments are sorted by keys. SymPy compares terms pair by pair, and makes new ones
of their coefficients and the rest: of sums of hundreds of terms that takes longer than any further
work on them. A term here stays the object that it is, unless there is another one like it. SymPy
also asks whether a term of a power's base is infinite, and builds the powers in a product anew: for
the energy of a spring that takes longer than any further work on it.
"""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterable, Sequence
from typing import Any, TypeAlias

import sympy as sp
from sympy.core.basic import ordering_of_classes

from lagrange_cli.mechanics.free_symbols import symbols_in

_ZERO, _ONE, _MINUS_ONE = sp.S.Zero, sp.S.One, sp.S.NegativeOne

#: A term without its coefficient: its factors, or the only one.
_Rest: TypeAlias = sp.Basic | tuple[sp.Basic, ...]

#: Most keys that are kept.
_KEPT = 2**18

#: ``id`` of an expression → the expression, which keeps its id from being given away, and its key.
#: By identity, since to compare with an equal expression of before takes longer than a new key.
_KEYS: dict[int, tuple[sp.Basic, tuple[Any, ...]]] = {}

#: Fewest terms of a sum that is known to be in order, and most such sums that are kept.
_LONG, _MOST_ORDERED = 16, 2**12

#: Terms in order, for each that joins them, from which on it is put in its place.
_FEW = 4

#: ``id`` of a sum in order → the sum, which keeps its id from being given away.
_ORDERED: dict[int, sp.Expr] = {}

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
    """Make a key of the class, the number of parts, and the parts.

    Classes that SymPy does not list are sorted by their names.
    """
    name = type(expr).__name__
    rank = _RANKS.get(name)
    kind = (len(_RANKS), name) if rank is None else (rank, "")
    content = expr._hashable_content()
    parts = [sympy_order(part) if isinstance(part, sp.Basic) else part for part in content]
    return (*kind, len(parts), *parts)


def plain_sum(terms: Iterable[sp.Expr]) -> sp.Expr:
    """Add expressions of the scene language.

    A sum that holds another one stays as it is (:func:`nested_sum`).
    """
    addends = list(terms)
    if any(part.is_Add for addend in addends if addend.is_Add for part in addend.args):
        return nested_sum(addends)
    number, like_terms = _ZERO, dict[_Rest, list[sp.Expr]]()
    for term in _flat(addends):
        if term.is_Rational:
            number += term
            continue
        parts = _coefficient_and_rest(term)
        if parts is None:
            return sp.Add(*addends)
        count, product_part = parts
        new = [count, term]
        like = like_terms.setdefault(product_part, new)
        if like is not new:
            like[0] += count
            like[1] = _scaled(like[0], product_part)
    ordered = _in_order([t for _, t in like_terms.values() if t is not _ZERO], addends)
    if number is not _ZERO:
        ordered.insert(0, number)
    total = sp.Add._from_args(ordered, True)
    if len(ordered) >= _LONG:
        if len(_ORDERED) >= _MOST_ORDERED:
            _ORDERED.clear()
        _ORDERED[id(total)] = total
    return total


def nested_sum(terms: Sequence[sp.Expr]) -> sp.Expr:
    """Add expressions, sums among them, as they are.

    SymPy makes all terms of sums terms of the whole. Along a chain, whose places are that of the
    last frame and one more term each, all places together have the square of its length.
    """
    present = [term for term in terms if term is not _ZERO]
    return sp.Add(*present, evaluate=False) if len(present) > 1 else sp.Add(*present)


def _in_order(terms: list[sp.Expr], addends: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Sort terms; few that join those of a long sum, which are in order, are put in their places.

    Terms of a chain of frames are alike to their depth: each comparison takes as long as that.
    """
    longest = max((a for a in addends if id(a) in _ORDERED), key=_length, default=None)
    if longest is None:
        return sorted(terms, key=sympy_order)
    known = set(map(id, longest.args))
    ordered = [term for term in terms if id(term) in known]
    fresh = [term for term in terms if id(term) not in known]
    if _FEW * len(fresh) > len(ordered):
        return sorted(terms, key=sympy_order)
    for term in fresh:
        insort(ordered, term, key=sympy_order)
    return ordered


def _length(total: sp.Expr) -> int:
    return len(total.args)


def _flat(terms: Sequence[sp.Expr]) -> Iterable[sp.Expr]:
    for term in terms:
        if term.is_Add:
            yield from _flat(term.args)
        else:
            yield term


def _coefficient_and_rest(term: sp.Expr) -> tuple[sp.Rational, _Rest] | None:
    """Split a term into number and factors; None if SymPy may evaluate it further."""
    if term.is_Mul:
        factors = term.args
        if not factors[0].is_Number:
            return _ONE, factors
        if len(factors) > 2:
            is_plain = factors[0].is_Rational and not factors[1].is_Number
            return (factors[0], factors[1:]) if is_plain else None
        count, factor = factors
        is_plain = count.is_Rational and (factor.is_Add or _is_plain(factor))
        return (count, factor) if is_plain else None
    return (_ONE, term) if _is_plain(term) else None


def _is_plain(factor: sp.Expr) -> bool:
    """Tell whether a factor is a symbol, a power of a base with symbols, or a function but exp."""
    if factor.is_Pow:
        return not factor.base.is_number
    return bool(factor.is_Symbol or (factor.is_Function and factor.func is not sp.exp))


def _scaled(count: sp.Rational, factors_of_term: _Rest) -> sp.Expr:
    """Multiply the factors of a term by a number."""
    if count is _ZERO:
        return _ZERO
    factors = factors_of_term if isinstance(factors_of_term, tuple) else (factors_of_term,)
    return sp.Mul._from_args(factors if count is _ONE else (count, *factors), True)


def negative(expr: sp.Expr) -> sp.Expr:
    """Change the sign of an expression, term by term of a sum."""
    return plain_sum(map(_opposite, expr.args)) if expr.is_Add else -expr


def _opposite(term: sp.Expr) -> sp.Expr:
    if term.is_Symbol:
        return sp.Mul._from_args((_MINUS_ONE, term), True)
    factors = term.args
    if not term.is_Mul or factors[1].is_Number:
        return _MINUS_ONE * term
    number, further = (factors[0], factors[1:]) if factors[0].is_Number else (_ONE, factors)
    return sp.Mul._from_args(further if number is _MINUS_ONE else (-number, *further), True)


def monomial(number: sp.Rational, factors: list[sp.Expr]) -> sp.Expr:
    """Multiply ``number`` and factors.

    Different plain factors are only sorted, which is much faster than SymPy's product.
    """
    present = [f for f in factors if f is not _ONE]
    bases = set()
    for factor in present:
        base = factor
        if factor.is_Pow:
            base, exponent = factor.args
            if not exponent.is_Integer:
                return sp.Mul(number, *factors)
        if not (base.is_Symbol or base.is_Function or base.is_Add):
            return sp.Mul(number, *factors)
        bases.add(base)
    if not len(bases) == len(present) > 1:
        return sp.Mul(number, *factors)
    present.sort(key=sympy_order)
    return sp.Mul._from_args(present if number is _ONE else [number, *present], True)


def power(base: sp.Expr, exponent: sp.Expr) -> sp.Expr:
    """Build a power; one of a sum with symbols, which are finite, is not evaluated."""
    if base.is_Add and exponent.is_Rational and exponent not in (0, 1) and symbols_in(base):
        return sp.Pow(base, exponent, evaluate=False)
    return sp.Pow(base, exponent)


def product(factors: Sequence[sp.Expr]) -> sp.Expr:
    """Multiply; different symbols, their powers and those of sums are only sorted."""
    parts = [part for f in factors for part in (f.args if f.is_Mul else (f,))]
    numbers = [part for part in parts if part.is_Rational]
    others = [part for part in parts if not part.is_Rational]
    if 0 in numbers or not all(f.is_Symbol or _is_plain_power(f) for f in others):
        return sp.Mul(*factors)
    return monomial(sp.Mul(*numbers), others)


def _is_plain_power(factor: sp.Expr) -> bool:
    """Tell whether a factor is a power of a sum with symbols, or an integer power of a symbol."""
    if not factor.is_Pow:
        return False
    base, exponent = factor.args
    if base.is_Symbol:
        return bool(exponent.is_Integer)
    return bool(base.is_Add and symbols_in(base))
