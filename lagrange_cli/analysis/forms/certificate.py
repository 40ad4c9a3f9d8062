"""Certificate of other forms of the equations, by comparison at random states.

A form is printed only if its expressions agree with the Lagrangian, differentiated automatically,
and with the certified M and f, in as many digits as the derivation was certified to.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from random import Random
from typing import TYPE_CHECKING, TypeAlias

import mpmath
import sympy as sp
from mpmath import mpf

from lagrange_cli.errors import InternalError, Problem
from lagrange_cli.mechanics.findings import Certificate
from lagrange_cli.mechanics.free_symbols import symbols_in
from lagrange_cli.mechanics.numerics.autodiff import DomainError, Tape, TaylorSeries
from lagrange_cli.mechanics.numerics.sampling import to_double, working_digits
from lagrange_cli.mechanics.sparse import entries

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations

State: TypeAlias = Mapping[sp.Symbol, mpf]
#: Two numbers that must be equal, and the size of the terms that they are sums of.
Pair: TypeAlias = tuple[mpf, mpf, mpf]

_ZERO, _ONE = mpf(0), mpf(1)

#: States of a comparison, fewer for large systems, and states drawn for them at most. A wrong
#: expression passes no state but by accident: the number bounds the time, not the assurance.
_POINTS, _LARGE_POINTS, _LARGE, _DRAWS = 8, 2, 24, 60

#: Relative width of draws around a state of the derivation's own certificate.
_WIDTH = mpf(1) / 4


class LagrangianSlopes:
    """The momenta, their rates and ∂L/∂q at a state, by automatic differentiation of L.

    Attributes
    ----------
    value
        L.
    momenta, rates
        ∂L/∂q̇ and its rate along the state's velocities and accelerations.
    slopes
        ∂L/∂q.
    """

    def __init__(self, equations: Equations, tape: Tape, state: State) -> None:
        series = [along(equations, state)[s] for s in lagrangian_symbols(equations)]
        run = tape.run(series, 1)
        gradient = run.moving_gradient()
        n = len(equations.system.coordinates)
        self.value = run.values[0]
        self.slopes = [x[0] for x in gradient[1 : 1 + n]]
        self.momenta = [x[0] for x in gradient[1 + n : 1 + 2 * n]]
        self.rates = [x[1] for x in gradient[1 + n : 1 + 2 * n]]


def lagrangian_symbols(equations: Equations) -> list[sp.Symbol]:
    """List the symbols of L: t, q, v, parameters and inputs."""
    coordinates = equations.system.coordinates
    constants = [
        *(p.symbol for p in equations.system.parameters),
        *(x.symbol for x in equations.system.external if x.symbol.is_Symbol),
    ]
    return [
        equations.system.t,
        *(c.q for c in coordinates),
        *(c.v for c in coordinates),
        *constants,
    ]


def along(equations: Equations, state: State) -> dict[sp.Symbol, TaylorSeries]:
    """Return value and rate of each symbol of L along the state's v and a."""
    series: dict[sp.Symbol, TaylorSeries] = {
        s: (state[s], _ZERO, _ZERO) for s in lagrangian_symbols(equations)
    }
    series[equations.system.t] = state[equations.system.t], _ONE, _ZERO
    for c in equations.system.coordinates:
        series[c.q] = state[c.q], state[c.v], _ZERO
        series[c.v] = state[c.v], state[c.a], _ZERO
    return series


class Evaluated:
    """Expressions whose operations are recorded once, for values at many states."""

    def __init__(self, expressions: Sequence[sp.Expr]) -> None:
        symbols = frozenset[sp.Symbol]().union(*map(symbols_in, expressions))
        self.symbols = sorted(symbols, key=str)
        self.tape = Tape(expressions, self.symbols)

    def at(self, state: State) -> list[mpf]:
        """Evaluate the expressions at a state."""
        return self.tape.run([(state[s], _ZERO, _ZERO) for s in self.symbols], 0).values

    def along(self, state: State, rates: State) -> list[TaylorSeries]:
        """Evaluate the expressions and their rates where symbols change at these rates."""
        series = [(state[s], rates.get(s, _ZERO), _ZERO) for s in self.symbols]
        return self.tape.run(series, 1).outputs


class Residuals:
    """M a − f − Σ λ·gradient of the certified equations."""

    def __init__(self, equations: Equations) -> None:
        pushes: list[list[sp.Expr]] = [[] for _ in equations.system.coordinates]
        for closure in equations.system.pushing:
            for j, entry in entries(closure.gradient).items():
                pushes[j].append(-closure.multiplier * entry)
        self.rows: list[list[sp.Expr]] = []
        for j, row in enumerate(equations.system.mass_matrix):
            inertia = [
                entry * equations.system.coordinates[k].a for k, entry in entries(row).items()
            ]
            forces = [-term for term in sp.Add.make_args(equations.system.forcing[j])]
            self.rows.append([*inertia, *forces, *pushes[j]])
        self.terms = Evaluated([term for row in self.rows for term in row])

    def at(self, state: State) -> Iterator[tuple[mpf, mpf]]:
        """Yield the residual of each equation at a state, with the size of its terms."""
        values = iter(self.terms.at(state))
        for row in self.rows:
            parts = [next(values) for _ in row]
            yield sum(parts, _ZERO), sum(map(abs, parts), _ZERO)


def certify_form(
    equations: Equations, form: str, compare: Callable[[State], Iterable[Pair]]
) -> Certificate:
    """Compare numbers that must be the same at random states.

    Parameters
    ----------
    form
        Its name, for the message of a mismatch.
    compare
        The pairs of a state.

    Raises
    ------
    InternalError
        They are not the same: a defect of the program.
    """
    digits = equations.derivation.certificate.digits
    n = len(equations.system.coordinates)
    wanted = _POINTS if n <= _LARGE else _LARGE_POINTS
    worst, seen = _ZERO, 0
    with mpmath.workdps(working_digits(digits)):
        tolerance = mpf(10) ** (5 - digits)
        for state in _states(equations):
            try:
                for ours, theirs, size in compare(state):
                    difference = abs(ours - theirs)
                    worst = max(worst, difference / size if size else difference)
            except (DomainError, ZeroDivisionError, OverflowError):
                continue
            if worst > tolerance:
                claim = f"{form} disagrees with the derived equations:"
                mismatch = f" mismatch {mpmath.nstr(worst, 3)} at {digits} digits"
                raise InternalError(Problem(claim + mismatch))
            seen += 1
            if seen == wanted:
                break
    if not seen:
        raise InternalError(Problem(f"{form} has no value at any state that was tried"))
    return Certificate(seen, digits, to_double(worst))


def _states(equations: Equations) -> Iterator[State]:
    """Yield a state of the derivation's certificate, then random ones near it, with multipliers."""
    if equations.derivation.sources is None:
        return
    first = equations.derivation.sources.state
    multipliers = [closure.multiplier for closure in equations.system.pushing]
    source = Random(1834)

    def noise() -> mpf:
        return _WIDTH * (2 * mpf(source.getrandbits(200)) / mpf(2) ** 200 - 1)

    for k in range(_DRAWS):
        state = {
            s: x * (1 + noise()) + (0 if s.is_positive else noise() * (not x)) if k else mpf(x)
            for s, x in first.items()
        }
        state.update((s, 4 * noise()) for s in multipliers)
        yield state
