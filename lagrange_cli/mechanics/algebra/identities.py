"""Shortening of sums by sin² + cos² = 1 and the addition theorems.

A sum is a map from trigonometric monomials to weights; two monomials are
merged where the weights of some masses pair up. The work is linear in the
number of terms times the number of factors of one; nothing searches.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import lru_cache
from typing import TypeAlias

import sympy as sp

#: Sums and differences of angles that are kept.
_KEPT = 2**17

#: Largest multiple of an angle whose sine and cosine are written in those of the angle.
_LARGEST_MULTIPLE = 12

#: ``("sin" or "cos", argument)``
TrigFactor: TypeAlias = tuple[str, sp.Expr]
#: factor → power, in order of first appearance of the factors.
TrigMonomial: TypeAlias = tuple[tuple[TrigFactor, int], ...]
#: An exact number.
Rational: TypeAlias = int | Fraction
#: mass → rational coefficient
Weights: TypeAlias = dict[sp.Expr, Rational]
#: Sorts the factors of a monomial.
_Canonical: TypeAlias = Callable[[dict[TrigFactor, int]], TrigMonomial]


def by_single_angles(expression: sp.Expr) -> sp.Expr:
    """Write tangents as quotients, and sines and cosines of sums in those of the terms.

    Those of large multiples of an angle, polynomials of as many terms, stay.
    """
    quotients = expression.replace(sp.tan, lambda x: sp.sin(x) / sp.cos(x))
    functions = [f for f in quotients.atoms(sp.sin, sp.cos) if _has_small_multiples(f.args[0])]
    return quotients.xreplace({f: sp.expand_trig(f) for f in functions})


def _has_small_multiples(angle: sp.Expr) -> bool:
    multiples = [term.as_coeff_Mul()[0] for term in sp.Add.make_args(angle)]
    return all(abs(n) <= _LARGEST_MULTIPLE for n in multiples if n.is_Integer)


def shorten_trigonometric(group: dict[TrigMonomial, Weights], canonical: _Canonical) -> None:
    """Apply sin² + cos² = 1 and the addition theorems until none shortens the sum."""
    pending = list(group) if len(group) > 1 else []
    while pending and len(group) > 1:
        trig = pending.pop()
        if trig in group:
            pending.extend(_shorten_one(group, trig, canonical))


def _shorten_one(
    group: dict[TrigMonomial, Weights], trig: TrigMonomial, canonical: _Canonical
) -> list[TrigMonomial]:
    """Merge ``trig`` with a partner if there is one; return the monomials to look at again."""
    powers = dict(trig)

    def times(change: dict[TrigFactor, int]) -> TrigMonomial:
        return canonical(_changed(powers, change))

    for (name, argument), power in trig:
        if power >= 2:
            this, partner = (name, argument), (_partner(name), argument)
            base, swapped = times({this: -2}), times({this: -2, partner: 2})
            made = _merge(group, trig, swapped, base, 1)
            if made is None:
                # X − X cos² = X sin²
                made = _merge(group, base, trig, swapped, -1)
            if made is not None:
                return made
    for i, (first, _) in enumerate(trig):
        for second, _ in trig[i + 1 :]:
            made = _addition_theorem(group, trig, canonical, first, second)
            if made is not None:
                return made
    return []


def _addition_theorem(
    group: dict[TrigMonomial, Weights],
    trig: TrigMonomial,
    canonical: _Canonical,
    first: TrigFactor,
    second: TrigFactor,
) -> list[TrigMonomial] | None:
    """Apply cos a cos b ± sin a sin b = cos(a ∓ b) or sin a cos b ± cos a sin b = sin(a ± b)."""
    (f, a), (g, b) = first, second
    if f != g and a == b:
        return None
    base = {key: left for key, power in trig if (left := power - (key in (first, second)))}
    partner = canonical(_changed(base, {(_partner(f), a): 1, (_partner(g), b): 1}))
    if partner not in group:
        return None
    for sign in (1, -1):
        common = _paired(group[trig], group[partner], sign)
        if not common:
            continue
        if f == g:
            # (cos cos) + sign (sin sin) = cos(a − sign b)
            name, (argument, negative) = "cos", _angle(a, b, -sign)
            scale = 1 if f == "cos" else sign
        elif f == "sin":
            # (sin a cos b) + sign (cos a sin b) = sin(a + sign b)
            name, (argument, negative), scale = "sin", _angle(a, b, sign), 1
        else:
            # (cos a sin b) + sign (sin a cos b) = sin(b + sign a)
            name, (argument, negative), scale = "sin", _angle(b, a, sign), 1
        if argument is sp.S.Zero:
            continue
        if negative and name == "sin":
            scale = -scale
        target = canonical(_changed(base, {(name, argument): 1}))
        return _replace(group, trig, partner, target, common, scale)
    return None


@lru_cache(maxsize=_KEPT)
def _angle(a: sp.Expr, b: sp.Expr, sign: int) -> tuple[sp.Expr, bool]:
    """Give a ± b without a leading minus, and true if its sign was changed for that."""
    if sign < 0 and a.is_Symbol and b.is_Symbol:
        # As could_extract_minus_sign decides, which takes much longer.
        negative = b.sort_key() < a.sort_key()
        first, second = (b, a) if negative else (a, b)
        # As SymPy sorts the difference of two symbols.
        return sp.Add._from_args([first, -second], True), negative
    angle = a + sign * b
    negative = angle.could_extract_minus_sign()
    return (-angle if negative else angle), negative


def _partner(name: str) -> str:
    return "cos" if name == "sin" else "sin"


def _changed(powers: dict[TrigFactor, int], change: dict[TrigFactor, int]) -> dict[TrigFactor, int]:
    if not powers:
        return change
    result = dict(powers)
    for key, power in change.items():
        result[key] = result.get(key, 0) + power
    return {k: p for k, p in result.items() if p}


def _paired(ours: Weights, theirs: Weights, sign: int) -> Weights:
    """Select masses whose weights are c in one and sign·c in the other."""
    return {m: c for m, c in ours.items() if c != 0 and theirs.get(m, 0) == sign * c}


def _merge(
    group: dict[TrigMonomial, Weights],
    first: TrigMonomial,
    second: TrigMonomial,
    target: TrigMonomial,
    sign: int,
) -> list[TrigMonomial] | None:
    """Replace c·first + sign·c·second by c·target.

    Masses whose weights do not pair up stay where they are. None if no mass pairs up.
    """
    if first not in group or second not in group:
        return None
    common = _paired(group[first], group[second], sign)
    return _replace(group, first, second, target, common) if common else None


def _replace(
    group: dict[TrigMonomial, Weights],
    first: TrigMonomial,
    second: TrigMonomial,
    target: TrigMonomial,
    common: Weights,
    scale: int = 1,
) -> list[TrigMonomial]:
    """Replace first and second by scale·target for masses with their weights in first.

    Returns the monomials to look at again.
    """
    for source in (first, second):
        weights = group[source]
        for m in common:
            del weights[m]
        if not weights:
            del group[source]
    into = group.setdefault(target, {})
    for m, c in common.items():
        into[m] = into.get(m, 0) + scale * c
        if into[m] == 0:
            del into[m]
    if not into:
        del group[target]
        return [k for k in (first, second) if k in group]
    return [k for k in (target, first, second) if k in group] if len(group) > 1 else []
