"""The vocabulary of some equations: names, order, abbreviations, the scene's own LaTeX."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cached_property
from itertools import takewhile
from typing import TYPE_CHECKING, TypeAlias

import sympy

from lagrange_cli.mechanics.algebra.factor import letter_below
from lagrange_cli.mechanics.free_symbols import symbols_in, unknown_function
from lagrange_cli.notation import ordering
from lagrange_cli.notation.ordering import labelled_symbol
from lagrange_cli.notation.symbols import multiplier_name, split_name
from lagrange_cli.notation.tree import (
    Dependence,
    DisplayNumber,
    DisplaySymbol,
    Role,
    SignedNode,
    abbreviations_in,
)

if TYPE_CHECKING:
    from sympy import Basic, Expr

    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Parameter, System

#: Operations of the longest expression that is printed: more than three pages are not read, and
#: are more than pdfLaTeX has memory for.
MOST_OPERATIONS = 3_000


@dataclass(frozen=True)
class Omission:
    """Leaves long expressions out.

    Attributes
    ----------
    notice
        Number of operations → the label that stands in place of the expression.
    counts
        Operations of those that were left out so far.
    """

    notice: Callable[[int], object]
    counts: list[int] = field(default_factory=list)

    def instead(self, parts: Sequence[Expr]) -> DisplaySymbol | None:
        """Return the symbol in place of a sum of parts that is too long, or None."""
        if not _may_be_long(parts):
            return None
        count = operations(parts)
        if count <= MOST_OPERATIONS:
            return None
        self.counts.append(count)
        return labelled_symbol(self.notice(count), Dependence.ACCELERATION, 0)


def operations(parts: Sequence[Expr]) -> int:
    """Return the operations of a sum of parts: signs, sums, products, powers and functions.

    Sums within products and functions are counted once: places of long chains share them at every
    level, and a count over all paths would not end.
    """
    known: dict[int, int] = {}
    pending = list(parts)
    while pending:
        inner = _sums_within(pending[-1])
        missing = [whole for whole in inner if id(whole) not in known]
        if missing:
            pending += missing
            continue
        top = pending.pop()
        shallow = top.xreplace({whole: sympy.Dummy() for whole in inner})
        known[id(top)] = int(shallow.count_ops()) + sum(known[id(whole)] for whole in inner)
    return sum(known[id(part)] for part in parts) + len(parts) - 1


def _sums_within(expression: Expr) -> list[Expr]:
    """List the outermost sums below an expression, as often as they stand there."""
    inner, stack = [], list(expression.args)
    while stack:
        top = stack.pop()
        if top.is_Add:
            inner.append(top)
        else:
            stack += top.args
    return inner


def _may_be_long(parts: Sequence[Expr]) -> bool:
    """Tell whether there are so many nodes that the operations are worth counting."""
    # A node is two operations at the most, as the number -1/2.
    left = MOST_OPERATIONS // 2
    stack: list[Basic] = list(parts)
    while stack and left:
        stack.extend(stack.pop().args)
        left -= 1
    return bool(stack)


#: Letters of masses that no particle has, such as those of ``kinetic`` terms.
_MASSES = frozenset("mM")


#: Functions whose abbreviations stand where they do, behind all other factors.
_TRIGONOMETRIC = (sympy.sin, sympy.cos, sympy.tan, sympy.sinh, sympy.cosh, sympy.tanh)

#: Integers longer than this show as the scene wrote them (``1e30``).
_LONG_INTEGER = 10**6

#: Fractions from this denominator on are decimals where the scene writes decimals.
_LONG_DENOMINATOR = 1000

#: A factor of an expression that has a name, and its power.
NamedFactor: TypeAlias = tuple[SignedNode, Fraction]


@dataclass(frozen=True)
class Vocabulary:
    """Names of the symbols of some equations, and their order.

    Attributes
    ----------
    atoms
        Symbol → its node, which knows its rank.
    literals
        Exact value → decimal as the scene wrote it.
    functions
        Function of the scene → what it prints as in LaTeX, None for its name.
    sums
        Sum → its terms in the order of the scene, and true if it is minus their sum.
    named
        Expression → the product that it is of an abbreviation of the scene, each factor to a power.
    omission
        Leaves out expressions that are too long to be read; None if all are wanted.
    """

    atoms: Mapping[sympy.Symbol, DisplaySymbol]
    literals: Mapping[Fraction, str]
    functions: Mapping[str, str | None] = field(default_factory=dict)
    sums: Mapping[sympy.Expr, tuple[tuple[sympy.Expr, ...], bool]] = field(default_factory=dict)
    named: Mapping[sympy.Expr, tuple[NamedFactor, ...]] = field(default_factory=dict)
    omission: Omission | None = None

    @cached_property
    def products(self) -> list[tuple[Mapping[sympy.Expr, sympy.Expr], tuple[NamedFactor, ...]]]:
        """Return abbreviations that are monomials in parameters: exponents and name of each."""
        return [
            (expression.as_powers_dict(), factors)
            for expression, factors in self.named.items()
            if expression.is_Mul
            and expression.as_coeff_Mul(rational=True)[0] == 1
            and all(
                self.atoms[s].traits.level == Dependence.PARAMETER for s in expression.free_symbols
            )
        ]

    def number(self, value: Fraction) -> DisplayNumber:
        """Return the node of a number."""
        return ordering.number_of(value.numerator, value.denominator, self.decimal(value))

    def literal(self, value: Fraction) -> str | None:
        """Return the decimal that the scene wrote for a value, where that reads better."""
        if value.denominator > 4 or (value.denominator == 1 and value.numerator >= _LONG_INTEGER):
            return self.literals.get(value)
        return None

    def decimal(self, value: Fraction) -> str | None:
        """Return the decimal for a value: the scene's own, or in a scene that writes decimals the
        exact one of a fraction that nobody would write."""
        text = self.literal(value)
        is_short = value.denominator < _LONG_DENOMINATOR or value >= _LONG_INTEGER
        if text is not None or not self.literals or is_short:
            return text
        shortest = repr(float(value))
        return shortest if Fraction(shortest) == value else None


def vocabulary(
    equations: Equations, *, abbreviating: bool = False, omission: Omission | None = None
) -> Vocabulary:
    """Parameters, multipliers, time, inputs, states and coordinates, in order of declaration.

    Parameters
    ----------
    equations
        The equations.
    abbreviating
        True if the scene's abbreviations stand in place of their expressions.
    omission
        Leaves out expressions that are too long to be read; None if all are wanted.
    """
    masses = {s for particle in equations.system.particles for s in particle.mass.free_symbols}
    strengths = _strengths(equations.system)
    atoms = {
        p.symbol: ordering.symbol_of(
            p.name, Dependence.PARAMETER, rank, latex=p.latex, role=_role(p, masses, strengths)
        )
        for rank, p in enumerate(equations.system.parameters)
    }
    ranks = {c.name: rank for rank, c in enumerate(equations.system.coordinates)}
    for p in equations.system.parameters:
        if p.start_of is not None:
            rank = ranks.get(p.start_of, len(ranks))
            atoms[p.symbol] = ordering.start_symbol(p.name, rank, p.latex)
    for rank, closure in enumerate(equations.system.pushing, len(equations.system.parameters)):
        # With the underscores that tell the symbol from other names of the scene.
        name = multiplier_name(closure.multiplier.name.removeprefix("lambda_"))
        latex = equations.presentation.latex.get(closure.multiplier.name)
        atoms[closure.multiplier] = ordering.symbol_of(
            name, Dependence.PARAMETER, rank, latex=latex
        )
    atoms[equations.system.t] = ordering.symbol_of("t", Dependence.TIME, 0)
    for rank, source in enumerate(equations.system.inputs, 1):
        symbol = ordering.symbol_of(source.base, Dependence.TIME, rank, order=source.order)
        # One with rates is a function of t in derivations, and a symbol where it is held.
        function = unknown_function(source.base + "'" * source.order, equations.system.t)
        atoms |= {source.symbol: symbol, function: symbol}
        atoms[sympy.Symbol(source.name, real=True)] = symbol
    for rank, state in enumerate(equations.system.states, len(equations.system.inputs) + 1):
        atoms[state.symbol] = ordering.symbol_of(
            state.name, Dependence.TIME, rank, latex=state.latex
        )
    for rank, c in enumerate(equations.system.coordinates):
        for order, symbol in enumerate((c.q, c.v, c.a)):
            level = Dependence(Dependence.COORDINATE + order)
            atoms[symbol] = ordering.symbol_of(c.name, level, rank, order=order, latex=c.latex)
    functions = {f.name: f.latex for f in equations.system.functions}
    sums = _written(equations.presentation.sums)
    words = Vocabulary(
        atoms, dict(equations.presentation.literals), functions, sums, omission=omission
    )
    return replace(words, named=_named(equations, words)) if abbreviating else words


def latex_overrides(equations: Equations) -> dict[str, str]:
    """Return names of the scene that it says how to print in LaTeX."""
    names = dict(equations.presentation.latex)
    names |= {p.name: p.latex for p in equations.system.parameters if p.latex is not None}
    names |= {c.name: c.latex for c in equations.system.coordinates if c.latex is not None}
    names |= {s.name: s.latex for s in equations.system.states if s.latex is not None}
    return names | {f.name: f.latex for f in equations.system.functions if f.latex is not None}


def with_symbols(
    words: Vocabulary, symbols: Iterable[tuple[sympy.Symbol, str, str | None]]
) -> Vocabulary:
    """Further symbols with their names and LaTeX, in the places of velocities: momenta."""
    first = len(words.atoms)
    atoms = {
        symbol: ordering.symbol_of(name, Dependence.VELOCITY, rank, latex=latex)
        for rank, (symbol, name, latex) in enumerate(symbols, first)
    }
    return replace(words, atoms={**words.atoms, **atoms})


def _written(
    sums: Iterable[tuple[sympy.Expr, ...]],
) -> dict[sympy.Expr, tuple[tuple[sympy.Expr, ...], bool]]:
    """Return sums by their value, and by its negative: ``k (x2 - x1)``, ``-k (x2 - x1)``."""
    written = {sympy.Add(*terms): (terms, False) for terms in sums}
    for terms in sums:
        written.setdefault(sympy.Add(*(-t for t in terms)), (terms, True))
    return written


def _named(equations: Equations, words: Vocabulary) -> dict[sympy.Expr, tuple[NamedFactor, ...]]:
    """Return abbreviations by the base of the power that they are: r² by x² + y².

    A base with denominators has a name without them too: c²/γ² by c² − v².
    """
    named: dict[sympy.Expr, tuple[NamedFactor, ...]] = {}
    for rank, (name, expression) in enumerate(equations.presentation.abbreviations):
        if not expression.free_symbols or expression.is_Symbol:
            continue
        base, exponent = expression.as_base_exp()
        if not exponent.is_Rational:
            base, exponent = expression, sympy.S.One
        levels = [words.atoms[s].traits.level for s in expression.free_symbols if s in words.atoms]
        latex = equations.presentation.latex.get(name)
        is_last = isinstance(expression, _TRIGONOMETRIC)
        symbol = ordering.abbreviation_of(name, max(levels), rank, latex, is_last=is_last)
        factor = SignedNode(False, symbol), Fraction(int(exponent.q), int(exponent.p))
        named.setdefault(base, (factor,))
        if not base.is_Add:
            continue
        if exponent == 1:
            minus = SignedNode(True, symbol), Fraction(1)
            named.setdefault(sympy.Add(*(-a for a in base.args)), (minus,))
        letter = letter_below(base)
        if letter is not None:
            above = sympy.Add(*(a * letter for a in base.args))
            root, power = letter.as_base_exp()
            scale = SignedNode(False, words.atoms[root]), Fraction(int(power))
            named.setdefault(above, (scale, factor))
    return named


def _strengths(system: System) -> set[sympy.Symbol]:
    """Return symbols that multiply terms of V or of the dissipation function, and stand in no T.

    Stiffnesses, charges and coefficients of friction do; lengths stand in T or in squares.
    """
    outer: set[sympy.Symbol] = set()
    inner = set(symbols_in(system.kinetic))
    pending, seen = [system.potential, system.dissipation], set[int]()
    while pending:
        expression = pending.pop()
        if id(expression) in seen:
            continue
        seen.add(id(expression))
        if isinstance(expression, (sympy.Add, sympy.Mul)):
            pending.extend(expression.args)
        elif isinstance(expression, sympy.Symbol):
            outer.add(expression)
        else:
            inner |= symbols_in(expression)
    return outer - inner


def _role(
    parameter: Parameter, masses: Collection[sympy.Symbol], strengths: Collection[sympy.Symbol]
) -> Role:
    """Tell masses, g, G and strengths from other parameters."""
    base = split_name(parameter.name).base
    if parameter.symbol in masses or parameter.unit == "kg" or base in _MASSES:
        return Role.MASS
    usual = Role.STRENGTH if parameter.symbol in strengths else Role.OTHER
    return {"G": Role.COUPLING, "g": Role.GRAVITY}.get(parameter.name, usual)


def unabbreviated(name: str, words: Vocabulary) -> Vocabulary:
    """Return the words for the definition of an abbreviation: those that stand before it."""
    before = takewhile(
        lambda item: all(abbreviations_in(t.node) != {name} for t, _ in item[1]),
        words.named.items(),
    )
    return replace(words, named=dict(before))
