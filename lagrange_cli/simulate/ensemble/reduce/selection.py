"""Selection of the columns and numbers that an ensemble stores of each member."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.plan import MemberMotion, Selection
from lagrange_cli.simulate.ensemble.reduce.reductions import reduced
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.requested_outputs import reduction_outputs
from lagrange_cli.simulate.request import Request


@dataclass(frozen=True)
class Selector:
    """Selects from the columns of members what an ensemble stores.

    Attributes
    ----------
    selection
        Columns and numbers to store.
    times
        Times of the samples, shape (samples,).
    accuracy
        Accuracy of coordinates and velocities; None if none is promised.
    state
        Names of the coordinates and velocities, 2n.
    """

    selection: Selection
    times: Array
    accuracy: float | None
    state: tuple[str, ...]

    @classmethod
    def for_model(cls, request: Request, model: Model, selection: Selection) -> Selector:
        """Return the selector of motions of a model that were requested in some way."""
        return cls(selection, np.asarray(request.times[:]), request.accuracy, model.state_names)

    def written(self, names: Iterable[str]) -> list[str]:
        """Return the names of the columns to store at every sample."""
        wanted = self.selection.columns
        return [name for name in self.without_reductions(names) if wanted is None or name in wanted]

    def without_reductions(self, names: Iterable[str]) -> list[str]:
        """Return the names of columns without those that are evaluated for reductions alone."""
        return [name for name in names if name not in self._for_reductions]

    def needed(self, names: Iterable[str]) -> list[str]:
        """Return the names of the columns that are needed at every sample."""
        if self.selection.functions:
            return list(names)
        written = self.written(names)
        return [name for name in names if name in written or name in self._for_reductions]

    @cached_property
    def _for_reductions(self) -> frozenset[str]:
        count = range(len(self.selection.reductions))
        n = len(self.state) // 2
        return frozenset(name for k in count for name in reduction_outputs(k, n))

    def numbers(
        self, columns: Mapping[str, Array], scales: Mapping[str, Array]
    ) -> dict[str, Array]:
        """Return the numbers to store of motions: name → values of shape (members,).

        Parameters
        ----------
        columns
            Shape (members, samples), NaN after the end of what is known.
        scales
            Name of a coordinate or velocity → scale, shape (members,).
        """
        numbers: dict[str, Array] = {}
        for k, reduction in enumerate(self.selection.reductions):
            value, *gradient = reduction_outputs(k, len(self.state) // 2)
            values = columns[value]
            allowed = self._allowed([columns[name] for name in gradient], values, scales)
            number, error = reduced(reduction.kind, self.times, values, allowed)
            numbers[f"reduced/{reduction.text}"] = number
            numbers[f"reduced_error/{reduction.text}"] = error
        names = self.without_reductions(columns)
        for name, function in self.selection.functions.items():
            members = range(len(next(iter(columns.values()))))
            rows = ({column: columns[column][k] for column in names} for k in members)
            numbers[f"reduced/{name}"] = np.array(
                [float(function(MemberMotion(self.times, row))) for row in rows]
            )
        return numbers

    def _allowed(
        self, gradient: Sequence[Array], values: Array, scales: Mapping[str, Array]
    ) -> Array:
        """Bound the errors that the accuracy of the state allows; NaN if none is promised."""
        if self.accuracy is None:
            return np.full(values.shape, np.nan)
        allowed = np.zeros(values.shape)
        for name, slope in zip(self.state, gradient, strict=True):
            allowed += np.abs(slope) * scales[name][:, None]
        return self.accuracy * allowed
