"""Proofs that an expression is continuous along every motion.

A quantity whose rate vanishes on both sides of a surface is conserved only if it does not jump
there. Jumps come from ``sign`` and ``atan2``, and from quotients and functions of infinite
arguments: x/|x|, atan(1/x). No motion passes through a state at which a quantity is infinite.
"""

from __future__ import annotations

from collections.abc import Collection, Hashable, Iterator
from dataclasses import dataclass

import sympy as sp

from lagrange_cli.mechanics.algebra.alpha_equivalence import shape
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.free_symbols import is_unknown, symbols_in
from lagrange_cli.mechanics.kinks import BENT, Cases

#: Most operations in a radicand whose zeros are examined, so that this stays quick; a longer one
#: counts as one that may bend. Not tuned.
_RADICAND_BUDGET = 100

#: Most terms of a form in a unit vector: of three components, each of up to three terms. Not tuned.
_SQUARES = 9

#: Functions that are continuous wherever their argument is.
_CONTINUOUS = (
    *(sp.sin, sp.cos, sp.exp, sp.sinh, sp.cosh, sp.tanh),
    *(sp.asin, sp.acos, sp.atan, sp.asinh, sp.acosh),
)
#: Functions, real analytic everywhere, that are smooth wherever their argument is.
_ANALYTIC = (sp.sin, sp.cos, sp.sinh, sp.cosh, sp.tanh, sp.asinh)
#: Functions that are infinite somewhere.
_INFINITE = (sp.tan, sp.log, sp.atanh)
#: Inverse functions, which bend where a periodic function in them turns.
_INVERSE = (sp.asin, sp.acos, sp.atan)
#: Periodic functions.
_PERIODIC = (sp.sin, sp.cos, sp.tan)


@dataclass(frozen=True)
class _Nature:
    """Properties of an expression without jumps.

    Attributes
    ----------
    infinite
        It may become infinite somewhere.
    bent
        It may become another analytic function across a surface.
    """

    infinite: bool = False
    bent: bool = False


#: The nature of all smooth expressions, and a mark for expressions not examined yet.
_SMOOTH, _UNKNOWN = _Nature(), _Nature()


def is_continuous(expression: sp.Expr, moving: Collection[sp.Symbol]) -> bool:
    """Say whether an expression is proven continuous in ``moving`` wherever it is finite."""
    return _is_polynomial(expression) or _Natures(frozenset(moving)).nature(expression) is not None


def is_analytic(expression: sp.Expr, moving: Collection[sp.Symbol]) -> bool:
    """Say whether an expression is proven to be one analytic function on all of its domain."""
    if _is_polynomial(expression):
        return True
    nature = _Natures(frozenset(moving)).nature(expression)
    return nature is not None and not nature.bent


def _is_polynomial(expression: sp.Expr) -> bool:
    """Say whether nothing but sums, products and whole powers stands in an expression."""
    stack, seen = [expression], set[int]()
    while stack:
        top = stack.pop()
        if id(top) in seen:
            continue
        seen.add(id(top))
        if top.is_Add or top.is_Mul:
            stack += top.args
        elif top.is_Pow and top.exp.is_Integer and top.exp.is_positive:
            stack.append(top.base)
        elif not (top.is_Symbol or top.is_Rational):
            return False
    return True


def _is_passed(e: sp.Expr) -> bool:
    """Tell whether an expression is smooth wherever all of its arguments are."""
    return bool(e.is_Add or e.is_Mul or e.func in _ANALYTIC)


class _Natures:
    def __init__(self, moving: frozenset[sp.Symbol]) -> None:
        self.moving = moving
        self.known: dict[sp.Expr, _Nature | None] = {}
        self._simple: dict[Hashable, bool] = {}
        #: Identities of objects within the expression that are smooth.
        self._smooth: set[int] = set()

    def nature(self, e: sp.Expr) -> _Nature | None:
        """Give the nature of an expression; None if it may jump."""
        if e.is_Symbol:
            return _SMOOTH
        known = self.known.get(e, _UNKNOWN)
        if known is _UNKNOWN:
            known = self._nature(e)
            known = self.known[e] = _SMOOTH if known == _SMOOTH else known
        return known

    def _nature(self, e: sp.Expr) -> _Nature | None:
        if _is_passed(e) and self._has_smooth_parts(e):
            return _SMOOTH
        if self.moving.isdisjoint(symbols_in(e)):
            return _SMOOTH
        if isinstance(e, sp.exp):
            return self._function(e)
        if isinstance(e, Cases) and not self._joins(e):
            return None
        parts = [self.nature(a) for a in e.args]
        natures = [p for p in parts if p is not None]
        if len(natures) < len(parts):
            return None
        whole = _Nature(any(p.infinite for p in natures), any(p.bent for p in natures))
        if e.is_Add:
            return whole
        if e.is_Mul:
            return None if self._cancels(e, whole) else whole
        if e.is_Pow:
            return self._power(e, natures[0])
        return self._function(e)

    def _has_smooth_parts(self, e: sp.Expr) -> bool:
        """Tell whether the parts of sums, products and analytic functions are smooth.

        Each object is looked at once, in however many expressions it stands.
        """
        stack, seen = [e], set[int]()
        while stack:
            for part in stack.pop().args:
                if id(part) in seen or id(part) in self._smooth:
                    continue
                seen.add(id(part))
                if _is_passed(part):
                    stack.append(part)
                elif self.nature(part) is not _SMOOTH:
                    return False
        self._smooth |= seen
        return True

    def _joins(self, e: sp.Expr) -> bool:
        """Say whether both cases are equal on the surface between them."""
        value, side, _, otherwise = e.args
        if self.moving.isdisjoint(symbols_in(side)):
            return True
        difference = value - otherwise
        return any(sp.expand(difference.xreplace(there)) == 0 for there in solutions(side))

    def _function(self, e: sp.Expr) -> _Nature | None:
        natures = [self.nature(a) for a in e.args]
        known = [n for n in natures if n is not None]
        if len(known) < len(natures):
            return None
        infinite, bent = any(n.infinite for n in known), any(n.bent for n in known)
        if e.func in _INVERSE and e.args[0].has(*_PERIODIC):
            bent = True  # asin(sin(x)) is a sawtooth
        if e.func in BENT or isinstance(e, Cases):
            return _Nature(infinite, True)
        # An unknown function counts as smooth.
        if infinite or not (e.func in (*_CONTINUOUS, *_INFINITE) or is_unknown(e)):
            return None
        return _Nature(e.func in _INFINITE, bent)

    def _cancels(self, e: sp.Expr, whole: _Nature) -> bool:
        """Say whether a bent factor may vanish where another becomes infinite."""
        if not (whole.infinite and whole.bent):
            return False
        open_factors = [f for f in e.args if f.free_symbols & self.moving and not f.is_nonzero]
        return len(open_factors) > 1 or not self._is_plain_pole(open_factors)

    def _is_plain_pole(self, factors: list[sp.Expr]) -> bool:
        """Say whether the factors that may vanish or become infinite all may become infinite."""
        natures = [self.nature(f) for f in factors]
        return all(n is not None and n.infinite for n in natures)

    def _power(self, e: sp.Expr, base: _Nature) -> _Nature | None:
        if not e.exp.is_Rational:
            return self._general_power(e, base)
        if e.exp.is_Integer and e.exp > 0:
            return base
        if base.infinite and base.bent and e.exp.is_negative:
            return None
        if self.moving & symbols_in(e.base) and _is_plainly_positive(e.base):
            return base
        infinite = base.infinite or bool(e.exp.is_negative and not e.base.is_nonzero)
        if e.exp.is_Integer:
            return _Nature(infinite, base.bent)
        hidden = base.infinite or not self._has_simple_zeros(e.base)
        return _Nature(infinite, base.bent or hidden)

    def _general_power(self, e: sp.Expr, base: _Nature) -> _Nature | None:
        exponent = self.nature(e.exp)
        if exponent is None or exponent.infinite or base.infinite:
            return None
        return _Nature(not e.base.is_positive, base.bent or exponent.bent)

    def _has_simple_zeros(self, e: sp.Expr) -> bool:
        """Say whether a radicand is positive or changes sign at its zeros: no hidden |u|.

        Radicands of one shape, as those of a family of springs, are examined once.
        """
        symbols = sorted(symbols_in(e), key=str)
        places = {s: (k, s in self.moving, s.is_positive) for k, s in enumerate(symbols)}
        key = shape(e, places)
        if key not in self._simple:
            self._simple[key] = self._examined(e)
        return self._simple[key]

    def _examined(self, e: sp.Expr) -> bool:
        if e.is_positive:
            return True
        symbols = sorted(e.free_symbols, key=str)
        if not e.is_rational_function(*symbols) or sp.count_ops(e) > _RADICAND_BUDGET:
            return False
        moving_symbols = [s for s in symbols if s in self.moving]
        if e.is_polynomial(*symbols) and all(_is_square_free_in(e, s) for s in moving_symbols):
            return True
        above, below = sp.cancel(e).as_numer_denom()
        if above.is_positive and below.is_positive:
            return True
        moving = [s for s in symbols if s in self.moving and s in (above * below).free_symbols]
        return not moving or bool(sp.Poly(above * below, *moving).is_sqf)


def _is_plainly_positive(e: sp.Expr) -> bool:
    """Say whether an expression is a positive form of the components of a unit vector.

    Σ c_i P_i with c_i > 0 and squares P_i, as of a rotation's row, is at least the smallest c_i
    if Σ P_i = 1 by sin² + cos² = 1 of each angle.
    """
    if not e.is_Add or len(e.args) > _SQUARES:
        return False
    squares = []
    for term in e.args:
        factors = sp.Mul.make_args(term)
        moving = [f for f in factors if not f.is_positive]
        if not moving or not all(_is_square(f) for f in moving):
            return False
        squares.append(sp.Mul(*moving))
    return _is_one(sp.Add(*squares))


def _is_square(e: sp.Expr) -> bool:
    """Say whether an expression is an even power of a real polynomial in sines and cosines."""
    if not (e.is_Pow and e.exp.is_Integer and e.exp > 0 and e.exp % 2 == 0):
        return False
    waves = e.base.atoms(sp.sin, sp.cos)
    letters = {wave: sp.Dummy(real=True) for wave in waves}
    return all(w.args[0].is_real for w in waves) and bool(
        e.base.xreplace(letters).is_polynomial() and e.base.is_real
    )


def _is_one(e: sp.Expr) -> bool:
    """Say whether a polynomial in sines and cosines is 1, since sin² + cos² = 1 of each angle."""
    angles = sorted({wave.args[0] for wave in e.atoms(sp.sin, sp.cos)}, key=str)
    letters = {f(angle): sp.Dummy() for angle in angles for f in (sp.sin, sp.cos)}
    remainder = sp.expand(e.xreplace(letters)) - 1
    for angle in angles:
        sine, cosine = letters[sp.sin(angle)], letters[sp.cos(angle)]
        remainder = sp.rem(remainder, sine**2 + cosine**2 - 1, cosine)
    return bool(sp.expand(remainder) == 0)


def solutions(surface: sp.Expr) -> Iterator[dict[sp.Symbol, sp.Expr]]:
    """Yield ``surface = 0`` solved for each symbol in which it is linear."""
    for symbol in sorted(surface.free_symbols, key=str):
        slope = derivative(surface, symbol)
        if slope != 0 and symbol not in slope.free_symbols:
            yield {symbol: symbol - surface / slope}


def _is_square_free_in(e: sp.Expr, symbol: sp.Symbol) -> bool:
    """Say whether a polynomial has no squared factor with a symbol, as shown at numbers.

    With numbers for all other symbols a squared factor stays one if the degree stays.
    """
    others = sorted(e.free_symbols - {symbol}, key=str)
    numbers = {s: sp.Integer(k * k + 2) for k, s in enumerate(others, 1)}
    polynomial = sp.Poly(e.xreplace(numbers), symbol)
    return bool(polynomial.degree() == _degree_bound(e, symbol) and polynomial.is_sqf)


def _degree_bound(e: sp.Expr, symbol: sp.Symbol) -> int:
    """The degree of a polynomial in a symbol, if no powers of it cancel."""
    if e.is_Add:
        return max(_degree_bound(a, symbol) for a in e.args)
    if e.is_Mul:
        return sum(_degree_bound(a, symbol) for a in e.args)
    if e.is_Pow:
        return int(e.exp) * _degree_bound(e.base, symbol)
    return int(e == symbol)
