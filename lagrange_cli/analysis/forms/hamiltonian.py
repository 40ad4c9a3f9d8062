"""Hamilton's function and the canonical equations.

With p_j = ∂L/∂q̇_j and H = Σ p q̇ − L, Lagrange's equations are q̇ = ∂H/∂p and
ṗ = −∂H/∂q + Q + Σ λ ∂φ/∂q: generalized forces, friction, and the forces of closures and contacts
enter beside the gradient (H. Goldstein, C. Poole and J. Safko, Classical Mechanics, 3rd ed.,
section 8.1). Velocities that have no short closed form stay in the equations, and the momenta
determine them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.analysis.forms.certificate import (
    Evaluated,
    LagrangianSlopes,
    Pair,
    Residuals,
    State,
    certify_form,
    lagrangian_symbols,
)
from lagrange_cli.analysis.forms.legendre import (
    BlockTransform,
    at_rest,
    collected,
    coupled_blocks,
    momenta_of,
    terms_by_symbol,
    transformed,
)
from lagrange_cli.analysis.forms.momenta import Momentum, momenta
from lagrange_cli.errors import InputError, Mark, Problem, SingularError
from lagrange_cli.mechanics.algebra.collect import collected_terms
from lagrange_cli.mechanics.algebra.derivatives import derivative
from lagrange_cli.mechanics.algebra.polynomials import expand_terms
from lagrange_cli.mechanics.algebra.printed_length import printed_length
from lagrange_cli.mechanics.algebra.shortest import shortest_groups
from lagrange_cli.mechanics.dynamics.accelerations import multiplier_terms
from lagrange_cli.mechanics.findings import Certificate, Conserved
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, evaluate
from lagrange_cli.mechanics.proofs.zero_test import UndecidableError, vanish
from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.mechanics.system import Coordinate

#: Terms that a rate may be multiplied out to: longer sums are no shorter in print.
_TERM_BUDGET = 60

#: Longest derivative whose numbers are gathered: longer ones cost more time than they save letters.
_SHORT = 90

#: Smallest eigenvalue of a mass matrix, scaled to a diagonal of 1, that counts as not 0.
_REGULAR = 1e-12

_ZERO, _ONE = mpf(0), mpf(1)


@dataclass(frozen=True)
class CanonicalPair:
    """A coordinate, its momentum, and their equations.

    Attributes
    ----------
    momentum
        The momentum, with its coordinate.
    velocity
        q̇ over (q, p, t); None if the momenta determine it as a linear system.
    rate
        ṗ as terms in the order of print, over (q, p, t), and over velocities too where some have
        no closed form; inputs and multipliers may stand in it.
    """

    momentum: Momentum
    velocity: sp.Expr | None
    rate: tuple[sp.Expr, ...]


@dataclass(frozen=True)
class Hamiltonian:
    """H and the canonical equations of some equations of motion.

    Attributes
    ----------
    pairs
        One for each coordinate.
    parts
        The terms of H in the order of print: kinetic ones, −T0, V at rest. Those of ``coupled``
        coordinates, ½ (p − b)·M⁻¹ (p − b), are ½ (p − b) q̇ here.
    coupled
        Numbers of coordinates whose velocities are not solved for: the momenta determine them.
    is_sum
        True if H is T + V, with V at rest; None if that is not known.
    conserved
        The conserved energy or Jacobi's integral that H equals, None if it is not known to be
        conserved.
    certificate
        The comparison with L, M and f.
    """

    pairs: tuple[CanonicalPair, ...]
    parts: tuple[sp.Expr, ...]
    coupled: tuple[int, ...]
    is_sum: bool | None
    conserved: Conserved | None
    certificate: Certificate

    @property
    def expression(self) -> sp.Expr:
        """H over (q, p, t), and over the velocities of ``coupled`` coordinates."""
        return sp.Add(*self.parts)


def hamiltonian_form(equations: Equations) -> Hamiltonian:
    """Find H and the canonical equations.

    Raises
    ------
    InputError
        Located: L is neither quadratic in the velocities nor a root of a quadratic function, or
        momenta do not determine the velocities.
    InternalError
        The result disagrees with the certified equations.
    """
    coordinates = equations.system.coordinates
    functions = momenta_of(equations)
    named = momenta(equations, coordinates, functions.expressions)
    blocks = []
    for block in coupled_blocks(equations):
        shifted = [named[j].symbol - functions.shifts[j] for j in block]
        blocks.append(transformed(equations, block, shifted))
        _require_velocities(equations, blocks[-1])
    coupled = tuple(sorted(j for b in blocks if b.kinetic is None for j in b.numbers))
    velocities: list[sp.Expr | None] = [None] * len(coordinates)
    for b in blocks:
        for j, velocity in zip(b.numbers, b.velocities, strict=False):
            velocities[j] = velocity
    kinetic = [*_kinetic_parts(blocks)]
    kinetic += [(named[j].symbol - functions.shifts[j]) * coordinates[j].v / 2 for j in coupled]
    parts = tuple(e for e in (*kinetic, *_parts_at_rest(equations)) if e != 0)
    rates = _Rates(equations, named, velocities, parts, is_closed=not coupled)
    pairs = tuple(
        CanonicalPair(momentum, velocities[j], rates.terms(j)) for j, momentum in enumerate(named)
    )
    certificate = certify_form(
        equations, "Hamilton's form", _Comparison(equations, pairs, parts, coupled)
    )
    conserved = next((c for c in equations.derivation.conserved if c.kind != "momentum"), None)
    return Hamiltonian(pairs, parts, coupled, _is_sum(equations), conserved, certificate)


def _kinetic_parts(blocks: Sequence[BlockTransform]) -> Iterator[sp.Expr]:
    for block in blocks:
        if block.kinetic is not None:
            yield from sp.Add.make_args(block.kinetic)


def _parts_at_rest(equations: Equations) -> tuple[sp.Expr, sp.Expr]:
    """Return −T0, which moving frames contribute, and V at rest."""
    velocities = [c.v for c in equations.system.coordinates]
    return -at_rest(equations.system.kinetic, velocities), at_rest(
        equations.system.potential, velocities
    )


def _is_sum(equations: Equations) -> bool | None:
    """Tell whether Σ q̇ ∂L/∂q̇ − L equals T + V with V at rest; None if that is undecided."""
    kinds = [c.kind for c in equations.derivation.conserved]
    kinds += [equations.derivation.balance.kind] if equations.derivation.balance is not None else []
    if "energy" in kinds:
        return True
    potential_at_rest = at_rest(
        equations.system.potential, [c.v for c in equations.system.coordinates]
    )
    try:
        return vanish(equations.system.energy - equations.system.kinetic - potential_at_rest)
    except UndecidableError:
        return None


# -- refusals ---------------------------------------------------------------------------


def _require_velocities(equations: Equations, block: BlockTransform) -> None:
    """Refuse momenta that do not determine the velocities of a block, as far as that is known."""
    if block.kinetic is not None:
        return
    coordinates = [equations.system.coordinates[j] for j in block.numbers]
    listed = ", ".join(f"'{c.name}'" for c in coordinates)
    if not block.is_quadratic:
        message = (
            f"no Hamiltonian is found: the Lagrangian is neither quadratic in the velocities of"
            f" {listed} nor a root of what is, so that their momenta are not solved for them"
        )
        raise InputError(Problem(message, place(equations, coordinates[0]), rule="no-hamiltonian"))
    if not _is_regular(equations, block.numbers):
        message = (
            f"there is no Hamiltonian: the momenta of {listed} do not determine the velocities,"
            " since the mass matrix is singular"
        )
        hint = "Lagrange's equations hold: leave out '--form hamiltonian'"
        mark = place(equations, coordinates[0])
        raise SingularError(Problem(message, mark, hint=hint, rule="no-hamiltonian"))


def place(equations: Equations, coordinate: Coordinate) -> Mark:
    """Return the place at which the scene declares a coordinate, else its beginning."""
    return coordinate.mark or Mark(equations.presentation.file, 1, 1)


def _is_regular(equations: Equations, numbers: Sequence[int]) -> bool:
    """Tell whether a block of M is regular at a state of the certificate."""
    if equations.derivation.sources is None:
        return True
    matrix = np.zeros((len(numbers), len(numbers)))
    column = {j: k for k, j in enumerate(numbers)}
    for j in numbers:
        row = entries(equations.system.mass_matrix[j])
        try:
            values = evaluate([*row.values()], equations.derivation.sources.state)
        except DomainError:
            return True
        for k, value in zip(row, values, strict=True):
            matrix[column[j], column[k]] = float(value)
    scale = np.sqrt(np.abs(np.diag(matrix)))
    scale[scale == 0] = np.sqrt(np.abs(matrix).max(initial=0.0)) or 1.0
    sizes = np.linalg.eigvalsh(matrix / np.outer(scale, scale))
    return bool(np.abs(sizes).min() > _REGULAR)


# -- rates of momenta -------------------------------------------------------------------


class _Rates:
    """−∂H/∂q + Q + Σ λ ∂φ/∂q for each coordinate."""

    def __init__(
        self,
        equations: Equations,
        named: Sequence[Momentum],
        velocities: Sequence[sp.Expr | None],
        parts: Sequence[sp.Expr],
        *,
        is_closed: bool,
    ) -> None:
        self.equations = equations
        self.symbols = [m.symbol for m in named]
        pairs = zip(equations.system.coordinates, velocities, strict=True)
        self.solved = {c.v: v for c, v in pairs if v is not None} if is_closed else {}
        self.rates = self.symbols if is_closed else [c.v for c in equations.system.coordinates]
        # With velocities in the equations, −∂H/∂q is ∂L/∂q.
        energy = -sp.Add(*parts) if is_closed else equations.system.lagrangian
        self.holding = terms_by_symbol(energy)
        self.reactions = multiplier_terms(equations)
        self.constants = frozenset(p.symbol for p in equations.system.parameters)

    def terms(self, j: int) -> tuple[sp.Expr, ...]:
        """Return the terms of the rate of a momentum in the order of print."""
        q = self.equations.system.coordinates[j].q
        slopes = [_factored(derivative(term, q)) for term in self.holding.get(q, ())]
        terms = [t for e in (*slopes, *self._forces(j)) for t in sp.Add.make_args(e)]
        moving, still = self._apart(terms)
        written = [self._gathered([sp.Add(*moving)], still)]
        expanded = expand_terms(sp.Add(*moving), _TERM_BUDGET)
        if expanded is not None:
            moving, others = self._apart(collected_terms(expanded))
            written.append(self._gathered([collected(sp.Add(*moving), self.rates)], still + others))
        best = min(written, key=lambda way: sum(map(printed_length, way)))
        return tuple(e for e in (*best, *self.reactions[j]) if e != 0)

    def _apart(self, terms: Sequence[sp.Expr]) -> tuple[list[sp.Expr], list[sp.Expr]]:
        """Split terms into those with momenta or velocities and those without."""
        moving = [t for t in terms if not symbols_in(t).isdisjoint(self.rates)]
        return moving, [t for t in terms if symbols_in(t).isdisjoint(self.rates)]

    def _gathered(self, moving: list[sp.Expr], still: Sequence[sp.Expr]) -> list[sp.Expr]:
        """Return all terms as they are printed, those without momenta in their shortest form."""
        expanded = [e for t in still for e in expand_terms(t, _TERM_BUDGET) or [t]]
        groups = shortest_groups(collected_terms(expanded), self.constants)
        return [e for e in (*moving, *groups) if e != 0]

    def _forces(self, j: int) -> Iterator[sp.Expr]:
        """Yield the generalized forces Q_j and friction, over momenta."""
        for force in self.equations.system.forces:
            yield force.generalized[j].xreplace(self.solved)
        friction = -derivative(
            self.equations.system.dissipation, self.equations.system.coordinates[j].v
        )
        yield friction.xreplace(self.solved)


def _factored(slope: sp.Expr) -> sp.Expr:
    """Take numbers out of sums, which a derivative leaves there, if the whole is short."""
    if printed_length(slope) > _SHORT:
        return slope
    terms = sp.Add.make_args(slope)
    return sp.Add(*(min(t, sp.factor_terms(t), key=printed_length) for t in terms))


# -- certificate ------------------------------------------------------------------------


class _Comparison:
    """Comparison at a state of momenta, velocities, H, its gradient, and the rates."""

    def __init__(
        self,
        equations: Equations,
        pairs: Sequence[CanonicalPair],
        parts: Sequence[sp.Expr],
        coupled: Sequence[int],
    ) -> None:
        self.equations, self.pairs, self.coupled = equations, pairs, coupled
        self.lagrangian = Tape([equations.system.lagrangian], lagrangian_symbols(equations))
        self.canonical = [equations.system.t, *(c.q for c in equations.system.coordinates)]
        self.canonical += [pair.momentum.symbol for pair in pairs]
        self.canonical += [equations.system.coordinates[j].v for j in coupled]
        self.canonical += [p.symbol for p in equations.system.parameters]
        self.canonical += [x.symbol for x in equations.system.external if x.symbol.is_Symbol]
        self.energy = Tape([sp.Add(*parts)], self.canonical)
        self.rates = Evaluated([sp.Add(*pair.rate) for pair in pairs])
        self.momenta = Evaluated([pair.momentum.expression for pair in pairs])
        self.solved = [
            (p.momentum.coordinate.v, p.velocity) for p in pairs if p.velocity is not None
        ]
        self.velocities = Evaluated([velocity for _, velocity in self.solved])
        self.residuals = Residuals(equations)

    def __call__(self, state: State) -> Iterator[Pair]:
        coordinates = self.equations.system.coordinates
        seen = LagrangianSlopes(self.equations, self.lagrangian, state)
        canonical = {**state}
        for pair, p in zip(self.pairs, seen.momenta, strict=True):
            canonical[pair.momentum.symbol] = p
        work = [p * state[c.v] for p, c in zip(seen.momenta, coordinates, strict=True)]
        for p, value in zip(seen.momenta, self.momenta.at(state), strict=True):
            yield value, p, abs(value) + abs(p)
        yield from self._velocities(canonical)
        yield from self._energy(canonical, seen, work)
        pairs = zip(self.rates.at(canonical), seen.rates, self.residuals.at(state), strict=True)
        for rate, change, (residual, size) in pairs:
            yield change - rate, residual, size + abs(change) + abs(rate)

    def _velocities(self, state: State) -> Iterator[Pair]:
        for (v, _), value in zip(self.solved, self.velocities.at(state), strict=True):
            yield value, state[v], abs(value) + abs(state[v])

    def _energy(self, state: State, seen: LagrangianSlopes, work: Sequence[mpf]) -> Iterator[Pair]:
        """Yield the comparisons of H and, if it has a closed form, of its gradient."""
        n = len(self.pairs)
        run = self.energy.run([(state[s], _ZERO, _ZERO) for s in self.canonical], 0)
        energy, size = run.values[0], sum(map(abs, work), abs(seen.value))
        yield energy, sum(work, -seen.value), size + abs(energy)
        if self.coupled:
            return
        gradient = run.gradient({0: _ONE})
        for c, slope in zip(self.equations.system.coordinates, gradient[1 + n :], strict=False):
            yield slope, state[c.v], abs(slope) + abs(state[c.v])
        for rise, slope in zip(gradient[1:], seen.slopes, strict=False):
            yield -rise, slope, abs(rise) + abs(slope) + size
