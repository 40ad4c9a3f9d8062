"""The initial state: coordinates and velocities from what the scene gives.

Values may be given in coordinates or in Cartesian names. Given values stay; missing positions
follow from given Cartesian values, missing velocities are the smallest, in the metric of the
kinetic energy, that the given ones and the closures allow.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import (
    InconsistentStartError,
    InputError,
    MissingStartError,
    NotRealError,
    Problem,
    SingularError,
)
from lagrange_cli.mechanics.initial.configuration import Configurations, ConfigurationSearch
from lagrange_cli.mechanics.initial.contact_gaps import GapProjection
from lagrange_cli.mechanics.initial.joint_branches import JointBranches
from lagrange_cli.mechanics.initial.projection import ClosureProjection, smallest_solution, state_of
from lagrange_cli.mechanics.initial.suggestions import with_suggestion
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape
from lagrange_cli.mechanics.numerics.elementary import (
    in_decimals,
    numbers_as_decimals,
    to_decimal,
    to_mpf,
)
from lagrange_cli.mechanics.numerics.gauss_newton import SparseRow, least_norm_solution
from lagrange_cli.mechanics.reduction.reduced_scene import Reduced
from lagrange_cli.mechanics.symbols.quoting import near_snippet
from lagrange_cli.mechanics.symbols.values import evaluated, evaluated_by_factors
from lagrange_cli.mechanics.system import InitialState
from lagrange_cli.scene.conditions import InitialValue

#: Largest violation, relative to the scene's length, that is projected instead of refused.
_TOLERANCE = mpf(10) ** -9

#: Decimal digits carried; a second attempt carries twice as many.
_DIGITS = 34
#: Relative size of rounding errors that remain.
_ROUNDING = mpf(10) ** -20
#: Further digits for the metric, whose inverse is huge where a coordinate has no inertia.
_MORE_DIGITS = 26
#: Numbers below this part of the largest are computed with more digits too.
_HARDLY = 1e-20
_ZERO = mpf(0)

#: Most conditions on velocities that are solved densely; more are solved by sparse elimination.
_LARGE = 64


class HasMassMatrix(Protocol):
    """A reduced scene with its mass matrix."""

    @property
    def reduced(self) -> Reduced: ...

    @property
    def mass(self) -> Sequence[Mapping[int, Sequence[sp.Expr]]]: ...


def initial_state(derivation: HasMassMatrix) -> InitialState | None:
    """Initial q and v in doubles; None if the scene gives none or a parameter lacks its value.

    Raises
    ------
    InputError
        Located: a name that is no coordinate or Cartesian name, a coordinate that
        nothing determines, values that contradict each other or the constraints.
    """
    reduced = derivation.reduced
    if not reduced.scene.initial:
        return None
    if any(p.name not in reduced.values.exact for p in reduced.scene.parameters):
        return None
    if any(f.is_unknown for f in reduced.scene.functions):
        return None  # the stand-in for an unknown function has no meaningful values
    state = _solved(derivation, _DIGITS)
    if _hardly(state.positions) or _hardly(state.velocities):
        finer = _solved(derivation, 2 * _DIGITS)
        return replace(
            state,
            positions=_without_noise(state.positions, finer.positions),
            velocities=_without_noise(state.velocities, finer.velocities),
            decimals=finer.decimals,
        )
    return replace(state, decimals=_decimals(derivation))


def _decimals(derivation: HasMassMatrix) -> tuple[str, ...]:
    """Solve for the state with more digits.

    Empty if its configuration needs a search, or these digits show no solution.
    """
    reduced = derivation.reduced
    stated = {entry.name for entry in reduced.scene.initial if entry.order == 0}
    if not {c.name for c in reduced.coordinates} <= stated:
        return ()
    try:
        return _solved(derivation, 2 * _DIGITS).decimals
    except InputError:
        return ()


def _solved(derivation: HasMassMatrix, digits: int) -> InitialState:
    with mpmath.workdps(digits):
        state = _Initial(derivation, digits)
        try:
            return state.solve()
        except InputError as error:
            known = {s: x for s, (x, _) in state.given[0].items() if s in state.number}
            raise with_suggestion(derivation.reduced, error, known, placed=state.placed) from None


def _hardly(values: Sequence[float]) -> bool:
    """Tell whether some values may be zeros with rounding errors."""
    bound = _HARDLY * max(map(abs, values), default=0.0)
    return any(0 < abs(x) <= bound for x in values)


def _without_noise(values: Sequence[float], finer: Sequence[float]) -> tuple[float, ...]:
    """Replace numbers that shrink with more digits by zeros."""
    pairs = zip(values, finer, strict=True)
    return tuple(0.0 if abs(better) < abs(x) / 2 else x for x, better in pairs)


class _Initial:
    def __init__(self, derivation: HasMassMatrix, digits: int) -> None:
        self.derivation, self.digits = derivation, digits
        self.reduced = derivation.reduced
        names = self.reduced.names
        self.q = [c.q for c in self.reduced.coordinates]
        self.number = {q: j for j, q in enumerate(self.q)}
        self.constants: dict[sp.Symbol, mpf] = {
            names.parameters[n]: evaluated(x, digits) for n, x in self.reduced.values.exact.items()
        }
        self.constants[names.t] = self.reduced.reference[names.t]
        self.given: dict[int, dict[sp.Symbol, tuple[mpf, InitialValue]]] = {0: {}, 1: {}}
        for entry in self.reduced.scene.initial:
            self._take(entry)
        self.closures = ClosureProjection(self.reduced, self.constants, self._length())
        self.gaps = GapProjection(self.reduced, self.constants)
        self.joints = JointBranches(self.reduced, self.constants)
        self.placed = False

    def _take(self, entry: InitialValue) -> None:
        symbol = self.reduced.names.lookup(entry.name)
        known = symbol in self.reduced.resolved or symbol in self.number
        if symbol is None or not known:
            raise InputError(
                Problem(
                    f"'{entry.name}' is neither a coordinate nor a Cartesian name",
                    entry.mark,
                    rule="unknown-name",
                )
            )
        value = self.reduced.values.number(entry.value)
        assert value is not None  # every parameter has a value
        self.given[entry.order][symbol] = (evaluated_by_factors(value, self.digits), entry)

    def solve(self) -> InitialState:
        start, moved = self._placed()
        self.placed = self._agrees(start)
        if any(
            c.is_positive and not x > 0
            for c, x in zip(self.reduced.coordinates, start, strict=True)
        ):
            raise self._beyond(start)
        try:
            velocities = self._velocities(self._tape(1), start)
            velocities, turned = self.closures.tangent(start, velocities)
            velocities, slid = self.gaps.tangent(start, velocities)
        except DomainError:
            raise self._singular() from None
        projected = max(self._check(start, velocities), moved, turned, slid)
        return state_of(start, velocities, float(projected))

    def _placed(self) -> tuple[list[mpf], mpf]:
        """Put coordinates on closures and closed gaps; return them and the largest change."""
        try:
            start, moved = self.closures.placed(self._positions())
            start, closed = self.gaps.placed(start)
            self.joints.require(start)
            return start, max(moved, closed)
        except DomainError:
            raise self._unreal() from None

    def _agrees(self, start: Sequence[mpf]) -> bool:
        """Tell whether given Cartesian positions are those of the coordinates."""
        inputs = [(x, _ZERO, _ZERO) for x in [*start, *self.constants.values()]]
        try:
            placed = self._tape(0).run(inputs, 0).values
        except DomainError:
            return False
        stated = [self.given[0][s][0] for s in self._cartesian(0)]
        apart = (abs(x - y) for x, y in zip(placed, stated, strict=True))
        return bool(max(apart, default=_ZERO) <= _TOLERANCE * self._length())

    def _cartesian(self, order: int) -> list[sp.Symbol]:
        """Cartesian names with a given value that are not coordinates themselves."""
        return [s for s in self.given[order] if s not in self.number]

    def _tape(self, order: int) -> Tape:
        expressions = [self.reduced.resolved[s] for s in self._cartesian(order)]
        return Tape(expressions, [*self.q, *self.constants])

    # Positions.

    def _positions(self) -> list[mpf]:
        known = {s: value for s, (value, _) in self.given[0].items() if s in self.number}
        missing = [j for j, q in enumerate(self.q) if q not in known]
        guess = [known.get(q, self.reduced.reference.get(q, mpf("0.1"))) for q in self.q]
        if missing:
            guess = self._from_cartesian(guess, missing)
        return guess

    def _from_cartesian(self, guess: list[mpf], missing: Sequence[int]) -> list[mpf]:
        """The missing coordinates from given Cartesian values."""
        symbols = self._cartesian(0)
        target = [self.given[0][s][0] for s in symbols]
        length = self._length()
        search = ConfigurationSearch(self.reduced, self.constants, symbols, target, missing, length)
        reached = search.configurations(guess, _TOLERANCE * length)
        if not reached.exact and reached.nearest:
            raise self._unreachable(symbols, reached)
        if not reached.exact and reached.beyond:
            raise self._beyond(reached.beyond)
        if not reached.exact and reached.regular:
            raise self.closures.nowhere()
        if not reached.exact:
            raise self._undetermined(missing)
        near = any(self.q[j] in self.reduced.reference for j in missing)
        possible = self.joints.possible(self.gaps.possible(reached.exact))
        if len(possible) > 1 and not near:
            raise self._ambiguous(possible, missing)
        return possible[0]

    def _unreachable(self, symbols: Sequence[sp.Symbol], reached: Configurations) -> InputError:
        """Refuse given Cartesian values without a configuration, naming the worst one."""
        worst = max(range(len(reached.misses)), key=lambda k: reached.misses[k])
        if worst >= len(symbols):
            raise self.closures.violated(worst - len(symbols), reached.misses[worst])
        _, entry = self.given[0][symbols[worst]]
        return _contradiction(entry, reached.values[worst])

    def _ambiguous(
        self, configurations: Sequence[Sequence[mpf]], missing: Sequence[int]
    ) -> InputError:
        names = [self.reduced.coordinates[j].name for j in missing]
        choices = [
            {n: f"{float(q[j]):.8g}" for n, j in zip(names, missing, strict=True)}
            for q in configurations[:4]
        ]
        return InputError(
            Problem(
                "the initial values leave several configurations",
                self.reduced.scene.initial[0].mark,
                hint="\n".join(
                    [
                        "choose one:",
                        *(near_snippet(self.reduced.scene, values) for values in choices),
                    ]
                ),
                rule="initial-ambiguous",
            )
        )

    def _beyond(self, q: Sequence[mpf]) -> InputError:
        """Refuse a configuration with a coordinate that is declared positive and is not."""
        below = (j for j, c in enumerate(self.reduced.coordinates) if c.is_positive and q[j] <= 0)
        number = next(below)
        name, value = self.reduced.coordinates[number].name, mpmath.nstr(q[number], 12)
        entry = next((e for e in self.reduced.scene.initial if e.name == name), None)
        return InconsistentStartError(
            Problem(
                f"the initial values ask for {name} = {value}, which is declared positive",
                (entry or self.reduced.scene.initial[0]).mark,
                rule="not-positive",
            )
        )

    def _undetermined(self, missing: Sequence[int]) -> InputError:
        names = [self.reduced.coordinates[j].name for j in missing]
        listed = ", ".join(f"'{n}'" for n in names)
        return MissingStartError(
            Problem(
                f"the initial values do not determine {listed}",
                self.reduced.scene.initial[0].mark,
                hint="give their values too:",
                rule="initial-missing",
            )
        )

    # Velocities.

    def _velocities(self, tape: Tape, start: Sequence[mpf]) -> list[mpf]:
        known = {s: value for s, (value, _) in self.given[1].items() if s in self.number}
        velocities = [known.get(q, _ZERO) for q in self.q]
        missing = [j for j, q in enumerate(self.q) if q not in known]
        symbols = self._cartesian(1)
        gradients, levels = self.closures.rates(start)
        if not (symbols or gradients) or not missing:
            return velocities
        rows, drift = self._rates(tape, start)
        wanted = [self.given[1][s][0] - d for s, d in zip(symbols, drift, strict=True)]
        rows, wanted = [*rows, *gradients], [*wanted, *(-x for x in levels)]
        target = [
            x - sum(entry * velocities[j] for j, entry in row.items() if velocities[j])
            for x, row in zip(wanted, rows, strict=True)
        ]
        if not any(target):
            return velocities  # names that need not move are at rest
        place = {j: k for k, j in enumerate(missing)}
        matrix = [{place[j]: x for j, x in row.items() if j in place} for row in rows]
        solved = self._least(matrix, target, start, missing)
        for j, value in zip(missing, solved, strict=True):
            velocities[j] = value
        return velocities

    def _least(
        self,
        matrix: Sequence[SparseRow],
        target: Sequence[mpf],
        start: Sequence[mpf],
        missing: Sequence[int],
    ) -> list[mpf]:
        """Velocities of least kinetic energy with matrix·v = target."""
        metric = self._metric(start, missing)
        weights = [row.get(k, _ZERO) for k, row in enumerate(metric)]
        if len(matrix) > _LARGE and min(weights) > 0 and all(len(row) == 1 for row in metric):
            with in_decimals():
                rows = [numbers_as_decimals(row) for row in matrix]
                units = [1 / to_decimal(w).sqrt() for w in weights]
                solved = least_norm_solution(rows, [to_decimal(x) for x in target], units)
                return [to_mpf(x) for x in solved]
        with mpmath.workdps(self.digits + _MORE_DIGITS):
            return smallest_solution(matrix, target, metric)

    def _rates(self, tape: Tape, start: Sequence[mpf]) -> tuple[list[SparseRow], list[mpf]]:
        """∂c/∂q and ∂c/∂t of the Cartesian names with a given velocity."""
        inputs = [(x, _ZERO, _ZERO) for x in [*start, *self.constants.values()]]
        run = tape.run(inputs, 0)
        n = len(self.q)
        clock = n + list(self.constants).index(self.reduced.names.t)
        gradients = [run.partials(k) for k in range(len(tape.outputs))]
        rows: list[SparseRow] = [{j: x for j, x in g.items() if j < n} for g in gradients]
        return rows, [g.get(clock, _ZERO) for g in gradients]

    def _metric(self, start: Sequence[mpf], missing: Sequence[int]) -> list[SparseRow]:
        """The mass matrix of the coordinates ``missing`` by rows without zeros."""
        place = {j: k for k, j in enumerate(missing)}
        mass = [self.derivation.mass[j] for j in missing]
        rows = [{place[k]: terms for k, terms in row.items() if k in place} for row in mass]
        velocities = [c.v for c in self.reduced.coordinates]
        entries = [sp.Add(*terms) for row in rows for terms in row.values()]
        tape = Tape(entries, [*self.q, *self.constants, *velocities])
        inputs = [*start, *self.constants.values(), *([_ZERO] * len(velocities))]
        pending = iter(tape.run([(x, _ZERO, _ZERO) for x in inputs], 0).values)
        return [{k: next(pending) for k in row} for row in rows]

    # Consistency.

    def _length(self) -> mpf:
        values = [abs(v) for s, (v, _) in self.given[0].items() if not self._is_angle(s)]
        return max(values, default=mpf(1)) or mpf(1)

    def _is_angle(self, symbol: sp.Symbol) -> bool:
        number = self.number.get(symbol)
        return number is not None and self.reduced.coordinates[number].is_angle

    def _check(self, start: Sequence[mpf], velocities: Sequence[mpf]) -> mpf:
        """Refuse given Cartesian values that the state does not have; return the largest change."""
        worst = _ZERO
        inputs = [(x, _ZERO, _ZERO) for x in [*start, *self.constants.values()]]
        try:
            placed = self._tape(0).run(inputs, 0).values
            rows, drift = self._rates(self._tape(1), start)
        except DomainError:
            raise self._unreal() from None
        rates = [
            d + sum(r * velocities[j] for j, r in row.items())
            for row, d in zip(rows, drift, strict=True)
        ]
        speeds = [abs(v) for v, _ in self.given[1].values()]
        scales = (self._length(), max([*speeds, _ZERO]) or mpf(1))
        for order, values in ((0, placed), (1, rates)):
            for symbol, value in zip(self._cartesian(order), values, strict=True):
                stated, entry = self.given[order][symbol]
                miss = abs(value - stated)
                if miss > _TOLERANCE * scales[order]:
                    raise _contradiction(entry, value)
                if miss > _ROUNDING * scales[order]:
                    worst = max(worst, miss)
        return worst

    def _singular(self) -> InputError:
        return SingularError(
            Problem(
                "the constraints are singular at the initial configuration:"
                " they do not give velocities there",
                self.reduced.scene.initial[0].mark,
                hint="start from another configuration, or take other coordinates:",
                rule="singular",
            )
        )

    def _unreal(self) -> InputError:
        return NotRealError(
            Problem(
                "the initial configuration is outside the domain of the coordinates",
                self.reduced.scene.initial[0].mark,
                rule="not-real",
            )
        )


def _contradiction(entry: InitialValue, value: mpf) -> InputError:
    name = f"dot({entry.name})" if entry.order else entry.name
    return InconsistentStartError(
        Problem(
            f"the initial value of '{name}' violates the constraints:"
            f" given {entry.value.text}, they ask for {mpmath.nstr(value, 12)}",
            entry.mark,
            rule="initial-inconsistent",
        )
    )
