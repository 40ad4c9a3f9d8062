"""What is kept of each member beside its figures: columns, its end, numbers of its motion."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from uuid import uuid4

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.reduce.reductions import reduced
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.reductions import Reduction, reduction_outputs
from lagrange_cli.simulate.request import Request


@dataclass(frozen=True)
class MemberMotion:
    """A motion of a member, for functions of it.

    Attributes
    ----------
    t
        Times of the samples, shape (samples,).
    columns
        Name → values, shape (samples,); NaN after the end of what is known.
    """

    t: Array
    columns: Mapping[str, Array]


#: A number of a motion.
MotionFunction = Callable[[MemberMotion], float]


@dataclass(frozen=True)
class Kept:
    """What is kept of each member beside its figures.

    Attributes
    ----------
    columns
        Names of the columns that are kept, None for all that there are.
    final
        All columns are kept at the last sample.
    reductions
        Numbers of the motion that are kept, each with an estimate of its error.
    functions
        Further numbers of the motion by name, without an estimate.
    """

    columns: tuple[str, ...] | None = None
    final: bool = False
    reductions: tuple[Reduction, ...] = ()
    functions: Mapping[str, MotionFunction] = field(default_factory=dict)

    @property
    def key(self) -> object:
        """Plain values that tell it from others; with functions it is like no other."""
        texts = [reduction.text for reduction in self.reductions]
        return self.columns, self.final, texts, self._token

    @cached_property
    def _token(self) -> str | None:
        """Return what no other has: that two functions of one name are the same cannot be told."""
        return uuid4().hex if self.functions else None


@dataclass(frozen=True)
class Keeper:
    """Picks what is kept of members' columns.

    Attributes
    ----------
    kept
        What that is.
    times
        Of the samples, shape (samples,).
    accuracy
        What is promised of coordinates and velocities; None if nothing is.
    state
        Names of the coordinates and velocities, 2n.
    """

    kept: Kept
    times: Array
    accuracy: float | None
    state: tuple[str, ...]

    @classmethod
    def of(cls, request: Request, model: Model, kept: Kept) -> Keeper:
        """Return what picks ``kept`` of motions of a model, as they were asked for."""
        return cls(kept, np.asarray(request.times[:]), request.accuracy, model.state_names)

    def written(self, names: Iterable[str]) -> list[str]:
        """Return the names of columns that are kept at every sample."""
        wanted = self.kept.columns
        return [name for name in self.own(names) if wanted is None or name in wanted]

    def own(self, names: Iterable[str]) -> list[str]:
        """Return the names of columns, without what is evaluated for reductions alone."""
        return [name for name in names if name not in self._for_reductions]

    def needed(self, names: Iterable[str]) -> list[str]:
        """Return the names of columns that something is kept of, but for the end."""
        if self.kept.functions:
            return list(names)
        written = self.written(names)
        return [name for name in names if name in written or name in self._for_reductions]

    @cached_property
    def _for_reductions(self) -> frozenset[str]:
        count = range(len(self.kept.reductions))
        n = len(self.state) // 2
        return frozenset(name for k in count for name in reduction_outputs(k, n))

    def numbers(
        self, columns: Mapping[str, Array], scales: Mapping[str, Array]
    ) -> dict[str, Array]:
        """Return the kept numbers of motions: name → values of shape (members,).

        Parameters
        ----------
        columns
            Shape (members, samples), NaN after the end of what is known.
        scales
            Of coordinates and velocities, shape (members,).
        """
        found: dict[str, Array] = {}
        for k, reduction in enumerate(self.kept.reductions):
            value, *gradient = reduction_outputs(k, len(self.state) // 2)
            values = columns[value]
            allowed = self._allowed([columns[name] for name in gradient], values, scales)
            number, error = reduced(reduction.kind, self.times, values, allowed)
            found[f"reduced/{reduction.text}"] = number
            found[f"reduced_error/{reduction.text}"] = error
        own = self.own(columns)
        for name, function in self.kept.functions.items():
            members = range(len(next(iter(columns.values()))))
            rows = ({column: columns[column][k] for column in own} for k in members)
            found[f"reduced/{name}"] = np.array(
                [float(function(MemberMotion(self.times, row))) for row in rows]
            )
        return found

    def _allowed(
        self, gradient: Sequence[Array], values: Array, scales: Mapping[str, Array]
    ) -> Array:
        """Return what the accuracy of the state leaves open of values, NaN if none is promised."""
        if self.accuracy is None:
            return np.full(values.shape, np.nan)
        allowed = np.zeros(values.shape)
        for name, slope in zip(self.state, gradient, strict=True):
            allowed += np.abs(slope) * scales[name][:, None]
        return self.accuracy * allowed
