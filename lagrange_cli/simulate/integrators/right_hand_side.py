"""Right-hand sides y' = f(t, y), and the structure that methods may use besides their values.

A plain function of t and y is a right-hand side. A :class:`StructuredRhs` has more: a projection
onto constraints, inputs that change from piece to piece, switching surfaces, expressions.

Within a piece of its inputs a right-hand side is smooth; at the end it may jump, or have a kink. So
steps end with each piece: the order of a method, and its estimate of errors, hold as for any smooth
problem. The argument of ``abs``, ``sign``, ``min`` or ``max`` vanishes on a switching surface in
the space of states, and the function has a kink or a jump there. Beside it the equations are
smooth, and go on past it.
"""

from __future__ import annotations

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any, Self, TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import TerminalEvents

#: A plain right-hand side, or one with structure.
Rhs: TypeAlias = Callable[[float, Array], Array]

#: (t, y) → the state moved onto the constraints, a fresh array; NaN where that fails.
Projection: TypeAlias = Callable[[float, Array], Array]

#: (t, q, q′) → the change that leads q′ back to the constraints along their gradients at q.
Shift: TypeAlias = Callable[[float, Array, Array], Array]

#: (functions, t, y, p, u) → slopes: a right-hand side run over objects. The functions are those
#: of :mod:`math` by name, and ``solve``, of a matrix, right sides, and the number of rows that
#: are the mass matrix's; the text calls no others.
Tracer: TypeAlias = Callable[
    [Mapping[str, Callable[..., Any]], Any, Sequence[Any], Sequence[Any], Sequence[Any]],
    Sequence[Any],
]

#: On which side of each surface: 1, −1, or the part between that keeps the motion on it.
SurfaceSides: TypeAlias = tuple[float, ...]

#: A surface is met where its function is below this part of the terms that it is the sum of.
ON_SURFACE = 1e-14

#: Units in the last place within which times are the same.
_SAME_TIME_ULPS = 16


@dataclass(frozen=True)
class Expressions:
    """A right-hand side as expressions, for methods that differentiate it.

    Its text is run over objects in place of numbers: what it does with them is the expression.

    Attributes
    ----------
    trace
        Runs it over objects.
    parameters
        Values of its parameters, shape (parameters,).
    inputs
        Values of its inputs, shape (inputs,).
    """

    trace: Tracer
    parameters: Array
    inputs: Array


@dataclass(frozen=True)
class InputPieces:
    """Numbers ``rows[k]``, which hold from ``starts[k]`` (ascending) to the next start.

    The first row holds before the first start too; at a start the new row does.
    ``rows`` has shape (len(starts), width). The values of ``functions`` of time follow the numbers
    of a row; they are smooth, and evaluated by Python at every time.
    """

    starts: Array
    rows: Array
    functions: tuple[Callable[[float], float], ...] = ()

    def at(self, t: float) -> int:
        """Return the number of the piece that holds at a time, and on from there."""
        return max(int(np.searchsorted(self.starts, t, side="right")) - 1, 0)

    def values(self, t: float) -> list[float]:
        """Return all numbers at a time."""
        return [*self.rows[self.at(t)].tolist(), *(function(t) for function in self.functions)]

    def first(self, t: float) -> int:
        """Return the piece in which a run begins: not one that ends within the rounding of t.

        A start may be found, as where a contact closes, and be meant to be its end.
        """
        return self.at(t + _SAME_TIME_ULPS * math.ulp(t))

    def end(self, piece: int) -> float:
        """Return the time at which a piece ends, infinite for the last."""
        return float(self.starts[piece + 1]) if piece + 1 < len(self.starts) else math.inf


@dataclass(frozen=True)
class Sampling:
    """Numbers of a state that change at samples alone: at the start, and at multiples of a period.

    Attributes
    ----------
    periods
        Time between samples of each controller, exact.
    places
        The numbers of y that each of them sets.
    values
        Next values of these, one controller's after the other's, over the state before a sample.
    """

    periods: tuple[Fraction, ...]
    places: tuple[tuple[int, ...], ...]
    values: Rhs

    def numbers(self, t: float) -> list[int]:
        """Return the number of the first multiple of each period behind a time."""
        late = Fraction(t) + Fraction(_SAME_TIME_ULPS * math.ulp(t))
        return [math.floor(late / period) + 1 for period in self.periods]

    def due(self, numbers: Sequence[int]) -> tuple[float, list[int]]:
        """Return the time of the first of some multiples, and whose samples are then."""
        times = [k * period for k, period in zip(numbers, self.periods, strict=True)]
        first = min(times)
        return float(first), [c for c, time in enumerate(times) if time == first]

    def sampled(self, t: float, y: Array, controllers: Sequence[int]) -> Array:
        """Return the state behind a sample of some controllers."""
        after, values, place = np.array(y, dtype=float), self.values(t, y), 0
        for c, places in enumerate(self.places):
            if c in controllers:
                after[list(places)] = values[place : place + len(places)]
            place += len(places)
        return after

    def started(self, t: float, y: Array) -> Array:
        """Return the state at the start of a run, where all controllers sample."""
        return self.sampled(t, y, range(len(self.places)))


class StructuredRhs(ABC):
    """A right-hand side with the structure that methods may use besides its values.

    Attributes
    ----------
    project
        Moves a state onto the constraints; None without constraints.
    shift
        Leads positions back along gradients elsewhere; None if that is not available.
    pieces
        Numbers of its inputs, piece by piece; None if it has no inputs, or those of one piece.
    surfaces
        Its switching surfaces; None if it is smooth.
    states
        Number of states of first order behind the velocities.
    sampling
        What changes at samples; None if nothing does.
    """

    project: Projection | None = None
    shift: Shift | None = None
    pieces: InputPieces | None = None
    surfaces: Surfaces | None = None
    states: int = 0
    sampling: Sampling | None = None

    @abstractmethod
    def __call__(self, t: float, y: Array) -> Array:
        """Evaluate y', shape (2n,); NaN where it does not exist."""

    @property
    def expressions(self) -> Expressions | None:
        """Its tracer and numbers; None if it has values alone."""
        return None

    def in_piece(self, piece: int) -> Rhs:
        """Return the right-hand side with the inputs of one piece, at any time."""
        return self

    def with_surfaces(self, surfaces: Surfaces) -> Self:
        """Return the right-hand side with switching surfaces."""
        return self._copied_with("surfaces", surfaces)

    def with_sampling(self, sampling: Sampling | None) -> Self:
        """Return the right-hand side with numbers that change at samples, or without any."""
        return self._copied_with("sampling", sampling)

    def with_states(self, states: int) -> Self:
        """Return the right-hand side of a system with states of first order."""
        return self._copied_with("states", states) if states else self

    def _copied_with(self, name: str, value: object) -> Self:
        changed = copy.copy(self)
        # Some kinds are frozen.
        object.__setattr__(changed, name, value)
        return changed


@dataclass(frozen=True)
class FunctionRhs(StructuredRhs):
    """A plain function as a right-hand side, which states may obey constraints beside.

    Attributes
    ----------
    function
        The function of t and y.
    project, shift
        As those of any :class:`StructuredRhs`.
    """

    function: Rhs
    project: Projection | None = None
    shift: Shift | None = None

    def __call__(self, t: float, y: Array) -> Array:
        return self.function(t, y)


@dataclass(frozen=True)
class PiecewiseRhs(StructuredRhs):
    """A right-hand side whose inputs are other numbers in each piece.

    Attributes
    ----------
    pieces
        Numbers of the pieces.
    within
        Makes the right-hand side for the numbers of one piece.
    project
        Moves a state onto the constraints; None without constraints.
    """

    pieces: InputPieces = field()  # not None as by default
    within: Callable[[Array], Rhs]
    project: Projection | None = None

    def __call__(self, t: float, y: Array) -> Array:
        return self.in_piece(self.pieces.at(t))(t, y)

    def in_piece(self, piece: int) -> Rhs:
        return self.within(self.pieces.rows[piece])


def structured(rhs: Rhs) -> StructuredRhs:
    """Return a right-hand side with its structure; a plain function has none."""
    return rhs if isinstance(rhs, StructuredRhs) else FunctionRhs(rhs)


@dataclass(frozen=True)
class SurfaceRates:
    """Rates of the functions of the surfaces.

    Attributes
    ----------
    first, second
        First rates, and second ones of surfaces that do not hang on velocities, shape (S,).
    sizes
        Magnitudes that the first rates are sums of, shape (S,).
    """

    first: Array
    second: Array
    sizes: Array

    def leading(self, k: int, positional: bool) -> float:
        """Return the first rate of surface k that is not zero but for rounding, else 0."""
        if abs(self.first[k]) > ON_SURFACE * self.sizes[k]:
            return float(self.first[k])
        return float(self.second[k]) if positional else 0.0


class Surfaces(ABC):
    """The switching surfaces of a right-hand side.

    Attributes
    ----------
    positional
        Of each surface whether it hangs on positions and time alone.
    switches
        Places in y of the states with two values. The last surfaces are where these change; they
        have no sides, and what :meth:`values` gives of them is 1.
    """

    positional: tuple[bool, ...]
    switches: tuple[int, ...] = ()

    @abstractmethod
    def side(self, sides: SurfaceSides) -> Rhs:
        """Return the smooth right-hand side on these sides."""

    @abstractmethod
    def through(self, change: Callable[[Rhs], Rhs]) -> Surfaces:
        """Return surfaces with every right-hand side changed."""

    @abstractmethod
    def values(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        """Evaluate the functions of the surfaces, and the magnitudes of their sums, both (S,)."""

    def until_switched(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        """Evaluate what falls through zero where each switch changes, and the magnitudes of these
        sums, both shape (switches,)."""
        return np.empty(0), np.empty(0)

    @abstractmethod
    def rates(self, t: float, y: Array, sides: SurfaceSides, slope: Array) -> SurfaceRates:
        """Evaluate their rates, with ``slope`` the slope of y, shape (2n,)."""

    @abstractmethod
    def continuous(self, t: float, y: Array, sides: SurfaceSides) -> Array:
        """Evaluate what jumps only with an impulse: the energy function on these sides, momenta."""

    @abstractmethod
    def terminal_events(
        self,
        sides: SurfaceSides,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        other_events: TerminalEvents | None,
    ) -> TerminalEvents:
        """Return ``other_events``, then those at which the motion leaves these sides."""

    def placed(
        self, t: float, y: Array, sides: SurfaceSides, met: Sequence[int] = ()
    ) -> tuple[SurfaceSides, tuple[int, ...]]:
        """Return the sides of surfaces on which a state is not, and the numbers of the others.

        Surfaces that are ``met`` count as others. A surface may depend on the sides of those
        before it.
        """
        on = set(met)
        for _ in range(len(sides) + 1):
            values, sizes = self.values(t, y, sides)
            on = {*met, *map(int, np.flatnonzero(np.abs(values) <= ON_SURFACE * sizes))}
            clear = [k for k in range(len(sides)) if k not in on and values[k] != 0]
            placed = with_sides(sides, {k: float(np.sign(values[k])) for k in clear})
            if placed == sides:
                break
            sides = placed
        return sides, tuple(sorted(on))

    def around(self, t: float, y: Array) -> SurfaceSides:
        """Return the sides of a state; positive ones for surfaces on which it is."""
        return self.placed(t, y, (1.0,) * len(self.positional))[0]


def with_sides(sides: SurfaceSides, changed: Mapping[int, float]) -> SurfaceSides:
    """Return the sides with those of some surfaces replaced."""
    return tuple(changed.get(k, side) for k, side in enumerate(sides))
