"""Results of members that are run batched (:mod:`.batched`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from lagrange_cli.cache import open_cache
from lagrange_cli.simulate.accuracy.measured import Measured
from lagrange_cli.simulate.arrays import Array
from lagrange_cli.simulate.ensemble.plan.plan import Selection
from lagrange_cli.simulate.ensemble.reduce.dense_motion import Motions, Piece
from lagrange_cli.simulate.ensemble.reduce.selection import Selector
from lagrange_cli.simulate.ensemble.run.batched import (
    METHOD,
    BatchedMembers,
    BatchedRuns,
    batched_members,
)
from lagrange_cli.simulate.ensemble.store.blocks import BlockPart
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.request import Request, resolve
from lagrange_cli.simulate.runs.problem import InitialValueProblem
from lagrange_cli.simulate.verification.disproof import energy_is_conserved
from lagrange_cli.simulate.verification.drifts import contradicted, energy_drifts, suspects

#: Numbers in all samples of members that are held at a time.
_MOST_NUMBERS = 2_000_000

#: Members whose samples are looked at at a time, so that these are small enough to be near at hand.
_AT_A_TIME = 32

#: Columns that can be asked for besides.
_EXTRA = {"energy", "positions"}


@dataclass(frozen=True)
class Missed:
    """A member that misses the accuracy asked for, and what was measured."""

    number: int
    measured: Measured


@dataclass(frozen=True)
class BatchedResults:
    """Results of members that are run batched.

    Attributes
    ----------
    model
        Model of one member.
    request
        Request that all members share.
    members
        Stepper of the members.
    extra
        Names of further columns.
    keeper
        Selects columns and numbers to store.
    """

    model: Model
    request: Request
    members: BatchedMembers
    extra: tuple[str, ...]
    selector: Selector

    def run(
        self, starts: Array, parameters: Array, between: Callable[[], None] = lambda: None
    ) -> Iterator[BlockPart | Missed]:
        """Yield the members whose results batched runs decide; others are left to single runs.

        Their numbers are those of the rows of ``starts``; what is varied is left out.

        Parameters
        ----------
        starts, parameters
            Shapes (members, 2n) and (members, parameters).
        between
            Called now and then.
        """
        most = max(1, _MOST_NUMBERS // (len(self.request.times) * starts.shape[1]))
        for first in range(0, len(starts), most):
            part = slice(first, first + most)
            at_a_time = _AT_A_TIME if self._of_samples else most
            for all_runs in self._runs(starts[part], parameters[part], between):
                for runs in all_runs.in_turn(at_a_time):
                    numbered = replace(runs, numbers=runs.numbers + first)
                    yield from self._results(numbered, parameters[numbered.numbers])

    @cached_property
    def _of_samples(self) -> bool:
        """True if columns are evaluated at every sample, and not the energies of checks alone."""
        return "energy" in self.extra or bool(self.selector.needed(self.names))

    def _runs(
        self, starts: Array, parameters: Array, between: Callable[[], None]
    ) -> Iterator[BatchedRuns]:
        eps, rtol = self.request.accuracy, self.request.rtol
        if eps is not None:
            return self.members.promised(eps, starts, parameters, between)
        assert rtol is not None
        return iter([self.members.unpromised(rtol, starts, parameters, between)])

    def _results(self, runs: BatchedRuns, parameters: Array) -> Iterator[BlockPart | Missed]:
        """Yield the results of members about which the energy leaves no doubt."""
        eps = self.request.accuracy
        if len(runs.numbers) == 0:
            return
        if eps is not None and (runs.estimate >= eps).any():
            for k, number in enumerate(runs.numbers.tolist()):
                yield Missed(number, self.members.measured(eps, runs, k))
            return
        energy, drifts, sure = self._checked(runs, parameters)
        figures = self._figures(runs, drifts)
        formulation = self.model.formulation
        words = {"status": "ok", "reason": "", "method": METHOD, "formulation": formulation}
        scales = (
            {} if eps is None else dict(zip(self.model.state_names, runs.scales.T, strict=True))
        )
        columns, numbers = self._selected(runs, parameters, energy)
        members = runs.numbers.tolist()
        yield _only(BlockPart(members, columns, numbers, {}, scales, figures, words), sure)

    def _checked(
        self, runs: BatchedRuns, parameters: Array
    ) -> tuple[Array, Array, NDArray[np.bool_]]:
        """Return energies at the samples if columns need them, shape (members, samples); drifts,
        NaN if the energy is not conserved; and which members' energy leaves no doubt."""
        eps, conserved = self.request.accuracy, energy_is_conserved(self.model)
        drifts, sure = np.full(len(runs.numbers), np.nan), np.ones(len(runs.numbers), bool)
        energy = np.empty((len(runs.numbers), 0))
        if not (conserved or "energy" in self.extra):
            return energy, drifts, sure
        for first in range(0, len(sure), _AT_A_TIME):
            some = slice(first, first + _AT_A_TIME)
            energies = self._energies(runs.states[some], parameters[some])
            if self._of_samples:
                # Then there are so few members that these are all of them.
                energy = energies[0]
            if conserved:
                drifts[some] = energy_drifts(*energies)
            if conserved and eps is not None:
                moved_by = eps * runs.scales[some]
                doubtful = self._doubtful(runs.states[some], moved_by, parameters[some], *energies)
                sure[some] = ~doubtful
        return energy, drifts, sure

    def _selected(
        self, runs: BatchedRuns, parameters: Array, energy: Array
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return the columns and the numbers to store; no others are evaluated."""
        states = runs.states
        selector, names = self.selector, self.names
        columns = self._columns(selector.needed(names), states, parameters, energy)
        numbers = selector.numbers(columns)
        if selector.selection.reductions:
            promised = self.request.accuracy is not None
            errors = runs.scales * (runs.estimate[:, None] if promised else 0.0)
            piece = Piece(selector.times, states)
            numbers |= selector.reduced(Motions((piece,), parameters, errors))
        if selector.selection.final:
            at_end = states[:, -1:], parameters, energy[:, -1:]
            ends = self._columns(selector.without_reductions(names), *at_end, at_end=True)
            numbers |= {f"final/{name}": values[:, 0].copy() for name, values in ends.items()}
        return {name: columns[name] for name in selector.written(names)}, numbers

    def _energies(self, states: Array, parameters: Array) -> tuple[Array, Array]:
        """Evaluate :func:`.verification.disproof.energies` of each member, (members, samples)."""
        table = self.members.table
        (total,) = table("energy", states, parameters, 1)
        return total, total - table("energy", states, parameters, 1, moving=0.0)[0]

    def _doubtful(
        self, states: Array, errors: Array, parameters: Array, energy: Array, kinetic: Array
    ) -> NDArray[np.bool_]:
        """Tell whether energies change by more than errors, (members, 2n), explain, where they
        change most.

        As :func:`.verification.drifts.first_contradiction`, but that members that are in
        doubt are asked again by themselves.
        """
        if not self.model.facts["autonomous"]:
            return np.ones(len(states), bool)
        change, picked = suspects(energy, kinetic)
        first = states[:, :1]
        moved = _moved_by(np.take_along_axis(states, picked[..., None], axis=1), errors[:, None])
        start = _moved_by(first, np.spacing(np.abs(first)))
        size = moved.shape[1] * moved.shape[2]
        every = np.concatenate([start[:, 0], moved.reshape(len(moved), size, -1)], axis=1)
        (values,) = self.members.table_at_start("energy", every, parameters, 1)
        at_start, others = values[:, : start.shape[2]], values[:, start.shape[2] :]
        return contradicted(change, at_start, others.reshape(moved.shape[:3]))

    @property
    def names(self) -> list[str]:
        """Names of the columns."""
        model = self.model
        places = [form.format(name) for form in ("{}", "dot({})") for name in model.cartesian]
        energy = ["energy"] if "energy" in self.extra else []
        return list(dict.fromkeys([*model.state_names, *places, *model.outputs, *energy]))

    def _columns(
        self,
        wanted: Sequence[str],
        states: Array,
        parameters: Array,
        energy: Array,
        *,
        at_end: bool = False,
    ) -> dict[str, Array]:
        """Evaluate some columns of :class:`.results.trajectory.Trajectory`, (members, samples).

        ``at_end``: the states are those of the last sample alone.
        """
        model = self.model
        table = self.members.table_at_end if at_end else self.members.table
        columns = {name: states[..., i] for i, name in enumerate(model.state_names)}
        for kind, form in (("positions", "{}"), ("velocities", "dot({})")):
            names = [form.format(name) for name in model.cartesian]
            if not columns.keys() >= set(names) & set(wanted):
                values = table(kind, states, parameters, len(names))
                for name, value in zip(names, values, strict=True):
                    columns.setdefault(name, value)
        if not set(model.outputs).isdisjoint(wanted):
            values = table("outputs", states, parameters, len(model.outputs))
            columns |= dict(zip(model.outputs, values, strict=True))
        if "energy" in self.extra:
            columns["energy"] = energy
        return {name: columns[name] for name in wanted}

    def _figures(self, runs: BatchedRuns, drifts: Array) -> dict[str, Array]:
        nothing = np.full(len(runs.numbers), np.nan)
        promised = self.request.accuracy is not None
        until = np.full(len(runs.numbers), self.members.problem.until)
        return {
            "estimated": runs.estimate if promised else nothing,
            "holds_until": until if promised else nothing,
            "energy_drift": drifts,
            "constraint_drift": nothing,
            "steps": runs.steps.astype(float),
            "rhs_evaluations": runs.evaluations.astype(float),
            "all_evaluations": runs.all_evaluations.astype(float),
        }


def _moved_by(states: Array, errors: Array) -> Array:
    """Return each state, then those with a number moved by its error, up and then down,
    shape (m, k, 1 + 4n, 2n)."""
    moves = errors[..., None, :] * np.eye(states.shape[2])
    unmoved = states[..., None, :]
    return np.concatenate([unmoved, unmoved + moves, unmoved - moves], axis=2)


def _only(part: BlockPart, which: NDArray[np.bool_]) -> BlockPart:
    """Keep the flagged members."""
    if which.all():
        return part
    columns, numbers, scales, figures = (
        {name: values[which] for name, values in arrays.items()}
        for arrays in (part.columns, part.numbers, part.scales, part.figures)
    )
    return BlockPart(
        list(compress(part.members, which)),
        columns,
        numbers,
        part.varied,
        scales,
        figures,
        part.words,
    )


def batched_results(
    model: Model,
    options: SimulationOptions,
    extra: tuple[str, ...],
    selection: Selection = Selection(),  # noqa: B008
) -> BatchedResults | None:
    """Return the batched runs of a model's members; None if they cannot be batched.

    Parameters
    ----------
    options
        Request that all members share.
    extra
        Further columns.
    selection
        Columns and numbers to store of each.
    """
    request = resolve(model, options)
    chosen = request.method is None and request.atol is None
    clash = "energy" in extra and "energy" in {*model.cartesian, *model.outputs}
    if not chosen or clash or not set(extra) <= _EXTRA:
        return None
    problem = InitialValueProblem(
        lambda t, y: np.full(len(y), np.nan),
        request.initial,
        request.times,
        model.kinds,
        autonomous=model.facts["autonomous"],
    )
    members = batched_members(model, problem, open_cache())
    if members is None:
        return None
    return BatchedResults(
        model, request, members, extra, Selector.for_model(request, model, selection)
    )
