"""Ensembles of a remembered scene: planned, run into a store, drawn as a map."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from lagrange_cli.api.remembered_scene import RememberedMembers
from lagrange_cli.api.simulations import SimulationRequest
from lagrange_cli.errors import InputError, Problem
from lagrange_cli.files import ending_of

if TYPE_CHECKING:
    from lagrange_cli.pictures.curves import Panels
    from lagrange_cli.pictures.drawn.maps import Plane
    from lagrange_cli.simulate.arrays import Array
    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.ensemble.plan.plan import Blocks, Plan, Selection
    from lagrange_cli.simulate.ensemble.store.store import Store
    from lagrange_cli.simulate.model.requested_outputs import Reduction

#: Members of which all samples are kept unless something else is asked for.
MOST_WITH_SAMPLES = 10_000


@dataclass(frozen=True)
class MemberChoice:
    """The members of an ensemble, and what is kept of each.

    Attributes
    ----------
    member_file
        File with a row for each member; None if ``vary`` or ``sample`` give them.
    vary
        Ranges of values, ``NAME=RANGE``.
    sample
        Distributions of values, ``NAME ~ KIND(FIRST, SECOND)``.
    number
        Number of members that are drawn.
    seed
        What they are drawn by.
    final
        The end of each is kept in place of its samples.
    columns
        Names of the columns that are kept, or ``all``; None if nothing was said.
    reductions
        Numbers of motions that are kept.
    map_names
        Names of the axes of the map that is drawn; None for no map.
    jobs
        Number of members at a time; None for the number of cores.
    scheduler
        Address of the scheduler of the cluster that runs them; None for this machine.
    resume
        True to go on with the members that are still to be simulated.
    """

    member_file: str | None
    vary: tuple[str, ...]
    sample: tuple[str, ...]
    number: int | None
    seed: int | None
    final: bool
    columns: tuple[str, ...] | None
    reductions: tuple[Reduction, ...]
    map_names: tuple[str, ...] | None
    jobs: int | None
    scheduler: str | None
    resume: bool

    def members(self) -> Members:
        """Read the members.

        Raises
        ------
        InputError
            Located: what is wrong with them.
        """
        from lagrange_cli.simulate.ensemble.plan.sampling import sampled
        from lagrange_cli.simulate.ensemble.plan.sources import grid, read_members

        if self.sample:
            return sampled(self.sample, self.number or 0, self.seed or 0)
        return grid(self.vary) if self.member_file is None else read_members(self.member_file)

    def plane(self, members: Members, plot: str | None) -> Plane | None:
        """Return the plane of the map in the file ``plot``, None if none is drawn."""
        if self.map_names is None or plot is None:
            return None
        from lagrange_cli.pictures.by_matplotlib import require_map_ending
        from lagrange_cli.pictures.drawn.maps import Plane

        require_map_ending(ending_of(plot).lstrip("."))
        return Plane.of_axes(members, self.map_names)

    def draws_curves(self, plot: str | None) -> bool:
        """Tell if the file ``plot`` shows the motions of all members as curves."""
        return plot is not None and self.map_names is None

    def selection(self, members: Members, output: str | None, plot: str | None) -> Selection:
        """Return the columns to keep.

        Without a file these are figures and reductions alone, and columns of which a picture shows
        curves.
        """
        from lagrange_cli.simulate.ensemble.plan.plan import Selection

        columns, final = self.columns, self.final
        if output is None and ((final and not self.map_names) or columns is not None):
            raise _refused("--final and --columns say what a file keeps", "-o ensemble.npz")
        if output is None:
            return Selection(None if self.draws_curves(plot) else (), final, self.reductions)
        final = final or (columns is None and len(members) > MOST_WITH_SAMPLES)
        names = None if columns == ("all",) else () if final else columns
        return Selection(names, final, self.reductions)


def written_reductions(texts: Iterable[str]) -> tuple[Reduction, ...]:
    """Read numbers of motions, each once; refuses what is none."""
    from lagrange_cli.simulate.model.requested_outputs import read_reduction

    return tuple(read_reduction(text) for text in dict.fromkeys(texts))


def _refused(message: str, hint: str) -> InputError:
    return InputError(Problem(message, hint=hint, rule="ensemble"))


@dataclass(frozen=True)
class PlannedEnsemble:
    """An ensemble that can be run.

    Attributes
    ----------
    asked
        The options of each member, and the files.
    choice
        The members as they were asked for.
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
    choice: MemberChoice
    members: Members
    plan: Plan
    times: Array
    plane: Plane | None

    @cached_property
    def drawn(self) -> str | None:
        """Name of the array that the map shows; refused if there is no such number."""
        return None if self.plane is None else self.plane.drawn(self.plan, self.asked.plot_of)

    @cached_property
    def panels(self) -> Panels | None:
        """Curves of all members that the picture shows; None if it shows none.

        Raises
        ------
        InputError
            Located: what is asked for is not kept of the members; or they are too many.
        """
        if not self.choice.draws_curves(self.asked.plot):
            return None
        from lagrange_cli.pictures.curves import read_panels, usual_panels
        from lagrange_cli.pictures.drawn.families import require_family

        require_family(self.members)
        model, stored = self.plan.model, self.plan.selection.columns
        if self.asked.plot_of is None and stored is None:
            return usual_panels(model.coordinates, model.labels.dimensions)
        columns = (*model.columns, *self.plan.extra) if stored is None else stored
        names = self.asked.plot_of or ", ".join(model.coordinates)
        return read_panels(names, ("t", *columns), "--plot-of")

    @cached_property
    def blocks(self) -> Blocks:
        """Blocks of members, each run at once."""
        from lagrange_cli.simulate.ensemble.plan.plan import blocks_of

        return blocks_of(self.plan, self.members)

    def open_store(self) -> Store:
        """Open the store of the result, or that of an interrupted run to go on.

        Raises
        ------
        InputError
            There are blocks that may not be used, or nothing that the picture could show.
        """
        from lagrange_cli.simulate.ensemble.store.opening import open_store
        from lagrange_cli.simulate.ensemble.store.store import MemoryStore

        is_drawn = self.panels is not None or self.drawn is not None
        if is_drawn and self.asked.output is None:
            return MemoryStore(self.blocks.size)
        return open_store(self.asked.output, self.blocks, resume=self.choice.resume)

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
        """Draw the map, or the curves, of a result that is complete, if that was asked for."""
        if self.asked.plot is None:
            return
        from lagrange_cli.pictures.drawing import draw_into
        from lagrange_cli.pictures.drawn.families import Family

        ensemble = store.ensemble(self.plan.model.name, self.times)
        if self.panels is not None:
            starts = frozenset(self.plan.member.initial)
            labels = self.plan.model.labels
            draw_into(self.asked.plot, Family(ensemble, self.panels, labels, starts))
        if self.plane is not None and self.drawn is not None:
            plane_map = self.plane.map_of(ensemble.arrays, self.drawn, self.plan, self.times)
            draw_into(self.asked.plot, plane_map)


def planned(asked: SimulationRequest, choice: MemberChoice) -> PlannedEnsemble:
    """Plan the runs of all members; the workspace is told what differs from one motion.

    Raises
    ------
    InputError
        Located: the scene, the members or the options are wrong.
    """
    from lagrange_cli.simulate.ensemble.plan.plan import plan_members
    from lagrange_cli.simulate.ensemble.store import opening

    output, workspace = asked.output, asked.scene.workspace
    if output is not None and opening.ending_of(output) is None:
        raise _refused(f"an ensemble is written as {', '.join(opening.ENDINGS)}", "-o ensemble.npz")
    if choice.resume and output is None:
        raise _refused("--resume needs the file that the result was to be", "-o ensemble.npz")
    members = choice.members()
    plane = choice.plane(members, asked.plot)
    selection = choice.selection(members, output, asked.plot)
    if selection.final and not choice.final:
        remark = (
            f"more than {MOST_WITH_SAMPLES:,} members: their ends are kept, not their samples;"
            " --columns all keeps these"
        )
        workspace.tell((), [remark])
    extra = asked.columns
    only_drawn = output is None and choice.draws_curves(asked.plot)
    if "energy" not in extra and (only_drawn or "energy" in (selection.columns or ())):
        extra = (*extra, "energy")
    models = RememberedMembers(replace(asked.scene, reductions=choice.reductions))
    plan, times = plan_members(models, members, asked.options, extra=extra, selection=selection)
    if not plan.alone:
        remark = "each member is derived by itself: its values may change the equations"
        workspace.tell((), [remark])
    return PlannedEnsemble(asked, choice, members, plan, times, plane)
