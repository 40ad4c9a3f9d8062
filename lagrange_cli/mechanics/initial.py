"""The initial state: coordinates and velocities from what the scene gives.

Values may be given in coordinates or in Cartesian names. What is given stays;
missing positions follow from given Cartesian values, missing velocities are
the smallest in the kinetic-energy metric that the given ones allow.
"""

from __future__ import annotations

from collections.abc import Sequence

import mpmath
import numpy as np
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.mechanics.derivation import Derivation
from lagrange_cli.mechanics.equations import InitialState
from lagrange_cli.mechanics.tape import DomainError, Tape
from lagrange_cli.scene.model import InitialValue

__all__ = ["initial_state"]

#: Largest violation, relative to the scene's length, that is projected instead of refused.
_TOLERANCE = mpf(10) ** -9

_DIGITS = 34
_NEWTON_STEPS = 60
_ZERO = mpf(0)


def initial_state(derivation: Derivation) -> InitialState | None:
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
    with mpmath.workdps(_DIGITS):
        return _Initial(derivation).solve()


class _Initial:
    def __init__(self, derivation: Derivation) -> None:
        self.derivation = derivation
        self.reduced = derivation.reduced
        names = self.reduced.names
        self.q = [c.q for c in self.reduced.coordinates]
        self.constants: dict[sp.Symbol, mpf] = {
            names.parameters[n]: mpf(x.evalf(_DIGITS)) for n, x in self.reduced.values.exact.items()
        }
        self.constants[names.t] = self.reduced.reference[names.t]
        self.given: dict[int, dict[sp.Symbol, tuple[mpf, InitialValue]]] = {0: {}, 1: {}}
        for entry in self.reduced.scene.initial:
            self._take(entry)

    def _take(self, entry: InitialValue) -> None:
        symbol = self.reduced.names.lookup(entry.name)
        known = symbol in self.reduced.resolved or symbol in self.q
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
        self.given[entry.order][symbol] = (mpf(value.evalf(_DIGITS)), entry)

    def solve(self) -> InitialState:
        start = self._positions()
        tape = self._tape(1)
        velocities = self._velocities(tape, start)
        projected = self._check(start, velocities)
        return InitialState(
            tuple(float(x) for x in start), tuple(float(x) for x in velocities), float(projected)
        )

    def _cartesian(self, order: int) -> list[sp.Symbol]:
        """Cartesian names with a given value that are not coordinates themselves."""
        return [s for s in self.given[order] if s not in self.q]

    def _tape(self, order: int) -> Tape:
        expressions = [self.reduced.resolved[s] for s in self._cartesian(order)]
        return Tape(expressions, [*self.q, *self.constants])

    # Positions.

    def _positions(self) -> list[mpf]:
        known = {s: value for s, (value, _) in self.given[0].items() if s in self.q}
        missing = [j for j, q in enumerate(self.q) if q not in known]
        guess = [known.get(q, self.reduced.reference.get(q, mpf("0.1"))) for q in self.q]
        if missing:
            guess = self._newton(guess, missing)
        return guess

    def _newton(self, guess: list[mpf], missing: Sequence[int]) -> list[mpf]:
        """Gauss–Newton for the missing coordinates from given Cartesian values."""
        symbols = self._cartesian(0)
        tape = self._tape(0)
        target = [self.given[0][s][0] for s in symbols]
        for start in self._starts(guess, missing):
            found = self._gauss_newton(tape, start, missing, target)
            if found is not None:
                return found
        raise self._undetermined(missing)

    def _starts(self, guess: list[mpf], missing: Sequence[int]) -> list[list[mpf]]:
        """The guess and others around the circle or the origin."""
        starts = [list(guess)]
        scale = max((abs(v) for v, _ in self.given[0].values()), default=mpf(1)) or mpf(1)
        for k in range(1, 24):
            start = list(guess)
            for i, j in enumerate(missing):
                angle = self.reduced.coordinates[j].is_angle
                step = mpmath.frac(k * mpmath.sqrt(2 + i)) - mpf(1) / 2
                start[j] = step * (2 * mpmath.pi if angle else 2 * scale)
            starts.append(start)
        return starts

    def _gauss_newton(
        self, tape: Tape, start: list[mpf], missing: Sequence[int], target: Sequence[mpf]
    ) -> list[mpf] | None:
        q = list(start)
        constants = list(self.constants.values())
        for _ in range(_NEWTON_STEPS):
            try:
                run = tape.run([(x, _ZERO, _ZERO) for x in [*q, *constants]], 0)
            except DomainError:
                return None
            rows = [run.gradient({k: (mpf(1), _ZERO, _ZERO)}) for k in range(len(target))]
            matrix = mpmath.matrix([[row[j][0] for j in missing] for row in rows])
            if len(target) < len(missing) or _rank(matrix) < len(missing):
                return None
            residual = mpmath.matrix([x - y for x, y in zip(target, run.values, strict=True)])
            step = mpmath.lu_solve(matrix, residual)
            for i, j in enumerate(missing):
                q[j] += step[i]
            size = max(abs(s) for s in step)
            if size <= mpf(10) ** (6 - _DIGITS) * max(1, *(abs(x) for x in q)):
                final = tape.run([(x, _ZERO, _ZERO) for x in [*q, *constants]], 0).values
                misses = [abs(x - y) for x, y in zip(target, final, strict=True)]
                return q if max(misses) <= _TOLERANCE * self._length() else None
        return None

    def _undetermined(self, missing: Sequence[int]) -> InputError:
        names = [self.reduced.coordinates[j].name for j in missing]
        listed = ", ".join(f"'{n}'" for n in names)
        return InputError(
            Problem(
                f"the initial values do not determine {listed}",
                self.reduced.scene.initial[0].mark,
                hint="\n".join(f"add  {n}: ...  to 'initial'" for n in names),
                rule="initial-missing",
            )
        )

    # Velocities.

    def _velocities(self, tape: Tape, start: Sequence[mpf]) -> list[mpf]:
        known = {s: value for s, (value, _) in self.given[1].items() if s in self.q}
        velocities = [known.get(q, _ZERO) for q in self.q]
        missing = [j for j, q in enumerate(self.q) if q not in known]
        symbols = self._cartesian(1)
        if not symbols or not missing:
            return velocities
        rows, drift = self._rates(tape, start)
        target = [
            self.given[1][s][0] - d - sum(r * v for r, v in zip(row, velocities, strict=True))
            for s, row, d in zip(symbols, rows, drift, strict=True)
        ]
        matrix = [[row[j] for j in missing] for row in rows]
        metric = self._mass_matrix(start, missing)
        solved = _smallest(matrix, target, metric)
        for j, value in zip(missing, solved, strict=True):
            velocities[j] = value
        return velocities

    def _rates(self, tape: Tape, start: Sequence[mpf]) -> tuple[list[list[mpf]], list[mpf]]:
        """∂c/∂q and ∂c/∂t of the Cartesian names with a given velocity."""
        inputs = [(x, _ZERO, _ZERO) for x in [*start, *self.constants.values()]]
        run = tape.run(inputs, 0)
        clock = len(self.q) + list(self.constants).index(self.reduced.names.t)
        gradients = [run.gradient({k: (mpf(1), _ZERO, _ZERO)}) for k in range(len(tape.outputs))]
        rows = [[g[j][0] for j in range(len(self.q))] for g in gradients]
        return rows, [g[clock][0] for g in gradients]

    def _mass_matrix(self, start: Sequence[mpf], rows: Sequence[int]) -> mpmath.matrix:
        entries = [sp.Add(*self.derivation.mass[j][k]) for j in rows for k in rows]
        velocities = [c.v for c in self.reduced.coordinates]
        tape = Tape(entries, [*self.q, *self.constants, *velocities])
        inputs = [*start, *self.constants.values(), *([_ZERO] * len(velocities))]
        values = tape.run([(x, _ZERO, _ZERO) for x in inputs], 0).values
        n = len(rows)
        return mpmath.matrix([values[i * n : (i + 1) * n] for i in range(n)])

    # Consistency.

    def _length(self) -> mpf:
        values = [abs(v) for s, (v, _) in self.given[0].items() if not self._is_angle(s)]
        return max(values, default=mpf(1)) or mpf(1)

    def _is_angle(self, symbol: sp.Symbol) -> bool:
        return any(c.q == symbol and c.is_angle for c in self.reduced.coordinates)

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
            d + sum(r * v for r, v in zip(row, velocities, strict=True))
            for row, d in zip(rows, drift, strict=True)
        ]
        speeds = [abs(v) for v, _ in self.given[1].values()]
        scales = (self._length(), max([*speeds, _ZERO]) or mpf(1))
        for order, values in ((0, placed), (1, rates)):
            for symbol, value in zip(self._cartesian(order), values, strict=True):
                given, entry = self.given[order][symbol]
                miss = abs(value - given)
                if miss > _TOLERANCE * scales[order]:
                    raise _contradiction(entry, value)
                worst = max(worst, miss)
        return worst

    def _unreal(self) -> InputError:
        return InputError(
            Problem(
                "the initial configuration is outside the domain of the coordinates",
                self.reduced.scene.initial[0].mark,
                rule="not-real",
            )
        )


def _contradiction(entry: InitialValue, value: mpf) -> InputError:
    name = f"dot({entry.name})" if entry.order else entry.name
    return InputError(
        Problem(
            f"the initial value of '{name}' violates the constraints:"
            f" given {entry.value.text}, they ask for {mpmath.nstr(value, 12)}",
            entry.mark,
            rule="initial-inconsistent",
        )
    )


def _rank(matrix: mpmath.matrix) -> int:
    array = np.array(matrix.tolist(), dtype=float)
    return int(np.linalg.matrix_rank(array, rtol=1e-12)) if array.size else 0


def _smallest(
    matrix: Sequence[Sequence[mpf]], target: Sequence[mpf], metric: mpmath.matrix
) -> list[mpf]:
    """x of least xᵀ·metric·x with matrix·x = target, dependent rows left out."""
    kept: list[int] = []
    for k in range(len(matrix)):
        trial = mpmath.matrix([list(matrix[i]) for i in [*kept, k]])
        if _rank(trial) == len(kept) + 1:
            kept.append(k)
    if not kept:
        return [_ZERO] * len(matrix[0])
    rows = mpmath.matrix([list(matrix[k]) for k in kept])
    right = mpmath.matrix([target[k] for k in kept])
    weighted = mpmath.lu_solve(metric, mpmath.eye(metric.rows)) * rows.T
    return list(weighted * mpmath.lu_solve(rows * weighted, right))
