"""A scene whose derivation, models and answers are kept from before, or made anew."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any, TypeAlias

from lagrange_cli.api.remembered import Answer, SceneSource, remembered
from lagrange_cli.api.workspace import Workspace
from lagrange_cli.stages import announce
from lagrange_cli.state_layout import StateLayout

if TYPE_CHECKING:
    from lagrange_cli.api.derivation import Derivation
    from lagrange_cli.api.scenes import LoadedScene
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.simulate.cluster.tasks import Cluster
    from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import Reduction, WrittenCondition
    from lagrange_cli.studies.path.ends import End
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.section.members import SectionModel
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.tradeoff.result import Trade

#: Models of the motions between two configurations, and these.
PathProblem: TypeAlias = "tuple[PathModels, End, End]"


@dataclass(frozen=True)
class RememberedScene:
    """A scene with what options say of it; whatever is asked of it is looked up first.

    Attributes
    ----------
    workspace
        Holds the cache, and is told warnings and remarks.
    source
        The scene as it was read.
    parameters, initial, times
        Name → text of an expression that replaces the scene's.
    forces
        True if constraint forces are wanted too.
    formulation
        Minimal or multiplier form, or ``auto``; None for the scene's.
    sensitivity
        What the motion is differentiated by.
    steps
        The way of the steps that are wanted too; None for none.
    steps_optional
        True if scenes with rigid bodies, which have no steps, are derived without.
    reductions
        Numbers of motions for which the model has outputs.
    extra
        Further outputs of the model, as ``momenta`` and ``conserved``.

    Examples
    --------
    >>> from lagrange_cli.api.remembered import read_source
    >>> source = read_source("systems/pendulums/pendulum.yaml")
    >>> RememberedScene(Workspace(), source, {"l": "2"}).model().coordinates
    ('theta',)
    """

    workspace: Workspace
    source: SceneSource
    parameters: Mapping[str, str] = field(default_factory=dict)
    initial: Mapping[str, str] = field(default_factory=dict)
    times: Mapping[str, str] = field(default_factory=dict)
    forces: bool = False
    formulation: Formulation | None = None
    sensitivity: tuple[str, ...] = ()
    steps: Way | None = None
    steps_optional: bool = False
    reductions: tuple[Reduction, ...] = ()
    extra: tuple[str, ...] = ()

    @property
    def key(self) -> list[Any]:
        """The options as a part of questions to the cache."""
        values = [sorted(texts.items()) for texts in (self.parameters, self.initial, self.times)]
        reductions = [reduction.text for reduction in self.reductions]
        further = (
            self.forces,
            self.formulation,
            self.sensitivity,
            self.steps,
            self.extra,
            self.steps_optional,
        )
        return [*values, *further, reductions]

    def answer(
        self,
        command: str,
        options: Sequence[Any],
        stage: str,
        value_of: Callable[[Derivation], Any],
        *,
        digits: int = 30,
        reads_recordings: bool = False,
        when_read: Callable[[LoadedScene], None] = lambda loaded: None,
    ) -> Any:
        """Return a value of the derivation, kept from before or else worked out.

        Parameters
        ----------
        command, options
            The question, beside the scene and its options, as JSON values.
        stage
            Phrase for the work on the value.
        value_of
            Makes the value, which JSON holds.
        digits, when_read
            As for :meth:`derivation`.
        reads_recordings
            True if the value depends on what recorded inputs hold; it is not kept if there are any.

        Raises
        ------
        InputError
            The scene cannot be derived, or there are warnings and the workspace refuses them.
        """

        def work() -> Answer:
            derivation = self.derivation(digits, when_read)
            announce(stage)
            known, inputs = derivation.equations.derivation, derivation.equations.system.inputs
            recorded = any(entry.recording is not None for entry in inputs)
            tabulated = any(f.table is not None for f in derivation.equations.system.functions)
            lasting = not (tabulated or (reads_recordings and recorded))
            return Answer(value_of(derivation), known.warnings, known.remarks, lasting)

        question = [*self.key, digits, *options]
        return remembered(self.workspace, command, self.source, question, work)

    def loaded(self) -> LoadedScene:
        """Read the scene; a mistake in it is refused without any mathematics."""
        from lagrange_cli.api.scenes import loads

        announce("reading the scene")
        return loads(
            self.source.data,
            file=self.source.file,
            parameters=self.parameters,
            initial=self.initial,
            times=self.times,
        )

    def recipe(self) -> Recipe:
        """Return the same for runs of many models."""
        from lagrange_cli.scene import SceneText
        from lagrange_cli.simulate.ensemble.plan.recipe import Recipe

        texts = self.parameters, self.initial, self.times
        text = SceneText(self.source.file, self.source.data, *texts)
        return Recipe(text, self.forces, self.formulation, reductions=self.reductions)

    def derivation(
        self, digits: int = 30, when_read: Callable[[LoadedScene], None] = lambda loaded: None
    ) -> Derivation:
        """Derive the scene; the workspace is told its warnings and remarks.

        ``when_read`` is called with the scene before it is derived.
        """
        started = perf_counter()
        loaded = self.loaded()
        when_read(loaded)
        without_steps = self.steps_optional and _holds_bodies(loaded)
        derivation = loaded.derive(
            digits=digits,
            forces=self.forces,
            formulation=self.formulation,
            steps=None if without_steps else self.steps,
            cache=self.workspace.cache,
        )
        announce("")
        known = derivation.equations.derivation
        self.workspace.tell(known.warnings, known.remarks)
        self.workspace.detail(f"derived and certified in {perf_counter() - started:.2f} s")
        return derivation

    def compilations_ahead(self) -> AbstractContextManager[None]:
        """Return the context in which :meth:`model` compiles what its runs will need.

        The integrators are compiled while a scene is derived (the number of its coordinates is
        nearly always that of the equations) and the model while what runs it is imported.
        """
        from lagrange_cli.toolchain.shared_library import compilations_ahead

        return compilations_ahead()

    def model(self) -> Model:
        """Return the model of the scene."""

        def compile_integrators(loaded: LoadedScene) -> None:
            coordinates = loaded.scene.coordinates
            if coordinates is not None:
                from lagrange_cli.simulate.system.library_sources import stepping_source
                from lagrange_cli.toolchain.shared_library import compile_ahead

                layout = StateLayout(len(coordinates), len(loaded.scene.states))
                size = layout.size * (1 + len(self.sensitivity))
                compile_ahead(stepping_source(size), self.workspace.cache)

        def value_of(derivation: Derivation) -> Any:
            from lagrange_cli.simulate.system.library_sources import system_source
            from lagrange_cli.toolchain.shared_library import compile_ahead

            if self.reductions:
                from lagrange_cli.simulate.model.build import model_of

                model = model_of(self.recipe().prepared(derivation.equations))
            else:
                model = derivation.model(self.sensitivity, extra=self.extra)
            compile_ahead(system_source(model.code), self.workspace.cache)
            return model.to_json()

        value = self.answer(
            "simulate", (), "preparing the simulation", value_of, when_read=compile_integrators
        )
        from lagrange_cli.simulate.model.model import Model

        return Model.from_json(value)

    def section_model(self, condition: WrittenCondition) -> SectionModel:
        """Return what a section of the scene is found with."""

        def value_of(derivation: Derivation) -> Any:
            from lagrange_cli.studies.section.members import section_model

            return section_model(derivation.equations, condition).to_json()

        value = self.answer("section", (condition.text,), "preparing the section", value_of)
        from lagrange_cli.studies.section.members import SectionModel

        return SectionModel.from_json(value)

    def path_models(self) -> PathModels:
        """Return what paths of the scene are found with."""

        def value_of(derivation: Derivation) -> Any:
            return derivation.path_models().to_json()

        value = self.answer("path", (), "preparing the search", value_of)
        from lagrange_cli.studies.path.models import PathModels

        return PathModels.from_json(value)

    def path_problem(self, start: tuple[str, str], end: tuple[str, str]) -> PathProblem:
        """Return what :meth:`paths` solves: two ends, and models of the motions between them.

        Parameters
        ----------
        start, end
            Values of all coordinates and the time, ``x=0, t=0``, and what messages call them.

        Raises
        ------
        InputError
            Located: an end is not such a text; the motion is not that of stationary action.
        """
        from lagrange_cli.studies.path.ends import read_ends, written_end

        written = written_end(*start), written_end(*end)
        models = self.path_models()
        ends = read_ends(*written, models.motion.coordinates, lambda: self.loaded().scene)
        return models, *ends

    def paths(
        self,
        problem: PathProblem,
        *,
        accuracy: float = 1e-9,
        starts: int = 32,
        turns: int = 0,
        samples: int = 101,
        progress: Callable[[float], None] | None = None,
    ) -> Paths:
        """Find the paths between two ends; see :func:`.studies.path.find.find_paths`."""
        from lagrange_cli.studies.path.find import find_paths

        return find_paths(
            *problem,
            accuracy=accuracy,
            starts=starts,
            turns=turns,
            samples=samples,
            cache=self.workspace.cache,
            progress=progress,
        )

    def tradeoff(
        self,
        model: Model,
        *,
        methods: Sequence[str] | None = None,
        repeat: int = 20,
        budget: float = 1.0,
        progress: Callable[[float], None] | None = None,
    ) -> Trade:
        """Measure speed against accuracy of :meth:`model`; see :func:`.tradeoff.measure.trade`."""
        from lagrange_cli.studies.tradeoff.measure import trade

        cache = self.workspace.cache
        return trade(
            model, methods=methods, repeat=repeat, budget=budget, cache=cache, progress=progress
        )

    def stress(
        self,
        *,
        axes: Sequence[str] | None = None,
        accuracy: float | None = None,
        budget: float = 5.0,
        jobs: int | None = 1,
        cluster: Cluster | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> Stress:
        """Push the scene to extremes; see :func:`.studies.stress.measure.stress`."""
        from lagrange_cli.studies.stress.measure import stress

        return stress(
            self.recipe(),
            axes=axes,
            accuracy=accuracy,
            budget=budget,
            jobs=jobs,
            cluster=cluster,
            progress=progress,
        )

    def recorded_files(self) -> list[str]:
        """Return the paths of recorded inputs and tables, whatever start and times are.

        Scenes name them by the key ``file``, perhaps escaped: others are not read for it.
        """
        if b"file" not in self.source.data and b"\\" not in self.source.data:
            return []
        scene = replace(self, initial={}, times={}).loaded().scene
        return [column.path for column in scene.columns]


@dataclass(frozen=True)
class RememberedMembers:
    """Models of members of an ensemble, kept in the cache.

    Attributes
    ----------
    scene
        The scene of all members.
    section
        Condition whose values are further outputs of the models; None if there is none.
    """

    scene: RememberedScene
    section: WrittenCondition | None = None

    @property
    def recipe(self) -> Recipe:
        """The scene, and what options say of all members."""
        return replace(self.scene.recipe(), section=self.section)

    def model_of(self, member: MemberValues) -> Model:
        """Return the model of a member."""
        parameters = {**self.scene.parameters, **member.parameters}
        initial = {**self.scene.initial, **member.initial}
        scene = replace(self.scene, parameters=parameters, initial=initial)
        return scene.model() if self.section is None else scene.section_model(self.section).model

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Tell if members differ from the model of one of them in numbers alone."""

        def work() -> Answer:
            from lagrange_cli.simulate.ensemble.plan.variants import differ_in_numbers

            return Answer(differ_in_numbers(self.recipe, member, model))

        values = [sorted(texts.items()) for texts in (member.parameters, member.initial)]
        question = [*self.scene.key, *values, self.section and self.section.text]
        scene = self.scene
        return bool(remembered(scene.workspace, "members", scene.source, question, work))


def _holds_bodies(loaded: LoadedScene) -> bool:
    from lagrange_cli.scene.bodies import bodies_of

    return bool(bodies_of(loaded.scene))
