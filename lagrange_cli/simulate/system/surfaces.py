"""The switching surfaces of a model: code on either side of them, with parameters bound.

The code reads the weights of the sides behind the scene's parameters (see
:mod:`.model.switching_surfaces`).
"""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.integrators.events import TerminalEvents
from lagrange_cli.simulate.integrators.right_hand_side import (
    Rhs,
    SurfaceRates,
    Surfaces,
    SurfaceSides,
)
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.code import ModelCode
from lagrange_cli.simulate.system.rounding import parameter_values
from lagrange_cli.simulate.system.tables import Table


@dataclass(frozen=True)
class _Layout:
    """The place of the weights of sides among the parameters."""

    first: int
    count: int

    def weigh(self, parameters: Array, sides: SurfaceSides) -> None:
        """Write the weights of both sides of each surface."""
        weights = [(1 + s) / 2 for s in sides] + [(1 - s) / 2 for s in sides]
        parameters[self.first : self.first + 2 * self.count] = weights


class ModelSurfaces(Surfaces):
    """Switching surfaces of one right-hand side.

    Parameters
    ----------
    code
        The functions of the model.
    name
        Of the right-hand side on the sides.
    parameters
        All that it reads; weights begin at ``first``, whatever stands there.
    known
        The number of parameters that the other functions read.
    positional
        See :class:`.hybrid.surfaces.Surfaces`.
    switches
        See :class:`.right_hand_side.Surfaces`.
    continuous
        How many quantities do not jump where no impulse acts.
    """

    def __init__(
        self,
        code: ModelCode,
        name: str,
        parameters: Array,
        first: int,
        known: int,
        positional: tuple[bool, ...],
        switches: tuple[int, ...],
        continuous: int,
        coordinates: int,
    ) -> None:
        count = len(positional)
        self.positional, self.switches = positional, switches
        self._kinks = count - len(switches)
        self._code, self._name, self._parameters = code, name, np.array(parameters)
        self._layout, self._known, self._n = _Layout(first, count), known, coordinates
        self._sides: dict[SurfaceSides, Rhs] = {}
        self._change: Callable[[Rhs], Rhs] | None = None
        self._side_parameters = self._parameters[:known].copy()
        self._rate_parameters = np.concatenate([self._side_parameters, np.zeros(coordinates)])
        self._values = code.table("surface_values", 2 * count, self._side_parameters)
        self._rates = code.table("surface_rates", 3 * count, self._rate_parameters)
        self._continuous = code.table("continuous", continuous, self._side_parameters)

    def _weighed(self, parameters: Array, sides: SurfaceSides) -> Array:
        weighed = parameters.copy()
        self._layout.weigh(weighed, sides)
        return weighed

    def side(self, sides: SurfaceSides) -> Rhs:
        if sides not in self._sides:
            parameters = self._weighed(self._parameters, sides)
            side = self._code.side(self._name, parameters)
            self._sides[sides] = side if self._change is None else self._change(side)
        return self._sides[sides]

    def through(self, change: Callable[[Rhs], Rhs]) -> ModelSurfaces:
        surfaces = copy.copy(self)
        surfaces._sides, surfaces._change = {}, change
        return surfaces

    def values(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        values, sizes = self._all_values(t, y, sides)
        # No motion is on the surface of a switch: behind it another one holds.
        values[self._kinks :] = sizes[self._kinks :] = 1.0
        return values, sizes

    def until_switched(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        values, sizes = self._all_values(t, y, sides)
        return values[self._kinks :], sizes[self._kinks :]

    def _all_values(self, t: float, y: Array, sides: SurfaceSides) -> tuple[Array, Array]:
        self._layout.weigh(self._side_parameters, sides)
        values, sizes = _row(self._values, t, y).reshape(2, -1)
        return values, sizes

    def rates(self, t: float, y: Array, sides: SurfaceSides, slope: Array) -> SurfaceRates:
        self._layout.weigh(self._rate_parameters, sides)
        self._rate_parameters[self._known :] = slope[self._n : 2 * self._n]
        first, second, sizes = _row(self._rates, t, y).reshape(3, -1)
        return SurfaceRates(first, second, sizes)

    def continuous(self, t: float, y: Array, sides: SurfaceSides) -> Array:
        self._layout.weigh(self._side_parameters, sides)
        return _row(self._continuous, t, y)

    def terminal_events(
        self,
        sides: SurfaceSides,
        signs: tuple[float, ...],
        noise: tuple[float, ...],
        other_events: TerminalEvents | None,
    ) -> TerminalEvents:
        parameters = self._weighed(self._side_parameters, sides)
        table = self._code.table("surfaces", len(sides), parameters)
        if other_events is None:
            native = self._code.events("surfaces", parameters)
            return TerminalEvents(lambda t, y: _row(table, t, y), signs, noise, native)
        others = other_events.values
        reach = (*other_events.reach, *(0.0 for _ in signs)) if other_events.reach else ()
        signs, noise = (*other_events.signs, *signs), (*other_events.noise, *noise)
        return TerminalEvents(
            lambda t, y: np.concatenate([others(t, y), _row(table, t, y)]),
            signs,
            noise,
            self._code.events("events_and_surfaces", parameters),
            reach,
        )


def _row(table: Table, t: float, y: Array) -> Array:
    row: Array = table(np.array([t]), np.asarray(y, dtype=float)[None, :])[0]
    return row


#: Makes the surfaces of a right-hand side: with inputs off by their rounding in a pattern not 0,
#: ``contact_`` if it is one with contacts, and the parameters that it reads.
MakeSurfaces: TypeAlias = Callable[[int, str, Array], ModelSurfaces]


def surfaces_maker(model: Model, code: Callable[[int], ModelCode]) -> MakeSurfaces | None:
    """Make the maker of surfaces of right-hand sides; None if the model has none."""
    if not model.surfaces:
        return None
    switches = tuple(model.layout.place("z", k) for k in model.switches)

    def surfaces(pattern: int, kind: str, parameters: Array) -> ModelSurfaces:
        name = f"sided_{kind}{'disturbed' if pattern else 'rhs'}"
        first, known = len(model.parameters), len(parameter_values(model))
        places = first, known, model.surfaces, switches, model.continuous, len(model.coordinates)
        return ModelSurfaces(code(pattern), name, parameters, *places)

    return surfaces
