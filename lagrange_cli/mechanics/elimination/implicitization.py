"""Implicitization: coordinates eliminated from definitions of Cartesian names.

``x = l sin θ, z = −l cos θ`` says x² + z² = l². Angles are eliminated one by one
through sin² + cos² = 1: two equations that are linear in sin θ and cos θ give both;
one that holds the cosine alone gives it, and another is then free of the sine or linear
in it. A length is eliminated if an equation gives it without division by a factor that
may vanish, or if it stands in one equation by its square only. A square root in one
equation is squared. A coordinate to which none of this applies stays, beside the
equations that hold it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import sympy as sp

from lagrange_cli.mechanics.algebra.polynomials import cancelled, common_divisor, expand_terms

_ZERO = sp.Integer(0)
_ONE = sp.Integer(1)

#: Terms that an equation may be multiplied out to. Where this or a budget below is exceeded, the
#: coordinate stays: a closure of more terms costs more than it saves. None is tuned.
_TERM_BUDGET = 200

#: Most equations linear in an angle's sine and cosine of which pairs are tried.
_PAIRS_OF = 6

#: Most operations of a fraction that is brought into lowest terms.
_FRACTION_BUDGET = 400

#: Largest multiple of an angle that is written in powers of sine and cosine.
_LARGEST_MULTIPLE = 4


@dataclass(frozen=True)
class ImplicitEquation:
    """``expression = 0``.

    Attributes
    ----------
    name, text
        The constraint or definition that it comes from.
    stated
        True for a constraint.
    """

    name: str
    expression: sp.Expr
    text: str
    stated: bool


@dataclass(frozen=True)
class AngleSymbols:
    """Sine and cosine of an angle as symbols of their own.

    Attributes
    ----------
    q
        The angle.
    sine, cosine
        Symbols for sin q and cos q.
    """

    q: sp.Symbol
    sine: sp.Symbol
    cosine: sp.Symbol

    def put_back(self, expr: sp.Expr) -> sp.Expr:
        """Replace the symbols by the functions of the angle."""
        return expr.xreplace({self.sine: sp.sin(self.q), self.cosine: sp.cos(self.q)})


def angle_symbols(q: sp.Symbol) -> AngleSymbols:
    return AngleSymbols(
        q, sp.Dummy(f"sin_{q.name}", real=True), sp.Dummy(f"cos_{q.name}", real=True)
    )


def in_single_angles(expr: sp.Expr, angles: Sequence[AngleSymbols]) -> sp.Expr | None:
    """Write ``expr`` over sines and cosines of single angles; None if an angle stands elsewhere."""
    q = {angle.q for angle in angles}
    if expr.free_symbols.isdisjoint(q):
        return expr
    expanded = {}
    for function in expr.atoms(sp.sin, sp.cos):
        argument = function.args[0]
        present = argument.free_symbols & q
        if not present:
            continue
        if any(not _is_small_multiple(argument, s) for s in present):
            return None
        expanded[function] = sp.expand_trig(function)
    rewritten = expr.xreplace(expanded)
    for angle in angles:
        if angle.q in expr.free_symbols:
            names = {sp.sin(angle.q): angle.sine, sp.cos(angle.q): angle.cosine}
            rewritten = rewritten.xreplace(names)
    return rewritten if rewritten.free_symbols.isdisjoint(q) else None


def _is_small_multiple(argument: sp.Expr, q: sp.Symbol) -> bool:
    slope = argument.diff(q)
    return bool(slope.is_Integer and abs(slope) <= _LARGEST_MULTIPLE)


class ImplicitSystem:
    """Relations between names, some of which are eliminated.

    Parameters
    ----------
    relations
        In the order in which they are to stay.
    moving
        Symbols of all names that move: Cartesian ones, lengths, sines and cosines.
    constants
        Symbols of parameters. Other symbols are moved in time.

    Attributes
    ----------
    relations
        Number → equation that is left.
    given
        Eliminated name → expression over the names that are left, if no choice is needed.
    """

    def __init__(
        self,
        relations: Iterable[ImplicitEquation],
        moving: Iterable[sp.Symbol],
        constants: Iterable[sp.Symbol],
    ) -> None:
        self.relations: dict[int, ImplicitEquation] = {}
        self.given: dict[sp.Symbol, sp.Expr] = {}
        self._moving, self._constants = frozenset(moving), frozenset(constants)
        self._holders: dict[sp.Symbol, dict[int, None]] = {}
        self._next = 0
        for relation in relations:
            self._add(relation)

    def _add(self, relation: ImplicitEquation, number: int | None = None) -> None:
        if number is None:
            number, self._next = self._next, self._next + 1
        self.relations[number] = relation
        for s in relation.expression.free_symbols & self._moving:
            self._holders.setdefault(s, {})[number] = None

    def _remove(self, number: int) -> ImplicitEquation:
        relation = self.relations.pop(number)
        for s in relation.expression.free_symbols & self._moving:
            self._holders[s].pop(number, None)
        return relation

    def holding(self, *symbols: sp.Symbol) -> list[int]:
        """List the numbers of the relations that hold some of the symbols, ascending."""
        return sorted({k for s in symbols for k in self._holders.get(s, {})})

    # Angles.

    def drop_angle(self, angle: AngleSymbols, asked: Collection[sp.Symbol]) -> bool:
        """Eliminate an angle; False if it has to stay.

        ``asked``: sine or cosine that must have a value without a choice.
        """
        needed = {*asked, *(s for s in (angle.sine, angle.cosine) if self._is_needed(s))}
        numbers = self.holding(angle.sine, angle.cosine)
        powers = {k: _powers(self.relations[k].expression, angle) for k in numbers}
        if len(numbers) < 2 or any(p is None for p in powers.values()):
            return False
        known = {k: p for k, p in powers.items() if p is not None}
        return self._by_two(angle, known, bool(needed)) or self._by_one(angle, known, needed)

    def _by_two(self, angle: AngleSymbols, powers: Mapping[int, _Powers], needed: bool) -> bool:
        """Solve two equations that are linear in sine and cosine; False if there are none."""
        linear = [k for k, p in powers.items() if set(p) <= {(0, 0), (1, 0), (0, 1)}]
        for pair in combinations(linear[:_PAIRS_OF], 2):
            solved = _solved(powers[pair[0]], powers[pair[1]])
            if solved is None:
                continue
            sine, cosine = solved
            below = [sp.fraction(sp.together(e))[1] for e in solved]
            plain = all(e.free_symbols <= self._constants for e in below)
            if not plain and (needed or not self._cancels(*below)):
                continue
            others = [k for k in powers if k not in pair]
            substituted = [(k, self._with_angle(k, angle, sine, cosine)) for k in others]
            circle = _on_circle(sine, cosine)
            self._replace(pair, circle)
            for k, expression in substituted:
                self._replace((k,), expression)
            if plain:
                self._know({angle.sine: sine, angle.cosine: cosine})
            return True
        return False

    def _cancels(self, one: sp.Expr, two: sp.Expr) -> bool:
        """Say whether two denominators are one length that time does not bring to zero."""
        return one in (two, -two) and one.free_symbols <= self._constants | self._moving

    def _by_one(
        self, angle: AngleSymbols, powers: Mapping[int, _Powers], needed: Collection[sp.Symbol]
    ) -> bool:
        """Solve one equation for the cosine (or sine), eliminate the other from a second."""
        for number, coefficients in powers.items():
            for which, symbol in enumerate((angle.sine, angle.cosine)):
                if not {symbol}.issuperset(needed):
                    continue
                solved = _alone(coefficients, which, self._constants)
                others = [k for k in powers if k != number]
                if solved is None or len(others) != 1:
                    continue
                left = _even(powers[others[0]], which, solved, self._constants)
                if left is None:
                    continue
                self._replace((number, others[0]), left)
                self._know({symbol: solved})
                return True
        return False

    def _with_angle(
        self, number: int, angle: AngleSymbols, sine: sp.Expr, cosine: sp.Expr
    ) -> sp.Expr:
        put = {angle.sine: sine, angle.cosine: cosine}
        return _numerator(self.relations[number].expression.xreplace(put))

    def _replace(self, numbers: Sequence[int], expression: sp.Expr) -> None:
        """Replace equations by one, under the name of a stated one."""
        gone = [self._remove(k) for k in numbers]
        if expression == 0:
            return
        first = next((r for r in gone if r.stated), gone[-1])
        text = first.text if first.stated else ", ".join(r.text for r in gone)
        self._add(replace(first, expression=expression, text=text), numbers[0])

    # Lengths.

    def drop_length(self, q: sp.Symbol, needed: bool) -> bool:
        """Eliminate a coordinate that is no angle; False if it has to stay.

        ``needed``: it must have a value without a choice.
        """
        needed = needed or self._is_needed(q)
        numbers = self.holding(q)
        parts = {k: _powers_of(self.relations[k].expression, q) for k in numbers}
        if not numbers or any(p is None for p in parts.values()):
            return False
        known = {k: p for k, p in parts.items() if p is not None}
        for number, powers in known.items():
            if set(powers) <= {0, 1} and self._divides(powers[1]):
                self._give(number, q, -powers.get(0, _ZERO) / powers[1])
                return True
        if needed or len(numbers) > 1:
            return False
        (powers,) = known.values()
        if set(powers) != {0, 2} or not (-powers[0] / powers[2]).is_nonnegative:
            return False
        self._remove(numbers[0])
        return True

    def _divides(self, pivot: sp.Expr) -> bool:
        return bool(pivot.is_nonzero) and pivot.free_symbols.isdisjoint(self._moving)

    def _give(self, number: int, q: sp.Symbol, value: sp.Expr) -> None:
        self._remove(number)
        for k in self.holding(q):
            self._replace((k,), self.relations[k].expression.xreplace({q: value}))
        self._know({q: value})

    # Expressions for eliminated names.

    def _is_needed(self, symbol: sp.Symbol) -> bool:
        return any(symbol in e.free_symbols for e in self.given.values())

    def _know(self, values: dict[sp.Symbol, sp.Expr]) -> None:
        self.given = {s: e.xreplace(values) for s, e in self.given.items()} | values

    # Roots.

    def square_roots(self) -> None:
        """Isolate and square a single square root that moves, in every relation."""
        for number, relation in list(self.relations.items()):
            squared = _squared(relation.expression, self._moving)
            if squared is not None:
                self._replace((number,), squared)


_Powers = dict[tuple[int, int], sp.Expr]


def _terms(expr: sp.Expr) -> Sequence[sp.Expr] | None:
    return expand_terms(expr, _TERM_BUDGET)


def _powers(expr: sp.Expr, angle: AngleSymbols) -> _Powers | None:
    """Give the coefficients of sⁱ cʲ, with s² written 1 − c²; None unless a polynomial."""
    coefficients: _Powers = {}
    for term in _terms(expr) or (None,):
        if term is None:
            return None
        split = _exponents(term, (angle.sine, angle.cosine))
        if split is None:
            return None
        cofactor, (i, j) = split
        for power, sign in _without_squared_sine(i, j):
            coefficients[power] = coefficients.get(power, _ZERO) + sign * cofactor
    collected = {k: _settled(e) for k, e in coefficients.items()}
    return {k: e for k, e in collected.items() if e != 0}


def _settled(expr: sp.Expr) -> sp.Expr:
    return sp.expand(expr) if expr.is_Add else expr


def _without_squared_sine(i: int, j: int) -> Iterator[tuple[tuple[int, int], int]]:
    """Write every s² in sⁱ cʲ as 1 − c²: (powers, coefficient) of each term."""
    half, odd = divmod(i, 2)
    for k in range(half + 1):
        yield (odd, j + 2 * k), int(sp.binomial(half, k)) * (-1) ** k


def _exponents(
    term: sp.Expr, symbols: Sequence[sp.Symbol]
) -> tuple[sp.Expr, tuple[int, ...]] | None:
    """Split a product into a cofactor and exponents of symbols; None if that fails."""
    exponents = dict.fromkeys(symbols, 0)
    cofactors = []
    for factor in sp.Mul.make_args(term):
        base, exponent = factor.as_base_exp()
        if base in exponents and exponent.is_Integer and exponent > 0:
            exponents[base] += int(exponent)
        elif factor.free_symbols & exponents.keys():
            return None
        else:
            cofactors.append(factor)
    return sp.Mul(*cofactors), tuple(exponents[s] for s in symbols)


def _powers_of(expr: sp.Expr, q: sp.Symbol) -> dict[int, sp.Expr] | None:
    coefficients: dict[int, sp.Expr] = {}
    for term in _terms(expr) or (None,):
        split = None if term is None else _exponents(term, (q,))
        if split is None:
            return None
        cofactor, (power,) = split
        coefficients[power] = coefficients.get(power, _ZERO) + cofactor
    return {k: e for k, e in coefficients.items() if e != 0}


def _solved(one: _Powers, two: _Powers) -> tuple[sp.Expr, sp.Expr] | None:
    """Solve two linear equations for sine and cosine; None if they are dependent."""
    rows = [[p.get(k, _ZERO) for k in ((1, 0), (0, 1), (0, 0))] for p in (one, two)]
    (a, b, e), (c, d, f) = rows
    determinant = _settled(a * d - b * c)
    if determinant == 0 or sp.expand(determinant) == 0:
        return None
    if (a == 0 and d == 0) or (b == 0 and c == 0):
        return (-e / a, -f / d) if b == 0 else (-f / c, -e / b)
    return _lowest((b * f - d * e) / determinant), _lowest((c * e - a * f) / determinant)


def _lowest(expr: sp.Expr) -> sp.Expr:
    return cancelled(expr) if expr.count_ops() <= _FRACTION_BUDGET else expr


def _numerator(expr: sp.Expr) -> sp.Expr:
    """Return a numerator that vanishes exactly where the expression does."""
    return sp.fraction(sp.together(expr))[0] if not expr.is_polynomial() else expr


def _on_circle(sine: sp.Expr, cosine: sp.Expr) -> sp.Expr:
    """Write s² + c² − 1 without fractions."""
    (a, below), (b, under) = sp.fraction(sp.together(sine)), sp.fraction(sp.together(cosine))
    if below == under or below == -under:
        return a**2 + b**2 - below**2
    whole = below * cancelled(under / common_divisor([below, under]))
    return (a * cancelled(whole / below)) ** 2 + (b * cancelled(whole / under)) ** 2 - whole**2


def _alone(powers: _Powers, which: int, constants: frozenset[sp.Symbol]) -> sp.Expr | None:
    """Solve for the sine (0) or cosine (1); None unless linear in it and free of the other."""
    power = (1, 0) if which == 0 else (0, 1)
    if not set(powers) <= {(0, 0), power} or power not in powers:
        return None
    if not powers[power].free_symbols <= constants:
        return None
    return -powers.get((0, 0), _ZERO) / powers[power]


def _even(
    powers: _Powers, which: int, value: sp.Expr, constants: frozenset[sp.Symbol]
) -> sp.Expr | None:
    """Substitute one of sine and cosine and eliminate the other; None if it stays.

    An equation linear in the other gives it, and squares are to sum to 1.
    """
    by_parity: dict[int, sp.Expr] = {}
    for (i, j), coefficient in powers.items():
        power, partner_power = (i, j) if which == 0 else (j, i)
        half, odd = divmod(partner_power, 2)
        part = coefficient * value**power * (1 - value**2) ** half
        by_parity[odd] = by_parity.get(odd, _ZERO) + part
    if by_parity.get(1, _ZERO) == 0:
        return _numerator(by_parity.get(0, _ZERO))
    if not by_parity[1].free_symbols <= constants:
        return None
    solved = -by_parity.get(0, _ZERO) / by_parity[1]
    return _on_circle(value, solved) if which else _on_circle(solved, value)


def _squared(expr: sp.Expr, moving: frozenset[sp.Symbol]) -> sp.Expr | None:
    """Square a + b √w = 0 to a² − b² w, √w the only root that moves; None otherwise."""
    roots = {p for p in expr.atoms(sp.Pow) if p.exp.is_Rational and not p.exp.is_Integer}
    roots = {p for p in roots if p.free_symbols & moving}
    if len(roots) != 1:
        return None
    (root,) = roots
    if root.exp != sp.Rational(1, 2):
        return None
    place = sp.Dummy(real=True)
    parts = _powers_of(expr.xreplace({root: place}), place)
    if parts is None or not set(parts) <= {0, 1}:
        return None
    return parts.get(0, _ZERO) ** 2 - parts[1] ** 2 * root.base
