"""Terms by which an expression differs from the multiple of another one that is closest to it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy
from sympy import Expr, Symbol

from lagrange_cli.mechanics.algebra.identities import by_single_angles
from lagrange_cli.mechanics.algebra.polynomials import expand_terms

#: Product of symbols and functions → its number.
_Terms: TypeAlias = dict[Expr, Expr]

#: Terms of an expression beyond which differences are not looked for, and multiples tried.
_MOST_TERMS, _MOST_MULTIPLES = 60, 200

#: Degree of a factor that a term is said to lack; others are told as two terms.
_MOST_DEGREE = 2


@dataclass(frozen=True)
class Difference:
    """A term that is off.

    Attributes
    ----------
    written
        The term as it was written; 0 if it is missing.
    right
        The term as it should be; 0 if there should be none.
    """

    written: Expr
    right: Expr

    @property
    def factor(self) -> Expr:
        """The factor that the written term lacks."""
        return self.right / self.written


@dataclass(frozen=True)
class Closest:
    """The closest multiple of one of several expressions.

    Attributes
    ----------
    index
        The place of the expression among those.
    differences
        The terms that are off.
    agreeing
        Number of terms that agree.
    """

    index: int
    differences: tuple[Difference, ...]
    agreeing: int


def closest(written: Expr, others: Sequence[Expr], leading: Sequence[Symbol]) -> Closest | None:
    """Compare an expression with multiples of others, term by term.

    Parameters
    ----------
    written
        The expression.
    others
        Those that it may be a multiple of.
    leading
        Symbols by whose terms multiples are chosen first, as accelerations.

    Returns
    -------
    The one with the fewest terms that are off; None if no multiple shares a term, or if there are
    too many terms.
    """
    best: Closest | None = None
    for by_angles in (False, True):
        terms = _terms(written, by_angles)
        for index, expression in enumerate(others if terms else ()):
            known = _terms(expression, by_angles)
            for multiple in _multiples(terms, known, leading):
                scaled = _collected(multiple * number * key for key, number in known.items())
                agreeing = sum(terms.get(key) == number for key, number in scaled.items())
                if not agreeing or (best is not None and agreeing < best.agreeing):
                    continue
                differences = tuple(_differences(terms, scaled))
                if best is None or len(differences) < len(best.differences):
                    best = Closest(index, differences, agreeing)
    return best


def _terms(expression: Expr, by_angles: bool) -> _Terms:
    """Return the terms of an expression, none if there are too many.

    ``by_angles``: over sines and cosines of single angles.
    """
    if by_angles:
        expression = by_single_angles(expression)
    parts = expand_terms(expression, _MOST_TERMS)
    if parts is None:
        return {}
    total = sympy.expand(sympy.Add(*parts))
    if by_angles:
        squares = {c: 1 - sympy.sin(c.args[0]) ** 2 for c in total.atoms(sympy.cos)}
        total = sympy.expand(
            total.replace(
                lambda e: e.is_Pow and e.base in squares and e.exp.is_Integer and e.exp > 1,
                lambda e: squares[e.base] ** (e.exp // 2) * e.base ** (e.exp % 2),
            )
        )
    return _collected(sympy.Add.make_args(total))


def _collected(terms: Iterable[Expr]) -> _Terms:
    pairs = (term.as_coeff_Mul() for term in terms)
    return {key: number for number, key in pairs if number != 0}


def _multiples(terms: _Terms, known: _Terms, leading: Sequence[Symbol]) -> list[Expr]:
    """Return ratios of terms that may be the factor between two expressions."""
    pairs = [
        (key, candidate)
        for key in terms
        for candidate in known
        if key.free_symbols & {*leading} == candidate.free_symbols & {*leading}
    ]
    pairs.sort(key=lambda pair: pair[0].free_symbols.isdisjoint(leading))
    ratios = (
        terms[key] * key / (known[candidate] * candidate)
        for key, candidate in pairs[:_MOST_MULTIPLES]
    )
    return list(dict.fromkeys(ratios))


def _differences(terms: _Terms, right: _Terms) -> Iterator[Difference]:
    """Yield terms that are off; those that are missing or too many in pairs that a simple factor
    tells apart."""
    missing = {key: number for key, number in right.items() if key not in terms}
    for key, number in terms.items():
        if key in right:
            if right[key] != number:
                yield Difference(number * key, right[key] * key)
            continue
        degrees = {candidate: _degree(candidate / key) for candidate in missing}
        partner = min(missing, key=lambda candidate: degrees[candidate], default=None)
        wanted = sympy.S.Zero
        if partner is not None and degrees[partner] <= _MOST_DEGREE:
            wanted = missing.pop(partner) * partner
        yield Difference(number * key, wanted)
    for key, number in missing.items():
        yield Difference(sympy.S.Zero, number * key)


def _degree(ratio: Expr) -> float:
    """Return the sum of the sizes of the exponents of a product of symbols; infinite for others."""
    powers = ratio.as_powers_dict()
    if not all(base.is_Symbol and power.is_number for base, power in powers.items()):
        return float("inf")
    return float(sum(abs(power) for power in powers.values()))
