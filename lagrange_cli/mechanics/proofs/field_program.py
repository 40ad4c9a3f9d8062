"""Expressions as straight-line programs over a finite field.

Sums, products and integer powers stay. Every other function is replaced by the weakest object
that obeys the identities to be recognized: the sine and cosine of an angle are a point of the
unit circle, those of rational combinations of angles follow by the addition theorems, and
exponentials multiply likewise; a root is an element with that power; a switching function is
replaced by its value on one side; a logarithm or inverse function is a number for each
argument. An identity of the replacements is one of the functions. The idea is Gonnet's
("Determining equivalence of expressions in random polynomial time", STOC 1984; "New results for
random determination of equivalence of expressions", SYMSAC 1986).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import sympy as sp

from lagrange_cli.mechanics.free_symbols import is_unknown
from lagrange_cli.mechanics.kinks import KINKED, STEPS, step_beside_surface
from lagrange_cli.mechanics.tabulated import Tabulated

#: Operations in an argument of sin or exp above which it is not multiplied out, so that zero
#: tests stay quick; a claim about a longer one stays unproven. Not tuned.
_ARGUMENT_BUDGET = 300

#: Largest number under a root that is factored, since its square factors are found by trial
#: division.
_FACTORED = 10**15

#: Angles c·π with c a multiple of 1/12 have sines and cosines in square roots.
_TURN = 12

_OPAQUE = (sp.log, sp.asin, sp.atan, sp.atan2, sp.asinh, sp.acosh, sp.atanh)


class UndecidableError(Exception):
    """An expression holds a function without a meaning in the field, or is beyond the budget."""


@dataclass(eq=False)
class Indeterminate:
    """An element of which angles, exponents or roots are rational multiples.

    Attributes
    ----------
    parts
        Common denominator of its multiples: the field has a value for one part of it.
    constant
        A root of a prime number: its sign is a matter of convention.
    fixed
        A root of a number, which only some fields contain.
    rough
        A root of an expression with switching functions.
    """

    parts: int = 1
    constant: bool = False
    fixed: bool = False
    rough: bool = False

    def divide(self, c: sp.Rational) -> sp.Rational:
        """Record a multiple."""
        self.parts = math.lcm(self.parts, int(c.q))
        return c


@dataclass
class FieldProgram:
    """Operations, each a name with the numbers of earlier ones, of some expressions.

    Attributes
    ----------
    operations
        In order; an operation refers to earlier ones by number.
    outputs
        Numbers of the operations whose values are those of the expressions.
    """

    operations: list[tuple[str, Any]] = field(default_factory=list)
    outputs: list[int] = field(default_factory=list)
    roots: dict[sp.Expr, Indeterminate] = field(default_factory=dict)
    angles: dict[sp.Expr, Indeterminate] = field(default_factory=dict)
    exponents: dict[sp.Expr, Indeterminate] = field(default_factory=dict)
    _index: dict[sp.Expr, int] = field(default_factory=dict)
    _circles: dict[sp.Expr, int] = field(default_factory=dict)
    _radicals: dict[sp.Expr, int] = field(default_factory=dict)

    @classmethod
    def from_expressions(cls, expressions: Iterable[sp.Expr]) -> FieldProgram:
        """Build the program of some expressions.

        Raises
        ------
        UndecidableError
            One holds a function without a meaning here.
        """
        program = cls()
        program.outputs = [program.number(sp.sympify(e)) for e in expressions]
        return program

    @property
    def switches(self) -> bool:
        """Say whether a switching function occurs."""
        return any(name in ("side", "select") for name, _ in self.operations)

    def _append(self, name: str, operands: Any) -> int:
        self.operations.append((name, operands))
        return len(self.operations) - 1

    def number(self, e: sp.Expr) -> int:
        """Give the number of the operation with the value of an expression."""
        if e not in self._index:
            self._index[e] = self._record(e)
        return self._index[e]

    def _numbers(self, expressions: Iterable[sp.Expr]) -> list[int]:
        return [self.number(e) for e in expressions]

    def _record(self, e: sp.Expr) -> int:
        if e.is_Rational:
            return self._append("number", (int(e.p), int(e.q)))
        if e.is_Symbol or e == sp.pi:
            return self._append("symbol", e)
        if e.is_Add:
            return self._append("sum", self._numbers(e.args))
        if e.is_Mul:
            return self._append("product", self._numbers(e.args))
        if e.is_Pow and e.exp.is_Integer:
            return self._append("power", (self.number(e.base), int(e.exp)))
        if e.is_Pow and e.exp.is_Rational:
            return self._root(e.base, e.exp)
        if e.is_Pow or isinstance(e, sp.exp) or e is sp.E:
            base, exponent = e.as_base_exp()
            return self._exponential(exponent if base == sp.E else exponent * sp.log(base))
        return self._function(e)

    def _function(self, e: sp.Expr) -> int:
        if e.func in (sp.sin, sp.cos):
            return self._append("coordinate", (self._circle(e.args[0]), e.func is sp.sin))
        if isinstance(e, STEPS):
            return self.number(step_beside_surface(e))
        if e.func in (sp.Abs, sp.sign):
            side = self._side(e.args[0])
            if e.func is sp.sign:
                return side
            return self._append("product", [side, self.number(e.args[0])])
        if e.func in (sp.Max, sp.Min):
            return self._extreme(e.func, e.args, self.number)
        rewritten = _rewritten(e)
        if rewritten is not None:
            return self.number(rewritten)
        if e.func in _OPAQUE or is_unknown(e):
            named = e.func.__name__, e.args
            if isinstance(e, Tabulated):
                named = f"{e.token.name}{e.orders}", e.arguments
            return self._append("function", (named[0], self._numbers(named[1])))
        raise UndecidableError

    def _extreme(
        self, function: Any, arguments: Sequence[sp.Expr], part: Callable[[sp.Expr], int]
    ) -> int:
        """Select by the side of a − b = 0: max(a, b) is a on one side and b on the other."""
        first, remaining = arguments[0], function(*arguments[1:])
        operands = (self._side(first - remaining), part(first), part(remaining))
        larger = 1 if function is sp.Max else -1
        return self._append("select", (*operands, larger))

    def _side(self, e: sp.Expr) -> int:
        """Multiply the signs of the factors that are not positive."""
        number, factors = _factors(e)
        sides = [self._factor_side(f) for f in factors]
        if number > 0 and len(sides) == 1:
            return sides[0]
        return self._append("product", [self.number(number), *sides])

    def _factor_side(self, e: sp.Expr) -> int:
        if e.func in (sp.Max, sp.Min):
            return self._extreme(e.func, e.args, self._side)
        return self._append("side", self.number(e))

    def _root(self, base: sp.Expr, exponent: sp.Rational) -> int:
        if base.is_Rational:
            if base <= 0:
                raise UndecidableError
            primes = sp.factorint(base) if max(base.p, base.q) < _FACTORED else {base: 1}
            if list(primes) != [base]:
                powers = [self._root(sp.Rational(n), exponent * k) for n, k in primes.items()]
                return self._append("product", powers)
        if exponent.is_Integer:
            return self._append("power", (self.number(base), int(exponent)))
        split = sp.Pow(sp.factor_terms(base), exponent)
        if split.is_Mul:
            return self.number(split)
        rough = base.has(*KINKED)
        if base not in self.roots:
            self.roots[base] = Indeterminate(
                1, bool(base.is_Rational), not base.free_symbols, rough
            )
            operands = (self.number(base), self.roots[base])
            self._radicals[base] = self._append("radical", operands)
        atom = self.roots[base]
        return self._append("part", (self._radicals[base], atom, atom.divide(exponent)))

    def _circle(self, angle: sp.Expr) -> int:
        """Give the operation with cosine and sine of an angle."""
        if angle not in self._circles:
            multiples = _multiples(angle)
            quarter = multiples.pop(sp.pi, sp.S.Zero)
            exact: tuple[int, ...] = ()
            if quarter and _TURN % int(quarter.q) == 0:
                exact = tuple(self._numbers([sp.cos(quarter * sp.pi), sp.sin(quarter * sp.pi)]))
            elif quarter:
                multiples[sp.pi] = quarter
            parts = _atoms(multiples, self.angles)
            self._circles[angle] = self._append("circle", (parts, exact))
        return self._circles[angle]

    def _exponential(self, exponent: sp.Expr) -> int:
        multiples = _multiples(exponent)
        powers = [self._root(e.args[0], c) for e, c in multiples.items() if isinstance(e, sp.log)]
        exponents = {e: c for e, c in multiples.items() if not isinstance(e, sp.log)}
        growth = self._append("growth", _atoms(exponents, self.exponents))
        return self._append("product", [growth, *powers]) if powers else growth


@lru_cache(maxsize=4096)
def _factors(e: sp.Expr) -> tuple[sp.Expr, tuple[sp.Expr, ...]]:
    """Give a number and factors whose product has the sign of an expression."""
    number, product = sp.factor_terms(e).as_coeff_Mul(rational=True)
    factors = []
    for factor in sp.Mul.make_args(product):
        base, exponent = factor.as_base_exp()
        if factor.is_positive or (exponent.is_Integer and exponent % 2 == 0):
            continue
        factors.append((base if exponent.is_Integer else factor).primitive()[1])
    return sp.sign(number), tuple(factors)


def _atoms(
    multiples: Mapping[sp.Expr, sp.Rational], table: dict[sp.Expr, Indeterminate]
) -> list[tuple[Indeterminate, sp.Rational]]:
    pairs = [(table.setdefault(e, Indeterminate()), c) for e, c in multiples.items()]
    return [(atom, atom.divide(c)) for atom, c in pairs]


def _multiples(e: sp.Expr) -> dict[sp.Expr, sp.Rational]:
    """Write a sum as rational multiples of terms that are not numbers, in a fixed order."""
    if sp.count_ops(e) > _ARGUMENT_BUDGET:
        return {e: sp.S.One}
    parts: dict[sp.Expr, sp.Rational] = {}
    for term in sp.Add.make_args(sp.expand(e)):
        c, unit = term.as_coeff_Mul(rational=True)
        parts[unit] = parts.get(unit, sp.S.Zero) + c
    return {unit: parts[unit] for unit in sorted(parts, key=sp.default_sort_key) if parts[unit]}


def _rewritten(e: sp.Expr) -> sp.Expr | None:
    """Rewrite a function by functions with a meaning in the field; None if it stays."""
    x = e.args[0] if e.args else e
    if e.func is sp.tan:
        return sp.sin(x) / sp.cos(x)
    if e.func is sp.acos:
        return sp.pi / 2 - sp.asin(x)
    if e.func is sp.sinh:
        return (sp.exp(x) - sp.exp(-x)) / 2
    if e.func is sp.cosh:
        return (sp.exp(x) + sp.exp(-x)) / 2
    if e.func is sp.tanh:
        return (sp.exp(2 * x) - 1) / (sp.exp(2 * x) + 1)
    if e.func is sp.log:
        split = sp.expand_log(e)
        return split if split != e else None
    return None
