"""Ensembles of a remembered scene: planned, run into a store, drawn as a map."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.api.remembered_scene import RememberedMembers
from lagrange_cli.api.simulations import SimulationRequest
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of, write_file

if TYPE_CHECKING:
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks, Plan
    from lagrange_cli.simulate.ensemble.reduce.plane_map import Plane
    from lagrange_cli.simulate.ensemble.store.store import Store
    from lagrange_cli.simulate.model.requested_outputs import Reduction


def written_members(
    *, file: str | None, vary: Sequence[str], sample: Sequence[str], number: int, seed: int
) -> Members:
    """Read the members that texts or a file state.

    Parameters
    ----------
    file
        A table or list with a row for each member; None if ``vary`` or ``sample`` state them.
    vary
        Ranges of values, ``NAME=RANGE``.
    sample
        Distributions of values, ``NAME ~ KIND(FIRST, SECOND)``, which take precedence.
    number, seed
        Of the members that are drawn.

    Raises
    ------
    InputError
        Located: what is wrong with them.
    """
    from lagrange_cli.simulate.ensemble.plan.sampling import sampled
    from lagrange_cli.simulate.ensemble.plan.sources import grid, read_members

    if sample:
        return sampled(sample, number, seed)
    return grid(vary) if file is None else read_members(file)


def written_reductions(texts: Iterable[str]) -> tuple[Reduction, ...]:
    """Read numbers of motions, each once; refuses what is none."""
    from lagrange_cli.simulate.model.requested_outputs import read_reduction

    return tuple(read_reduction(text) for text in dict.fromkeys(texts))


def plane_of(members: Members, names: tuple[str, ...], plot: str) -> Plane:
    """Return the plane of two names that members vary, for a map in the file ``plot``.

    Raises
    ------
    InputError
        Maps cannot be written so, or members are not all combinations of some values of these.
    """
    from lagrange_cli.simulate.ensemble.reduce.plane_map import Plane
    from lagrange_cli.simulate.results.plot import require_map_ending

    require_map_ending(ending_of(plot).lstrip("."))
    return Plane.of_axes(members, names)


def require_result(output: str) -> None:
    """Refuse a file or store that no ensemble can be written to, by its name."""
    from lagrange_cli.simulate.ensemble.store import opening

    if opening.ending_of(output) is None:
        message = f"an ensemble is written as {', '.join(opening.ENDINGS)}"
        raise InputError(Problem(message, hint="-o ensemble.npz", rule="ensemble"))


@dataclass(frozen=True)
class PlannedEnsemble:
    """An ensemble that can be run.

    Attributes
    ----------
    asked
        The options of each member, and the files.
    members
        Values of all members.
    plan
        Model and options that all members share.
    times
        Times of the samples, shape (samples,).
    plane
        The plane of the map that is drawn; None for none.
    """

    asked: SimulationRequest
    members: Members
    plan: Plan
    times: Array
    plane: Plane | None

    @cached_property
    def drawn(self) -> str | None:
        """Name of the array that the map shows; refused if there is no such number."""
        return None if self.plane is None else self.plane.drawn(self.plan, self.asked.plot_of)

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of members, each run at once."""
        from lagrange_cli.simulate.ensemble.plan.plan import blocks_of

        return blocks_of(self.plan, self.members)

    def open_store(self, *, resume: bool) -> Store:
        """Open the store of the result, with ``resume`` that of an interrupted run.

        Raises
        ------
        InputError
            There are blocks that may not be used, or nothing that the map could show.
        """
        from lagrange_cli.simulate.ensemble.store.opening import open_store
        from lagrange_cli.simulate.ensemble.store.store import MemoryStore

        if self.drawn is not None and self.asked.output is None:
            return MemoryStore(self.blocks.size)
        return open_store(self.asked.output, self.blocks, resume=resume)

    def run(
        self,
        store: Store,
        *,
        jobs: int | None,
        cluster: Cluster | None,
        progress: Callable[[float], None] | None,
    ) -> bool:
        """Run the blocks that are not in the store; return whether all of them are there now.

        Parameters
        ----------
        jobs
            Members that are simulated at a time.
        cluster
            Runs them in place of this machine.
        progress
            Called with the part of the members that are finished.
        """
        from lagrange_cli.simulate.ensemble.run.cluster import ClusterEngine
        from lagrange_cli.simulate.ensemble.run.run import run_members

        budget = self.asked.options.budget
        return run_members(
            self.blocks,
            store,
            jobs=jobs,
            engine=None if cluster is None else ClusterEngine(cluster, budget),
            budget=budget,
            progress=progress,
        )

    def draw(self, store: Store) -> None:
        """Draw the map of a result that is complete, if there is one."""
        if self.plane is None or self.drawn is None or self.asked.plot is None:
            return
        from lagrange_cli.simulate.results.plot import draw_map

        arrays = store.ensemble(self.plan.model.name, self.times).arrays
        picture = self.plane.map_of(arrays, self.drawn, self.plan, float(self.times[-1]))
        write_file(self.asked.plot, draw_map(picture, ending_of(self.asked.plot).lstrip(".")))


def planned(
    asked: SimulationRequest,
    members: Members,
    *,
    columns: tuple[str, ...] | None,
    final: bool,
    reductions: tuple[Reduction, ...],
    plane: Plane | None = None,
) -> PlannedEnsemble:
    """Plan the runs of all members.

    Parameters
    ----------
    columns
        Names of the columns to store of all samples; None for all.
    final
        All columns are stored at the last sample.
    reductions
        Numbers to store of each motion.
    plane
        The plane of the map that is drawn.

    Raises
    ------
    InputError
        Located: the scene, the members or the options are wrong.
    """
    from lagrange_cli.simulate.ensemble.plan.plan import Selection, plan_members

    extra = asked.columns
    if "energy" in (columns or ()) and "energy" not in extra:
        extra = (*extra, "energy")
    models = RememberedMembers(replace(asked.scene, reductions=reductions))
    selection = Selection(columns, final, reductions)
    plan, times = plan_members(models, members, asked.options, extra=extra, selection=selection)
    return PlannedEnsemble(asked, members, plan, times, plane)
