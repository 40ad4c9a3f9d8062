"""Selection of the columns and numbers that an ensemble stores of each member."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.plan import MemberMotion, Selection
from lagrange_cli.simulate.ensemble.reduce.defects import series_along
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Motions, Piece
from lagrange_cli.simulate.ensemble.reduce.enclosures import Expression
from lagrange_cli.simulate.ensemble.reduce.reductions import REDUCTIONS, Reduced
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.model.requested_outputs import reduction_outputs
from lagrange_cli.simulate.request import Request
from lagrange_cli.simulate.results.trajectory import Trajectory
from lagrange_cli.simulate.system.rounding import parameter_values

#: Panels of motions that are looked at at a time.
_MOST_PANELS = 50_000

#: Error that polynomials between samples may leave out, over the accuracy, and the parts into which
#: the time between two samples is divided where they leave out more.
_LEFT_OUT, _FINER = 0.1, 4

#: Runs with closer samples, and most samples of these.
_MOST_RUNS, _MOST_SAMPLES = 8, 100_000


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
    model
        Model of one member.
    """

    selection: Selection
    times: Array
    accuracy: float | None
    state: tuple[str, ...]
    model: Model

    @classmethod
    def for_model(cls, request: Request, model: Model, selection: Selection) -> Selector:
        """Return the selector of motions of a model that were requested in some way."""
        times = np.asarray(request.times[:])
        return cls(selection, times, request.accuracy, model.state_names, model)

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
        return self.written(names)

    @cached_property
    def _for_reductions(self) -> frozenset[str]:
        count = range(len(self.selection.reductions))
        size = len(self.state)
        return frozenset(name for k in count for name in reduction_outputs(k, size))

    def numbers(self, columns: Mapping[str, Array]) -> dict[str, Array]:
        """Return the numbers that functions make of motions: name → values of shape (members,).

        Parameters
        ----------
        columns
            Shape (members, samples), NaN after the end of what is known.
        """
        numbers: dict[str, Array] = {}
        names = self.without_reductions(columns)
        for name, function in self.selection.functions.items():
            members = range(len(next(iter(columns.values()))))
            rows = ({column: columns[column][k] for column in names} for k in members)
            numbers[f"reduced/{name}"] = np.array(
                [float(function(MemberMotion(self.times, row))) for row in rows]
            )
        return numbers

    def reduced(self, motions: Motions | None, *, ended: bool = True) -> dict[str, Array]:
        """Return the reductions of motions, with bounds of their errors, shapes (members,).

        ``motions`` is None where nothing is known. ``ended``: the motions reach the last sample;
        of others only first times are known.
        """
        reductions = self.selection.reductions
        if motions is None or not reductions:
            return self._unknown()
        results: dict[str, list[Reduced]] = {r.text: [] for r in reductions}
        for _, some in motions.in_turn(_MOST_PANELS):
            along = series_along(self.model, some)
            for k, reduction in enumerate(reductions):
                value, *gradient = reduction_outputs(k, len(self.state))
                result = np.full(len(some), np.nan), np.full(len(some), np.inf)
                if along is not None and (ended or reduction.kind == "first"):
                    result = REDUCTIONS[reduction.kind](Expression(along, value, tuple(gradient)))
                if not ended:
                    # The condition may hold after the end of what is known.
                    result[1][np.isnan(result[0])] = np.inf
                results[reduction.text].append(result)
        numbers: dict[str, Array] = {}
        for text, parts in results.items():
            number, error = (np.concatenate(each) for each in zip(*parts, strict=True))
            promised = self.accuracy is not None
            numbers[f"reduced/{text}"] = number
            numbers[f"reduced_error/{text}"] = error if promised else np.full_like(error, np.nan)
        return numbers

    def motion(self, model: Model, result: Trajectory) -> Motions | None:
        """Return a motion for its reductions; None if there are none, or it is not known."""
        if not self.selection.reductions or len(result.t) < 2:
            return None
        return motion_of(model, result)

    def refined_motion(
        self,
        model: Model,
        result: Trajectory,
        run: Callable[[tuple[float, ...]], Trajectory],
    ) -> Motions | None:
        """Return a motion with more samples where polynomials between them leave out too much.

        ``run`` runs it again with other sample times.
        """
        motion = self.motion(model, result)
        for _ in range(_MOST_RUNS):
            times = None if motion is None else finer_times(model, motion, result)
            if times is None or len(times) > _MOST_SAMPLES:
                break
            result = run(tuple(times.tolist()))
            motion = self.motion(model, result)
        return motion

    def _unknown(self) -> dict[str, Array]:
        """Return the reductions of a motion of which nothing is known."""
        texts = [reduction.text for reduction in self.selection.reductions]
        errors = np.array([np.nan if self.accuracy is None else np.inf])
        numbers = {f"reduced/{text}": np.array([np.nan]) for text in texts}
        return numbers | {f"reduced_error/{text}": errors for text in texts}


def motion_of(model: Model, result: Trajectory) -> Motions | None:
    """Return a motion in pieces between its events; None where other coordinates took over."""
    if not result.columns.keys() >= set(model.state_names):
        return None
    states = np.stack([result.columns[name] for name in model.state_names], axis=1)
    pieces, times = list[Piece](), result.t
    head_times, head_states = times[:0], states[:0]
    for event in result.events:
        if event.t >= times[-1]:
            break
        within = times < event.t
        before = np.array([(event.before or event.state)[name] for name in model.state_names])
        after = np.array([event.state[name] for name in model.state_names])
        ends = [head_times, times[within], [event.t]], [head_states, states[within], before[None]]
        pieces += _piece(*ends)
        beyond = times > event.t
        times, states = times[beyond], states[beyond]
        head_times, head_states = np.array([event.t]), after[None]
    pieces += _piece([head_times, times], [head_states, states])
    errors = np.zeros((1, states.shape[1]))
    if result.requested is not None and result.estimated is not None:
        errors[0] = [result.estimated * result.scales[name] for name in model.state_names]
    return Motions(tuple(pieces), parameter_values(model)[None], errors)


def _piece(times: Sequence[Any], states: Sequence[Any]) -> list[Piece]:
    """Return the piece with some samples; none if it has no length."""
    nodes = np.concatenate(times)
    return [Piece(nodes, np.concatenate(states)[None])] if len(nodes) > 1 else []


def finer_times(model: Model, motion: Motions, result: Trajectory) -> Array | None:
    """Return sample times four times as close where polynomials between samples leave out too much
    beside the accuracy; None where they do not."""
    accuracy, scales = result.requested, np.array([*result.scales.values()])
    along = None if accuracy is None else series_along(model, motion)
    if accuracy is None or along is None:
        return None
    panels = along.panels
    wanted = (panels.left_out[:, 0] > _LEFT_OUT * accuracy * scales[:, None]).any(axis=0)
    if not wanted.any():
        return None
    first, last = panels.edges[wanted].T
    shares = np.arange(1, _FINER) / _FINER
    inner = (first[:, None] + (last - first)[:, None] * shares).ravel()
    return np.unique(np.concatenate([panels.edges.ravel(), inner]))
