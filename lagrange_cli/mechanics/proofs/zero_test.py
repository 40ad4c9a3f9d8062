"""Zero tests by evaluation at random points of finite fields (Schwartz–Zippel).

Facts about motions ("L does not depend on x") are statements about every state, and values at
states near the start do not show them: a stop, max(0, x − 3), is zero there, and a narrow well is
negligible a little away from it. A finite field (:mod:`.field_program` defines its functions) has
no near and far, no small and large, and each side of every switching function is visited. An
expression that is not identically zero passes with a probability of its degree over 1e36, at each
of two points. A claim without proof may still hold.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from itertools import count
from typing import TYPE_CHECKING

import sympy as sp
from sympy import pi

from lagrange_cli.mechanics.algebra.substitution import Substitution
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.proofs.field_program import (
    FieldProgram,
    Indeterminate,
    UndecidableError,
)
from lagrange_cli.mechanics.proofs.finite_field import (
    SAFE_PRIMES,
    CirclePoint,
    NoValueError,
    add_angles,
    circle_point,
    field_inverse,
    field_power,
    field_root,
    multiple_angle,
    sign_of_fraction,
)

if TYPE_CHECKING:
    from sympy import Expr


__all__ = [
    "UndecidableError",
    "are_equal",
    "does_not_depend",
    "relation_holds",
    "values_on_sides",
    "vanish",
]

_Relation = Callable[[Sequence[int], int], bool]
"""Tells from values of expressions, modulo a prime, if a relation holds."""

#: Operations in the field that one question may take, so that no fact takes longer than the
#: derivation; beyond, the claim counts as unproven. Not tuned.
_BUDGET = 400_000

#: Points, each of another field, at which each combination of sides is visited.
_POINTS = 2

#: Points if a root may be √(u²): at each point it is u or −u by chance.
_MORE_POINTS = 24

#: Visits to a root with a square radicand each time, after which it counts as √(u²): 2^−48.
_ARRIVALS = 48


class _Point:
    """A random point of a field: a value for each symbol, angle, exponent and function.

    Parameters
    ----------
    signs
        Sides of switching functions and signs of roots, in order of occurrence; + after the last.
    formal
        Give each switching function a random value in place of ±1: an expression that then
        vanishes does so on all sides.
    free
        Roots whose sign is indifferent, since the other sign gives a conjugate.
    """

    def __init__(
        self, p: int, seed: str, signs: Sequence[int], formal: bool, free: set[Indeterminate]
    ) -> None:
        self.p = p
        self.random = random.Random(seed)
        self.given = signs
        self.signs: list[int] = []
        self.formal = formal
        self.free = free
        self.table: dict[object, int] = {}
        self.circles: dict[Indeterminate, CirclePoint] = {}
        self.sides: dict[int, int] = {}
        self.roots: dict[tuple[int, int], int] = {}
        #: The root without a value here, roots with one, and roots with one at an earlier point.
        self.failed: Indeterminate | None = None
        self.passed: list[Indeterminate] = []
        self.known: list[Indeterminate] = []
        self.work = 0

    def _sign(self) -> int:
        place = len(self.signs)
        self.signs.append(self.given[place] if place < len(self.given) else 1)
        return self.signs[-1]

    def _value(self, key: object) -> int:
        if key not in self.table:
            self.table[key] = self.random.randrange(2, self.p)
        return self.table[key]

    def run(self, program: FieldProgram) -> list[int]:
        """Evaluate the outputs.

        Raises
        ------
        NoValueError
            An operation has no value at this point.
        """
        values: list[int] = []
        for name, operands in program.operations:
            self.work += 1
            values.append(getattr(self, f"_{name}")(operands, values))
        return [values[k] for k in program.outputs]

    def _number(self, fraction: tuple[int, int], values: list[int]) -> int:
        return fraction[0] * field_inverse(fraction[1], self.p) % self.p

    def _symbol(self, symbol: sp.Symbol, values: list[int]) -> int:
        return self._value(symbol)

    def _sum(self, operands: list[int], values: list[int]) -> int:
        return sum(values[k] for k in operands) % self.p

    def _product(self, operands: list[int], values: list[int]) -> int:
        result = 1
        for k in operands:
            result = result * values[k] % self.p
        return result

    def _power(self, operands: tuple[int, int], values: list[int]) -> int:
        return field_power(values[operands[0]], operands[1], self.p)

    def _circle(
        self,
        operands: tuple[list[tuple[Indeterminate, sp.Rational]], tuple[int, ...]],
        values: list[int],
    ) -> CirclePoint:
        parts, exact = operands
        total: CirclePoint = (values[exact[0]], values[exact[1]]) if exact else (1, 0)
        for atom, c in parts:
            if atom not in self.circles:
                self.circles[atom] = circle_point(self._value(atom), self.p)
            n = int(c.p) * (atom.parts // int(c.q))
            total = add_angles(total, multiple_angle(self.circles[atom], n, self.p), self.p)
        return total

    def _coordinate(self, operands: tuple[int, bool], values: list[CirclePoint]) -> int:
        return values[operands[0]][operands[1]]

    def _growth(self, parts: list[tuple[Indeterminate, sp.Rational]], values: list[int]) -> int:
        total = 1
        for atom, c in parts:
            n = int(c.p) * (atom.parts // int(c.q))
            total = total * field_power(self._value(atom), n, self.p) % self.p
        return total

    def _radical(self, operands: tuple[int, Indeterminate], values: list[int]) -> int:
        x, atom = values[operands[0]], operands[1]
        key = x, atom.parts
        if key in self.roots:
            self.known.append(atom)
            return self.roots[key]
        self.roots[key] = self._new_root(x, atom)
        return self.roots[key]

    def _new_root(self, x: int, atom: Indeterminate) -> int:
        try:
            root = field_root(x, atom.parts, self.p)
        except NoValueError:
            self.failed = atom
            raise
        self.passed.append(atom)
        if atom.constant or atom in self.free or atom.parts % 2:
            return root
        return self._sign() * root

    def _part(self, operands: tuple[int, Indeterminate, sp.Rational], values: list[int]) -> int:
        root, atom, exponent = operands
        return field_power(values[root], int(exponent.p) * (atom.parts // int(exponent.q)), self.p)

    def _side(self, operand: int, values: list[int]) -> int:
        x = values[operand]
        if x == 0:
            return 0
        if x not in self.sides:
            side = sign_of_fraction(x, self.p) or self._open_side()
            self.sides[x], self.sides[self.p - x] = side, -side
        return self.sides[x]

    def _open_side(self) -> int:
        return self.random.randrange(2, self.p) if self.formal else self._sign()

    def _select(self, operands: tuple[int, int, int, int], values: list[int]) -> int:
        side, first, second, larger = operands
        a, b, s = values[first], values[second], larger * values[side]
        return (a + b + s * (a - b)) * field_inverse(2, self.p) % self.p

    def _function(self, operands: tuple[str, list[int]], values: list[int]) -> int:
        name, arguments = operands
        return self._value((name, *(values[k] for k in arguments)))


class _Survey:
    """Evaluations of a program at points of several fields, within a budget."""

    def __init__(self, program: FieldProgram) -> None:
        self.program = program
        self.work = 0
        self.even = {a for a in program.roots.values() if a.parts % 2 == 0 and not a.constant}
        self.free: set[Indeterminate] = set()
        self.primes = [p for p in SAFE_PRIMES if self._has_constants(p)]
        if not self.primes:
            raise UndecidableError

    def points(self) -> Iterator[tuple[int, str]]:
        """Yield a prime and a seed for each point to visit."""
        for k in range(_MORE_POINTS if self.even - self.free else _POINTS):
            yield self.primes[k % len(self.primes)], str(k)

    def _has_constants(self, p: int) -> bool:
        """Say whether the roots of numbers are in the field."""
        fixed = {b: a for b, a in self.program.roots.items() if a.fixed}
        roots = FieldProgram.from_expressions(
            sp.Pow(b, sp.Rational(1, a.parts)) for b, a in fixed.items()
        )
        try:
            _Point(p, "", (), True, set()).run(roots)
        except NoValueError:
            return False
        return True

    def at(
        self, p: int, seed: str, signs: Sequence[int], formal: bool
    ) -> tuple[list[int], list[int]]:
        """Evaluate at the first random point that has values; return them and the signs taken.

        The points tried are the same for all signs, so that both signs of a root are visited
        at one point.
        """
        for attempt in range(_BUDGET):
            point = _Point(p, f"{p} {seed} {attempt}", signs, formal, self.free)
            values = self.run(point)
            if values is not None:
                return values, point.signs
        raise UndecidableError

    def run(self, point: _Point) -> list[int] | None:
        """Evaluate at a point; None if a root has no value there."""
        try:
            return point.run(self.program)
        except NoValueError:
            if point.failed is None:
                raise UndecidableError from None  # a denominator that is zero throughout
            return None
        finally:
            self._count(point.work)

    def _count(self, work: int) -> None:
        self.work += work
        if self.work > _BUDGET:
            raise UndecidableError

    def settle_roots(self) -> None:
        """Find roots whose sign is indifferent: their radicand is not always a square.

        The sign of √e is that of a conjugate unless e is a square of something in the
        expressions, as where it hides |u| = √(u²).
        """
        even = {a for a in self.even if not (a.rough or a.fixed)}
        p = self.primes[0]
        arrivals = dict.fromkeys(even, 0)
        attempts = count()
        while any(arrivals[a] < _ARRIVALS for a in even - self.free):
            seed = f"{p} settle {next(attempts)}"
            point = _Point(p, seed, (), self.program.switches, set())
            self.run(point)
            if point.failed in even:
                self.free.add(point.failed)
            self.free.update(even.intersection(point.known))
            for atom in even.intersection(point.passed):
                arrivals[atom] += 1


def values_on_sides(expressions: Sequence[sp.Expr]) -> Iterator[tuple[list[int], int]]:
    """Evaluate on every combination of sides: values, and the prime they are modulo.

    Raises
    ------
    UndecidableError
        A function has no meaning in the field, or there are too many combinations.
    """
    return _sides(FieldProgram.from_expressions(expressions), formal=False)


def _sides(program: FieldProgram, formal: bool) -> Iterator[tuple[list[int], int]]:
    survey = _Survey(program)
    survey.settle_roots()
    for p, seed in survey.points():
        signs: list[int] | None = []
        while signs is not None:
            values, taken = survey.at(p, seed, signs, formal)
            yield values, p
            signs = _next(taken)


def _next(signs: Sequence[int]) -> list[int] | None:
    """Give the next sequence of signs, + before −; None after the last."""
    last = max((k for k, s in enumerate(signs) if s == 1), default=None)
    return None if last is None else [*signs[:last], -1]


def relation_holds(expressions: Sequence[sp.Expr], relation: _Relation) -> bool:
    """Say whether a polynomial relation between expressions is proven.

    Parameters
    ----------
    relation
        Takes their values and a prime; true if polynomials in them vanish modulo it.
    """
    try:
        program = FieldProgram.from_expressions(expressions)
    except UndecidableError:
        return False
    ways = (True, False) if program.switches else (False,)
    return any(_holds(program, relation, formal) for formal in ways)


def _holds(program: FieldProgram, relation: _Relation, formal: bool) -> bool:
    try:
        return all(relation(values, p) for values, p in _sides(program, formal))
    except UndecidableError:
        return False


def vanish(*expressions: sp.Expr) -> bool:
    """Say whether all expressions are proven to be zero wherever they have a value."""
    pending = [e for e in expressions if e != 0]
    return not pending or relation_holds(pending, lambda values, p: not any(v % p for v in values))


def are_equal(a: sp.Expr, b: sp.Expr) -> bool:
    """Say whether two expressions are proven to be equal wherever both have a value."""
    return a == b or relation_holds([a, b], lambda values, p: (values[0] - values[1]) % p == 0)


def does_not_depend(expression: sp.Expr, symbol: sp.Symbol) -> bool:
    """Say whether an expression is proven to have one value for all values of a symbol.

    Two values are compared, each on its own side of every switching function: unlike a
    derivative, that does not miss a jump.
    """
    dependent = [t for t in sp.Add.make_args(expression) if symbol in symbols_in(t)]
    if not dependent:
        return True
    elsewhere = sp.Dummy(symbol.name, **symbol.assumptions0)
    first = sp.Add(*dependent)
    return are_equal(first, Substitution({symbol: elsewhere}).put_into(first))


def is_periodic(expression: Expr, angle: Expr) -> bool:
    """Tell if a whole turn of an angle is proven to leave an expression as it is."""
    further = expression.xreplace({angle: angle + 2 * pi})
    try:
        return further == expression or vanish(further - expression)
    except UndecidableError:
        return False
