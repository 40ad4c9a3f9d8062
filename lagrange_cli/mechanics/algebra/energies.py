"""Short forms of energies: particle by particle, or collected over all of them."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence

import sympy as sp

from lagrange_cli.mechanics.algebra.collect import Splitter, TermSum, collected_terms
from lagrange_cli.mechanics.algebra.factor import (
    common_factor,
    factored,
    group_by_velocities,
    grouped_sum,
    scaled,
)
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length, sum_size
from lagrange_cli.mechanics.algebra.shortest import joined
from lagrange_cli.mechanics.free_symbols import symbols_in

#: Terms that an energy may be multiplied out to while a shorter form is sought: longer ones are not
#: readable in any form. Not tuned.
_TERM_BUDGET = 60


def shortest_energy(
    energy: sp.Expr,
    velocities: Sequence[sp.Symbol],
    splitter: Splitter,
    constants: frozenset[sp.Symbol],
    brackets: Collection[sp.Expr],
) -> sp.Expr:
    """Collect an energy over all its terms, where that is shorter.

    Parameters
    ----------
    velocities
        Velocities in their order; terms with the same ones stand together.
    splitter
        Splits terms, and knows the masses, which are gathered.
    constants
        Symbols of parameters.
    brackets
        Sums that stay as they are, since the scene wrote them.

    Returns
    -------
    Expr
        The energy as it is, with one factor in front, or with terms of one factor of parameters
        together: ``½ (m1 + m2) (Ẋ² + Ẏ²) + ½ m1 m2/(m1 + m2) (ṙ² + r² φ̇²)``.
    """
    if not energy.is_Add:
        return _with_factors_in_front(energy, brackets)
    # Sums of squares of velocities may be opened: ``I (θ̇1² + θ̇2²)`` beside T of particles.
    rates = frozenset(velocities)
    closed = [e for e in brackets if any(_degree(term, rates) != 2 for term in e.args)]
    tried = [brackets] if len(closed) == len(brackets) else [brackets, closed]
    ways = [way for b in tried for way in _ways(energy, velocities, splitter, constants, b)]
    shorter = [way for way in ways if printed_length(way) <= printed_length(energy)]
    return min([energy, *shorter], key=sum_size)


def _with_factors_in_front(energy: sp.Expr, brackets: Collection[sp.Expr]) -> sp.Expr:
    """Write ``m g (½ R sin α + ½ R sin β)`` as ``½ m g R (sin α + sin β)``."""
    factors = sp.Mul.make_args(energy)
    sums = [f for f in factors if f.is_Add and f not in brackets]
    if len(sums) != 1:
        return energy
    (inner,) = sums
    number, common = common_factor([*inner.args]).as_coeff_Mul(rational=True)
    if number * common == 1:
        return energy
    cofactor = sp.Add(*(term / number / common for term in inner.args))
    outer, product = sp.Mul(*(f for f in factors if f is not inner)).as_coeff_Mul(rational=True)
    shown = scaled(outer * number, product * common * cofactor)
    return shown if printed_length(shown) < printed_length(energy) else energy


def _ways(
    energy: sp.Expr,
    velocities: Sequence[sp.Symbol],
    splitter: Splitter,
    constants: frozenset[sp.Symbol],
    brackets: Collection[sp.Expr],
) -> list[sp.Expr]:
    """Collect an energy over all its terms in several ways; none beyond the budget of terms."""
    stand_ins = {e: sp.Symbol(f"({k})", real=True) for k, e in enumerate(brackets)}
    expanded = expand_terms(energy.xreplace(stand_ins), _TERM_BUDGET)
    if expanded is None:
        return []
    constants |= {s for e, s in stand_ins.items() if e.free_symbols <= constants}
    total = TermSum(splitter)
    total.add_all(e for e in expanded if e != 0)
    terms = total.collected()
    written = {s: e for e, s in stand_ins.items()}
    ways = [by_parameters(terms, constants, velocities)]
    if len({_degree(term, velocities) for term in terms}) == 1:
        ways += _in_front(terms, constants, velocities)
    return [way.xreplace(written) for way in ways]


def by_parameters(
    terms: Sequence[sp.Expr], constants: frozenset[sp.Symbol], velocities: Sequence[sp.Symbol]
) -> sp.Expr:
    """Put terms together that have the same parameters as factors, and the same degree."""
    groups: dict[tuple[sp.Expr, int | None], list[sp.Expr]] = {}
    for term in terms:
        key = _weight(term, constants), _degree(term, velocities)
        groups.setdefault(key, []).append(term)
    products = [
        next(_in_front(group, constants, velocities), sp.Add(*group))
        if len(group) > 1
        else group[0]
        for group in groups.values()
    ]
    return sp.Add(*joined(products, constants))


def _weight(term: sp.Expr, constants: frozenset[sp.Symbol]) -> sp.Expr:
    """Collect the factors of a term that are parameters."""
    factors = sp.Mul.make_args(term)
    return sp.Mul(*(f for f in factors if f.free_symbols and f.free_symbols <= constants))


def _in_front(
    terms: Sequence[sp.Expr], constants: frozenset[sp.Symbol], velocities: Sequence[sp.Symbol]
) -> Iterator[sp.Expr]:
    """Factor out parameters if none remain in the terms, or all that moves.

    The terms keep integers: ``½ m l² (3 θ̇1² + θ̇2²)``, ``½ (m + I/R²) ṡ²``.
    """
    whole = common_factor(list(terms))
    if whole == 1:
        return
    number, common = whole.as_coeff_Mul(rational=True)
    divisor = 1 / whole
    quotients = [term * divisor for term in terms]
    is_integer = all(t.as_coeff_Mul(rational=True)[0].is_Integer for t in quotients)
    unweighted = common.free_symbols <= constants and all(
        _weight(t, constants) == 1 for t in quotients
    )
    still = all(t.free_symbols <= constants for t in quotients)
    if not is_integer or not (unweighted or still):
        return
    if all(t.could_extract_minus_sign() for t in quotients):
        number, quotients = -number, [-t for t in quotients]
    if still:
        inner = sp.Add(*quotients)
    else:
        groups = group_by_velocities(quotients, velocities)
        inner = sp.Add(*(factored(cofactors) * rates for rates, cofactors in groups))
    yield scaled(number, common * inner)


def parts_by_degree(
    kinetic: sp.Expr, velocities: Sequence[sp.Symbol]
) -> tuple[sp.Expr, sp.Expr, sp.Expr] | None:
    """Write T as T2 + T1 + T0 by the degree in velocities, with the terms of T where they are one.

    None if T is no polynomial of degree 2, or has too many terms.
    """
    parts: dict[int, list[sp.Expr]] = {0: [], 1: [], 2: []}
    for term in sp.Add.make_args(kinetic):
        expanded = expand_terms(term, _TERM_BUDGET)
        degrees = None if expanded is None else [_degree(e, velocities) for e in expanded]
        if expanded is None or degrees is None or not set(degrees) <= {0, 1, 2}:
            return None
        if len(set(degrees)) == 1:
            parts[degrees[0] or 0].append(term)
            continue
        for degree, group in parts.items():
            chosen = [e for e, d in zip(expanded, degrees, strict=True) if d == degree]
            group += [grouped_sum(collected_terms(chosen), velocities)] if chosen else []
    return sp.Add(*parts[2]), sp.Add(*parts[1]), sp.Add(*parts[0])


def moving_part(
    energy: sp.Expr, coordinates: Collection[sp.Symbol], velocities: Collection[sp.Symbol]
) -> tuple[sp.Expr, sp.Expr]:
    """Split an energy into the terms that hold a coordinate or a velocity, and the others.

    A sum that is the one factor of a term that holds them is split too:
    ``m g (A cos(Ω t) - l cos θ)`` into ``-m g l cos θ`` and ``m g A cos(Ω t)``. Powers are not.
    With velocities it stays otherwise as it is, so that it is that of T.
    """
    moving = {*coordinates, *velocities}
    moving_terms, others = [], []
    for term in sp.Add.make_args(energy):
        factors = sp.Mul.make_args(term)
        moving_factors = [f for f in factors if not symbols_in(f).isdisjoint(moving)]
        inner, still = moving_factors[0] if moving_factors else sp.S.Zero, sp.S.Zero
        if not moving_factors:
            others.append(term)
        elif len(moving_factors) == 1 and inner.is_Add:
            inner, still = moving_part(inner, coordinates, velocities)
            is_still = symbols_in(inner).isdisjoint(velocities)
            inner = _in_front_of(inner, coordinates) if is_still else inner
        if still == 0:
            moving_terms += [term] if moving_factors else []
            continue
        number, scale = sp.Mul(*(f for f in factors if f != moving_factors[0])).as_coeff_Mul(
            rational=True
        )
        for part, into in ((inner, moving_terms), (still, others)):
            content, product = part.as_coeff_Mul(rational=True)
            into.append(scaled(number * content, scale * product))
    return sp.Add(*moving_terms), sp.Add(*others)


def _in_front_of(energy: sp.Expr, moving: Collection[sp.Symbol]) -> sp.Expr:
    """Put the factors of a sum that hold none of some symbols in front of it."""
    terms = sp.Add.make_args(energy)
    number, product = common_factor([*terms]).as_coeff_Mul(rational=True)
    factors = sp.Mul.make_args(product)
    common = sp.Mul(*(f for f in factors if symbols_in(f).isdisjoint(moving)))
    return scaled(number, common * sp.Add(*(term / number / common for term in terms)))


def _degree(term: sp.Expr, velocities: Collection[sp.Symbol]) -> int | None:
    """The degree of a product in velocities; None if these are in functions or denominators."""
    degree = 0
    for factor in sp.Mul.make_args(term):
        base, exponent = factor.as_base_exp()
        if base in velocities and exponent.is_Integer and exponent.is_positive:
            degree += int(exponent)
        elif not symbols_in(factor).isdisjoint(velocities):
            return None
    return degree


def over_roots(terms: list[sp.Expr]) -> list[sp.Expr]:
    """Put terms over one root where that leaves fewer: ``v²/√(1 - v²) + √(1 - v²)``."""
    bases = {f.base for t in terms for f in sp.Mul.make_args(t) if f.is_Pow and _is_half(f.exp)}
    for base in sorted(bases, key=sp.default_sort_key):
        powers = {t: dict(f.as_base_exp() for f in sp.Mul.make_args(t)).get(base) for t in terms}
        half_powers = {t: e for t, e in powers.items() if e is not None and _is_half(e)}
        if len(set(half_powers.values())) < 2:
            continue
        lowest = min(half_powers.values())
        whole = sp.Add(*(t / base**e * base ** (e - lowest) for t, e in half_powers.items()))
        expanded = expand_terms(whole, _TERM_BUDGET)
        numerator = collected_terms(expanded) if expanded is not None else list(half_powers)
        if len(numerator) < len(half_powers):
            others = [t for t in terms if t not in half_powers]
            terms = others + [t * base**lowest for t in numerator]
    return terms


def _is_half(exponent: sp.Expr) -> bool:
    return bool(exponent.is_Rational and exponent.q == 2)
