"""Expansion within a budget of terms, and SymPy's ``factor``, ``cancel`` and ``gcd`` within one.

The latter work on polynomials in the symbols, functions and roots of an expression, and may take
hours: for coefficients of hundreds of digits, for exp(10^18 x), which is exp(x) to that power
beside exp(x), and for hundreds of surds, each of them an unknown. Larger expressions stay as
written: a result is always equal to its argument, and perhaps shorter.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from functools import lru_cache
from itertools import chain, islice

import sympy as sp

from lagrange_cli.mechanics.free_symbols import symbols_in

# The budget, chosen so that no call takes noticeable time; none is tuned.

#: Nodes of the expressions.
_NODES = 3_000
#: Terms that they multiply out to.
_TERMS = 2_000
#: Bits of each number.
_BITS = 256
#: Different unknowns, roots of numbers included.
_UNKNOWNS = 24
#: Different roots of numbers.
_SURDS = 6
#: Factored forms that are kept: several ways to write a sum try the same parts.
_KEPT = 2**12
#: Counts of terms that are kept: expressions of a long chain of frames share most of their parts,
#: and a walk over each occurrence takes a time exponential in the length of the chain.
_COUNTED = 2**16
#: Expressions that may have several terms.
_COMPOUND = (sp.Add, sp.Mul, sp.Pow)
#: Highest power of an unknown.
_DEGREE = 128

#: Functions that are unknowns of their own, as SymPy's algorithms have it.
_UNKNOWN_FUNCTIONS = (sp.sin, sp.cos, sp.sinh, sp.cosh)


def has_more_nodes(expr: sp.Expr, nodes: int) -> bool:
    """Tell whether an expression has more than so many nodes; it is walked no further."""
    return any(True for _ in islice(sp.preorder_traversal(expr), nodes, None))


def expand_terms(expr: sp.Expr, budget: int) -> list[sp.Expr] | None:
    """Multiply out products and integer powers of sums; return the terms.

    None if more than ``budget`` terms would result; they are counted beforehand.
    Arguments of functions and denominators are left alone.
    """
    if term_count(expr) > budget:
        return None
    return _expand(expr)


def term_count(expr: sp.Expr) -> int:
    """Count the terms that products and powers of sums would expand to."""
    return _term_count(expr) if isinstance(expr, _COMPOUND) else 1


@lru_cache(maxsize=_COUNTED)
def _term_count(expr: sp.Expr) -> int:
    if expr.is_Add:
        return sum(map(term_count, expr.args))
    if expr.is_Mul:
        return math.prod(map(term_count, expr.args))
    if expr.exp.is_Integer and expr.exp.is_positive:
        return int(term_count(expr.base) ** min(int(expr.exp), 64))
    return 1


def degree_bound(expr: sp.Expr, symbols: AbstractSet[sp.Symbol]) -> int | None:
    """Bound the degree of an expression in some symbols; None if it is not seen to be a polynomial.

    Nothing is multiplied out: each part of the expression is looked at once, so that sums that
    cancel when they are may have a lower degree.
    """
    return _degree_bound(expr, symbols, {})


def _degree_bound(
    expr: sp.Expr, symbols: AbstractSet[sp.Symbol], known: dict[sp.Expr, int | None]
) -> int | None:
    if expr in symbols:
        return 1
    if not isinstance(expr, (sp.Add, sp.Mul, sp.Pow)):
        return 0 if symbols_in(expr).isdisjoint(symbols) else None
    if expr not in known:
        below = [_degree_bound(part, symbols, known) for part in expr.args]
        degrees = [degree for degree in below if degree is not None]
        if len(degrees) < len(below):
            known[expr] = None
        elif not expr.is_Pow:
            known[expr] = max(degrees) if expr.is_Add else sum(degrees)
        elif degrees == [0, 0]:
            known[expr] = 0
        else:
            natural = expr.exp.is_Integer and expr.exp.is_positive
            known[expr] = degrees[0] * int(expr.exp) if natural else None
    return known[expr]


def _expand(expr: sp.Expr) -> list[sp.Expr]:
    if expr.is_Add:
        return [t for a in expr.args for t in _expand(a)]
    if expr.is_Mul:
        factors = [_expand(a) for a in expr.args]
        is_one_term = all(terms == [a] for terms, a in zip(factors, expr.args, strict=True))
        return [expr] if is_one_term else _product(factors)
    if expr.is_Pow and expr.exp.is_Integer and expr.exp.is_positive and term_count(expr.base) > 1:
        return _product([_expand(expr.base)] * int(expr.exp))
    return [expr]


def _product(factors: list[list[sp.Expr]]) -> list[sp.Expr]:
    terms = factors[0]
    for factor in factors[1:]:
        terms = [sp.Mul(a, b) for a in terms for b in factor]
    return terms


@lru_cache(maxsize=_KEPT)
def factored_form(expr: sp.Expr) -> sp.Expr:
    """Write an expression as a product; itself beyond the budget."""
    factors = sp.Mul.make_args(expr)
    if all(_is_plainly_irreducible(f) if f.is_Add else f.is_Atom for f in factors):
        return expr
    return sp.factor(expr) if _is_within_budget(expr) else expr


def _is_plainly_irreducible(expr: sp.Expr) -> bool:
    """Tell whether a sum has no factors, since an unknown x stands in one term a·x or a·x² alone.

    A factor without x divides a and all other terms: none does where each unknown of a is missing
    in one of these, and no number divides all. Two factors with x are (u x + v)(u x − v), whose
    squares u² and −v² have different signs: not all terms have one sign then.
    """
    terms = [_powers(term) for term in expr.args] if expr.is_Add else []
    known = [powers for powers in terms if powers is not None]
    if len(known) < len(terms) or not terms:
        return False
    numbers = [term.as_coeff_Mul(rational=True)[0] for term in expr.args]
    if any(n.q != 1 for n in numbers) or sp.igcd(0, *(n.p for n in numbers)) != 1:
        return False
    highest = 2 if len({n > 0 for n in numbers}) == 1 else 1
    for powers in known:
        others = [p for p in known if p is not powers]
        missing = {x: all(x not in p for p in others) for x in powers}
        if any(missing[x] and powers[x] <= highest for x in powers) and all(
            any(y not in p for p in others) for y in powers
        ):
            return True
    return False


def _powers(term: sp.Expr) -> dict[sp.Expr, int] | None:
    """The unknowns of a term with their powers; None if it is no product of such powers."""
    powers = {}
    for factor in sp.Mul.make_args(term):
        base, exponent = factor.as_base_exp()
        if factor.is_Rational:
            continue
        if not (base.is_Symbol or isinstance(base, _UNKNOWN_FUNCTIONS)):
            return None
        if not (exponent.is_Integer and exponent.is_positive):
            return None
        powers[base] = int(exponent)
    return powers


def cancelled(expr: sp.Expr) -> sp.Expr:
    """Write an expression as one fraction in lowest terms; itself beyond the budget."""
    return sp.cancel(expr) if _is_within_budget(expr) else expr


def common_divisor(expressions: Sequence[sp.Expr]) -> sp.Expr:
    """Find the greatest common divisor; 1 beyond the budget."""
    return sp.gcd(list(expressions)) if _is_within_budget(*expressions) else sp.Integer(1)


def _is_within_budget(*expressions: sp.Expr) -> bool:
    """Say whether expressions are small enough for algorithms on polynomials."""
    unknowns: set[sp.Expr] = set()
    surds: set[sp.Expr] = set()
    for count, part in enumerate(chain.from_iterable(map(sp.preorder_traversal, expressions))):
        if count >= _NODES or not _has_small_numbers(part):
            return False
        if part.is_Pow and part.is_number:
            surds.add(part)
        elif part.is_Symbol or part.is_Function:
            unknowns.add(part)
        if len(unknowns) + len(surds) > _UNKNOWNS or len(surds) > _SURDS:
            return False
    return sum(map(term_count, expressions)) <= _TERMS


def _has_small_numbers(part: sp.Expr) -> bool:
    """Say whether coefficients are short, and powers low."""
    if part.is_Rational:
        return max(int(part.p).bit_length(), int(part.q).bit_length()) <= _BITS
    if part.is_Pow and part.exp.is_Rational:
        return bool(max(abs(part.exp.p), part.exp.q) <= _DEGREE)
    if part.func is sp.exp:
        # exp(n u) is the unknown exp(u) to the power n; exponents are multiplied out.
        exponents = expand_terms(part.args[0], _UNKNOWNS)
        if exponents is None:
            return False
        factors = (term.as_coeff_Mul()[0] for term in exponents)
        return all(f.is_Rational and max(abs(f.p), f.q) <= _DEGREE for f in factors)
    return True
