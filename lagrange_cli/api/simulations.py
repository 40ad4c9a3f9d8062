"""Motions and sections of a remembered scene, with the files that they are written to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lagrange_cli.api.remembered_scene import RememberedMembers, RememberedScene
from lagrange_cli.simulate.options import SimulationOptions

if TYPE_CHECKING:
    from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
    from lagrange_cli.simulate.ensemble.plan.enumeration import Members
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition
    from lagrange_cli.simulate.results.trajectory import Trajectory
    from lagrange_cli.studies.section.members import SectionModel
    from lagrange_cli.studies.section.result import Section


@dataclass(frozen=True)
class SimulationRequest:
    """A motion, or those of all members of an ensemble, and what is to be written of it.

    Attributes
    ----------
    scene
        The scene, with its options.
    options
        Those of the integration.
    columns
        Names of further columns of the output.
    output, plot
        Files to write; None for none.
    plot_of
        What the plot shows; None for coordinates, velocities and energy.
    """

    scene: RememberedScene
    options: SimulationOptions
    columns: tuple[str, ...] = ()
    output: str | None = None
    plot: str | None = None
    plot_of: str | None = None

    def integrate(
        self,
        model: Model,
        *,
        checkpoint: Checkpoint | None = None,
        progress: Callable[[float], None] | None = None,
        reached: Callable[[float], None] | None = None,
        stop: Callable[[], bool] | None = None,
    ) -> Trajectory:
        """Integrate the motion of the scene's model; samples beyond memory go to the output.

        Parameters
        ----------
        checkpoint, progress, reached, stop
            See :class:`.simulate.simulation.RunContext`.

        Raises
        ------
        InputError
            As :func:`.simulate.simulation.simulate`; or a column that is to be written or drawn
            is not there.
        """
        from lagrange_cli.simulate.charts.simulation import (
            simulate_past_singularities,
            simulate_with_sensitivities,
        )
        from lagrange_cli.simulate.results.streaming import Stream
        from lagrange_cli.simulate.results.trajectory import require_forces
        from lagrange_cli.simulate.simulation import RunContext

        if self.scene.forces:
            require_forces(model.name, [*model.multipliers, *model.forces])
        context = RunContext(
            cache=self.scene.workspace.cache,
            stream=Stream(self.output, self.columns, self._drawn(model)),
            checkpoint=checkpoint,
            progress=progress,
            reached=reached,
            stop=stop,
        )
        if self.scene.sensitivity:
            return simulate_with_sensitivities(model, self.options, context)
        # Momenta are those of the coordinates, which are kept for them.
        formulation = model.formulation if self.scene.extra else self.scene.formulation
        with_multipliers = replace(self.scene, formulation="multiplier").model
        return simulate_past_singularities(
            model, self.options, with_multipliers, context, formulation=formulation
        )

    def _drawn(self, model: Model) -> tuple[str, ...] | None:
        """Return the columns that a picture shows, None if there is none.

        Raises
        ------
        InputError
            Located: the motion will have none of such a name.
        """
        if self.plot is None:
            return None
        from lagrange_cli.pictures.curves import columns_of, read_panels, usual_panels

        if self.plot_of is None:
            panels = usual_panels(model.coordinates, model.labels.dimensions)
        else:
            panels = read_panels(self.plot_of, ("t", *model.columns, "energy"), "--plot-of")
        return columns_of(panels)

    def section(self, condition: str) -> SectionSearch:
        """Prepare to find the points of a section.

        Raises
        ------
        InputError
            The scene or the condition are wrong, or points will not have what is to be drawn.
        """
        from lagrange_cli.simulate.model.requested_outputs import WrittenCondition

        written = WrittenCondition(condition, "--section")
        known = self.scene.section_model(written)
        if self.plot is not None and self.plot_of is not None:
            from lagrange_cli.pictures.curves import read_panels

            names = [name for name in known.model.columns if not name.startswith("section ")]
            read_panels(self.plot_of, ("t", *names, "energy"), "--plot-of")
        return SectionSearch(self, written, known)


@dataclass(frozen=True)
class SectionSearch:
    """A search for the points of a Poincaré section.

    Attributes
    ----------
    asked
        The motion, or what members of an ensemble share.
    condition
        The condition as it was written.
    known
        The scene's model with the condition.
    """

    asked: SimulationRequest
    condition: WrittenCondition
    known: SectionModel

    def of_motion(
        self, progress: Callable[[float], None] | None, stop: Callable[[], bool] | None
    ) -> Section:
        """Find the section of the scene's motion."""
        from lagrange_cli.simulate.simulation import RunContext
        from lagrange_cli.studies.section.members import single_section

        context = RunContext(cache=self.asked.scene.workspace.cache, progress=progress, stop=stop)
        return single_section(self.known, self.asked.options, context)

    def of_members(
        self, members: Members, jobs: int | None, progress: Callable[[float], None] | None
    ) -> Section:
        """Find the section of the motions of all members, ``jobs`` at a time."""
        from lagrange_cli.studies.section.members import section_of_members

        models = RememberedMembers(self.asked.scene, self.condition)
        return section_of_members(
            self.known, models, members, self.asked.options, jobs=jobs, progress=progress
        )
