"""Poisson brackets {f, g} = Σ ∂f/∂q ∂g/∂p − ∂f/∂p ∂g/∂q of functions over (q, p, t).

Functions are written in the scene language over coordinates, momenta, conserved quantities of
linear symmetries, and H. Without forces and constraints df/dt = {f, H} + ∂f/∂t (H. Goldstein, C.
Poole and J. Safko, Classical Mechanics, 3rd ed., section 9.6). Each bracket is compared with
central differences, in many digits, of the functions as they were written; there velocities are
solved from the momenta, and H is Σ p q̇ − L.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.certificate import Evaluated, Pair, State, certify_form
from lagrange_cli.analysis.forms.hamiltonian import Hamiltonian, hamiltonian_form
from lagrange_cli.analysis.forms.legendre import collected
from lagrange_cli.analysis.symmetries.linear_symmetries import linear_symmetries
from lagrange_cli.errors import InternalError
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shorten import shortened
from lagrange_cli.mechanics.findings import (
    Certificate,
    NamedQuantity,
    PoissonBracket,
    PoissonBrackets,
)
from lagrange_cli.mechanics.interpretation import expression_of, interpret
from lagrange_cli.mechanics.numerics.autodiff import DomainError
from lagrange_cli.mechanics.proofs.zero_test import vanish
from lagrange_cli.scene.language.expression import TIME_DERIVATIVES, Call, names_in, walk
from lagrange_cli.scene.language.written_text import WrittenText

if TYPE_CHECKING:
    from lagrange_cli.analysis.forms.momenta import Momentum
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.language.expression import Expression

#: Name of Hamilton's function, unless the scene has one of its own.
_H = "H"

_EXAMPLE = "'L_x, L_y', 'x*p_y - y*p_x, H'"

#: Part of the size of its terms above which a rate, known to 60 digits, is not zero.
_NOTHING = mpf(10) ** -20


class WrittenBracket(WrittenText):
    """Two functions as they were written."""

    rule: ClassVar[str] = "bracket"


def with_brackets(equations: Equations, brackets: Sequence[WrittenBracket]) -> Equations:
    """Return equations that hold these brackets, which Hamilton's form then prints.

    Raises
    ------
    InputError
        Located: a text is not two functions over (q, p, t); or there is no Hamiltonian.
    InternalError
        A bracket is not that of numerical derivatives.
    """
    if not brackets:
        return equations
    form = hamiltonian_form(equations)
    reader = _Reader(equations, form)
    values, certificates = [], []
    for written in brackets:
        first, second = reader.sides(written)
        value = reader.bracket(first, second)
        comparison = _Comparison(equations, form, reader.known, (first, second), value)
        certificates.append(_certified(equations, written, comparison))
        values.append(reader.named_bracket(first, second, value))
    named = tuple(q for q in reader.known.values() if _is_named(q, values))
    certificate = Certificate(
        min(c.points for c in certificates),
        certificates[0].digits,
        max(c.mismatch for c in certificates),
    )
    return replace(
        equations,
        derivation=replace(
            equations.derivation, brackets=PoissonBrackets(tuple(values), named, certificate)
        ),
    )


def _certified(
    equations: Equations, written: WrittenBracket, comparison: _Comparison
) -> Certificate:
    """Compare a bracket at random states.

    Raises
    ------
    InputError
        Located: it has no value at any of them.
    InternalError
        It is not that of numerical derivatives.
    """
    try:
        return certify_form(equations, "a Poisson bracket", comparison)
    except InternalError as error:
        if comparison.states:
            raise
        said = "these functions have no real value at any state that was tried"
        raise written.refusal(said, 0, len(written.text)) from error


def _is_named(quantity: NamedQuantity, brackets: Sequence[PoissonBracket]) -> bool:
    """Tell whether a quantity other than H, which Hamilton's form prints, stands in a bracket."""
    expressions = (e for b in brackets for e in (b.first, b.second, b.value))
    return quantity.name != _H and any(quantity.symbol in e.free_symbols for e in expressions)


class _Reader:
    """Reads functions, and finds their brackets."""

    def __init__(self, equations: Equations, form: Hamiltonian) -> None:
        self.equations, self.form = equations, form
        self.momenta: list[Momentum] = [pair.momentum for pair in form.pairs]
        self.known: dict[str, NamedQuantity] = {}
        if not form.coupled:
            self.known[_H] = _named(_H, form.expression, equations.system.energy)
        self.velocities = {
            pair.momentum.coordinate.v: pair.velocity
            for pair in form.pairs
            if pair.velocity is not None
        }

    @cached_property
    def _symmetries(self) -> Mapping[str, NamedQuantity]:
        """Conserved quantities of linear symmetries, Σ ξ p − F, by name."""
        symbols = [m.symbol for m in self.momenta]
        quantities = {}
        for s in linear_symmetries(self.equations).proven:
            moments = (x * p for x, p in zip(s.field, symbols, strict=True))
            over_momenta = collected(sp.Add(*moments, -s.gauge), symbols)
            quantities[s.name] = _named(s.name, over_momenta, s.expression)
        return quantities

    # -- reading ------------------------------------------------------------------------

    def sides(self, written: WrittenBracket) -> tuple[sp.Expr, sp.Expr]:
        """Read two functions; names of quantities stand in them as symbols.

        Raises
        ------
        InputError
            Located: there are not two, or one is no function over (q, p, t).
        """
        parts = written.parts()
        if len(parts) != 2:
            said = "a bracket is of two functions with a comma between them"
            raise written.refusal(said, 0, len(written.text), _EXAMPLE)
        first, second = (self._function(written, *part) for part in parts)
        return first, second

    def _function(self, written: WrittenBracket, start: int, end: int) -> sp.Expr:
        parsed = expression_of(self.equations, written, start, end)
        self._require_no_rates(written, parsed, start, end)
        asked = {name.name for name in names_in(parsed.node)}
        if self.form.coupled and _H in asked - self._names_of_the_scene:
            said = "H holds velocities that have no closed form over the momenta here"
            raise written.refusal(said, start, end, "write functions of coordinates and momenta")
        momenta = {m.name: m.symbol for m in self.momenta}
        if asked - momenta.keys() - self.known.keys() - self._names_of_the_scene:
            self.known |= {n: q for n, q in self._symmetries.items() if n in asked}
        further = momenta | {name: quantity.symbol for name, quantity in self.known.items()}
        function = interpret(self.equations, parsed, further)
        unknown = {c.a for c in self.equations.system.coordinates}
        unknown |= {closure.multiplier for closure in self.equations.system.pushing}
        if not function.free_symbols.isdisjoint(unknown):
            said = "accelerations and multipliers are no functions of coordinates and momenta"
            raise written.refusal(said, start, end, _EXAMPLE)
        left = {c.v for c in self.equations.system.coordinates} - self.velocities.keys()
        if not function.free_symbols.isdisjoint(left):
            said = "these velocities have no closed form over the momenta here"
            raise written.refusal(said, start, end, "write it with momenta")
        return function

    @cached_property
    def _names_of_the_scene(self) -> set[str]:
        equations = self.equations
        names = {c.name for c in equations.system.coordinates} | {
            p.name for p in equations.system.parameters
        }
        names |= {c.name for c in equations.system.cartesian_names} | {
            x.name for x in equations.system.external
        }
        return names | {name for name, _ in equations.presentation.abbreviations} | {"t", "pi"}

    def _require_no_rates(
        self, written: WrittenBracket, parsed: Expression, start: int, end: int
    ) -> None:
        """Refuse rates of momenta and quantities, which are brackets themselves."""
        named = {m.name for m in self.momenta} | {_H} | self._symmetry_names(parsed)
        for node in walk(parsed.node):
            if isinstance(node, Call) and node.function in TIME_DERIVATIVES:
                names_inside = {n.name for n in names_in(node)} - self._names_of_the_scene
                for name in sorted(names_inside & named):
                    said = f"the rate of '{name}' is a bracket itself"
                    raise written.refusal(said, start, end, f"'{name}, H'")

    def _symmetry_names(self, parsed: Expression) -> set[str]:
        asked = {name.name for name in names_in(parsed.node)} - self._names_of_the_scene
        return set(self._symmetries) if asked - {m.name for m in self.momenta} - {_H} else set()

    # -- brackets -----------------------------------------------------------------------

    def over_momenta(self, function: sp.Expr) -> sp.Expr:
        """Write a function over (q, p, t), without velocities and names of quantities."""
        values = {q.symbol: q.expression for q in self.known.values()}
        return function.xreplace(values).xreplace(self.velocities)

    def bracket(self, first: sp.Expr, second: sp.Expr) -> sp.Expr:
        """Compute {f, g} over (q, p, t) and return the shortest of three forms."""
        f, g = self.over_momenta(first), self.over_momenta(second)
        terms = []
        for m in self.momenta:
            q, p = m.coordinate.q, m.symbol
            terms.append(derivative(f, q) * derivative(g, p))
            terms.append(-derivative(f, p) * derivative(g, q))
        return self._short(sp.Add(*terms))

    def _short(self, value: sp.Expr) -> sp.Expr:
        if vanish(value):
            return sp.Integer(0)
        symbols = [m.symbol for m in self.momenta]
        forms = (value, shortened(value), collected(value, symbols))
        return min(forms, key=printed_length)

    def named_bracket(self, first: sp.Expr, second: sp.Expr, value: sp.Expr) -> PoissonBracket:
        """Return a bracket under the name of its value, and df/dt if it is a bracket with H."""
        rate, conserved = None, None
        if second == self._symbol(_H) and self._is_free(first):
            explicit = derivative(self.over_momenta(first), self.equations.system.t)
            rate = self._short(sp.Add(value, explicit))
            conserved = True if rate == 0 else self._found_to_change(rate)
        return PoissonBracket(first, second, self._by_name(value), rate, conserved)

    def _symbol(self, name: str) -> sp.Symbol | None:
        return self.known[name].symbol if name in self.known else None

    def _is_free(self, function: sp.Expr) -> bool:
        """Tell whether df/dt = {f, H} + ∂f/∂t: no force, constraint or input changes f."""
        equations = self.equations
        inputs = equations.system.external_symbols
        moved = (
            equations.system.forces or equations.system.pushing or equations.system.dissipation != 0
        )
        return not moved and self.over_momenta(function).free_symbols.isdisjoint(inputs)

    def _by_name(self, value: sp.Expr) -> sp.Expr:
        """Return the symbol of the quantity that a value equals up to its sign, else the value."""
        if value.is_number or value in {m.symbol for m in self.momenta}:
            return value
        self.known |= {n: q for n, q in self._candidates() if n not in self.known}
        for quantity in self.known.values():
            for sign in (1, -1):
                if vanish(value - sign * quantity.expression):
                    return sign * quantity.symbol
        return value

    def _candidates(self) -> Iterator[tuple[str, NamedQuantity]]:
        """Yield the quantities that a bracket of quantities may equal."""
        if set(self.known) - {_H}:
            taken = self._names_of_the_scene
            yield from ((n, q) for n, q in self._symmetries.items() if n not in taken)

    def _found_to_change(self, rate: sp.Expr) -> bool | None:
        """Return False if the rate differs from zero at a state, else None."""
        if self.equations.derivation.sources is None:
            return None
        with mpmath.workdps(60):
            state = _with_momenta(self.form, self.equations.derivation.sources.state)
            terms = sp.Add.make_args(sp.expand(rate))
            try:
                values = Evaluated(terms).at(state)
            except (DomainError, ZeroDivisionError, OverflowError):
                return None
            changes = abs(mpmath.fsum(values)) > _NOTHING * mpmath.fsum(map(abs, values))
        return False if changes else None


def _named(name: str, expression: sp.Expr, over_velocities: sp.Expr) -> NamedQuantity:
    return NamedQuantity(name, sp.Symbol(f"{name} "), expression, over_velocities)


def _with_momenta(form: Hamiltonian, state: State) -> dict[sp.Symbol, mpf]:
    """Add the momenta to a state of coordinates and velocities."""
    values = Evaluated([pair.momentum.expression for pair in form.pairs]).at(state)
    symbols = [pair.momentum.symbol for pair in form.pairs]
    return {**state, **dict(zip(symbols, values, strict=True))}


# -- certificate ------------------------------------------------------------------------


class _Comparison:
    """A bracket beside that of the functions as they were written, differentiated in numbers.

    ``states``: the number of states at which both have a value.
    """

    def __init__(
        self,
        equations: Equations,
        form: Hamiltonian,
        known: Mapping[str, NamedQuantity],
        sides: tuple[sp.Expr, sp.Expr],
        value: sp.Expr,
    ) -> None:
        self.equations, self.form = equations, form
        symbols = {s for side in sides for s in side.free_symbols}
        self.known = [q for q in known.values() if q.symbol in symbols]
        self._functions, self._bracket = Evaluated(sides), Evaluated([value])
        self.states = 0

    def __call__(self, state: State) -> Iterator[Pair]:
        start = _with_momenta(self.form, state)
        (value,) = self._bracket.at(start)
        slopes = [
            [self._slopes(start, s) for s in (m.coordinate.q, m.symbol)] for m in self._momenta
        ]
        terms = [by_q[0] * by_p[1] for by_q, by_p in slopes]
        terms += [-by_p[0] * by_q[1] for by_q, by_p in slopes]
        self.states += 1
        yield value, mpmath.fsum(terms), mpmath.fsum(map(abs, terms)) + abs(value)

    @cached_property
    def _momenta(self) -> list[Momentum]:
        return [pair.momentum for pair in self.form.pairs]

    @cached_property
    def _solved(self) -> tuple[list[sp.Symbol], Evaluated]:
        pairs = [p for p in self.form.pairs if p.velocity is not None]
        velocities = [p.velocity for p in pairs if p.velocity is not None]
        return [p.momentum.coordinate.v for p in pairs], Evaluated(velocities)

    @cached_property
    def _quantities(self) -> tuple[list[sp.Symbol], Evaluated]:
        """Named quantities over velocities, H as Σ p q̇ − L; over momenta if these have no form."""
        known = self.known
        if self.form.coupled:
            return [q.symbol for q in known], Evaluated([q.expression for q in known])
        work = [m.symbol * m.coordinate.v for m in self._momenta]
        energy = sp.Add(*work, -self.equations.system.lagrangian)
        each = [energy if q.name == _H else q.over_velocities for q in known]
        return [q.symbol for q in known], Evaluated(each)

    def _slopes(self, state: State, symbol: sp.Symbol) -> list[mpf]:
        """Differentiate both functions by a coordinate or a momentum, in the mode forward."""
        values, rates = dict(state), {symbol: mpf(1)}
        for symbols, expressions in (self._solved, self._quantities):
            # Velocities come from the momenta, and quantities from both.
            series = expressions.along(values, rates)
            values |= {s: value for s, (value, _, _) in zip(symbols, series, strict=True)}
            rates |= {s: rate for s, (_, rate, _) in zip(symbols, series, strict=True)}
        return [rate for _, rate, _ in self._functions.along(values, rates)]
