"""A scene whose derivation, models and answers are kept from before, or made anew."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import TYPE_CHECKING, Any

from lagrange_cli.api.remembered import Answer, SceneSource, remembered
from lagrange_cli.api.workspace import Workspace
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.api.derivation import Derivation
    from lagrange_cli.api.scenes import LoadedScene
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import Reduction, WrittenCondition
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.path.result import Paths
    from lagrange_cli.studies.section.members import SectionModel
    from lagrange_cli.studies.stress.measure import Stress
    from lagrange_cli.studies.tradeoff.result import Trade


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
    reductions
        Numbers of motions for which the model has outputs.
    extra
        Further outputs of the model, as ``momenta`` and ``conserved``.

    Examples
    --------
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
    reductions: tuple[Reduction, ...] = ()
    extra: tuple[str, ...] = ()

    @property
    def values(self) -> list[list[tuple[str, str]]]:
        """Return parameters, initial values and times as a part of questions to the cache."""
        return [sorted(texts.items()) for texts in (self.parameters, self.initial, self.times)]

    def answer(self, command: str, options: Sequence[Any], work: Callable[[], Answer]) -> Any:
        """Return the answer of a command, kept from before or found by ``work``.

        Parameters and errors are those of :func:`.remembered.remembered`.
        """
        return remembered(self.workspace, command, self.source, options, work)

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
        derivation = loaded.derive(
            digits=digits,
            forces=self.forces,
            formulation=self.formulation,
            steps=self.steps,
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
        from lagrange_cli.simulate.toolchain.shared_library import compilations_ahead

        return compilations_ahead()

    def model(self) -> Model:
        """Return the model of the scene."""

        def compile_integrators(loaded: LoadedScene) -> None:
            coordinates = loaded.scene.coordinates
            if coordinates is not None:
                from lagrange_cli.simulate.system.library_sources import stepping_source
                from lagrange_cli.simulate.toolchain.shared_library import compile_ahead

                number = len(coordinates) * (1 + len(self.sensitivity))
                compile_ahead(stepping_source(number), self.workspace.cache)

        def work() -> Answer:
            from lagrange_cli.simulate.system.library_sources import system_source
            from lagrange_cli.simulate.toolchain.shared_library import compile_ahead

            derivation = self.derivation(when_read=compile_integrators)
            announce("preparing the simulation")
            if self.reductions:
                from lagrange_cli.simulate.model.build import model_of

                model = model_of(self.recipe().prepared(derivation.equations))
            else:
                model = derivation.model(self.sensitivity, extra=self.extra)
            compile_ahead(system_source(model.code), self.workspace.cache)
            return answer_of(derivation, model.to_json())

        texts = [reduction.text for reduction in self.reductions]
        asked = [self.forces, self.formulation, self.sensitivity, self.extra, texts]
        value = self.answer("simulate", [*self.values, *asked], work)
        from lagrange_cli.simulate.model.model import Model

        return Model.from_json(value)

    def section_model(self, condition: WrittenCondition) -> SectionModel:
        """Return what a section of the scene is found with."""

        def work() -> Answer:
            from lagrange_cli.studies.section.members import section_model

            derivation = self.derivation()
            announce("preparing the section")
            return answer_of(derivation, section_model(derivation.equations, condition).to_json())

        question = [*self.values, self.formulation, condition.text]
        value = self.answer("section", question, work)
        from lagrange_cli.studies.section.members import SectionModel

        return SectionModel.from_json(value)

    def path_models(self) -> PathModels:
        """Return what paths of the scene are found with."""

        def work() -> Answer:
            derivation = self.derivation()
            announce("preparing the search")
            return answer_of(derivation, derivation.path_models().to_json())

        value = self.answer("path", [*self.values, self.formulation], work)
        from lagrange_cli.studies.path.models import PathModels

        return PathModels.from_json(value)

    def path_search(self, start: tuple[str, str], end: tuple[str, str]) -> partial[Paths]:
        """Return :func:`.studies.path.find.find_paths` for two ends, still without its options.

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
        from lagrange_cli.studies.path.find import find_paths

        written = written_end(*start), written_end(*end)
        models = self.path_models()
        ends = read_ends(*written, models.motion.coordinates, lambda: self.loaded().scene)
        return partial(find_paths, models, *ends, cache=self.workspace.cache)

    def tradeoff(self, model: Model, **options: Any) -> Trade:
        """Measure speed against accuracy of the motions of :meth:`model`.

        Options and errors are those of :func:`.studies.tradeoff.measure.trade`.
        """
        from lagrange_cli.studies.tradeoff.measure import trade

        return trade(model, cache=self.workspace.cache, **options)

    def stress(self, **options: Any) -> Stress:
        """Push parameters and the start to extremes, and compare results with references.

        Options and errors are those of :func:`.studies.stress.measure.stress`.
        """
        from lagrange_cli.studies.stress.measure import stress

        return stress(self.recipe(), **options)

    def recorded_files(self) -> Iterator[str]:
        """Yield the paths of recorded inputs. Scenes name them by the key ``file``, perhaps
        escaped: others are not read for it."""
        if b"file" in self.source.data or b"\\" in self.source.data:
            for entry in self.loaded().scene.inputs:
                if entry.recording is not None:
                    yield entry.recording.path


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

        scene = self.scene
        values = [sorted(texts.items()) for texts in (member.parameters, member.initial)]
        outputs = [*(r.text for r in scene.reductions), self.section and self.section.text]
        question = [*scene.values, *values, scene.forces, scene.formulation, outputs]
        return bool(scene.answer("members", question, work))


def answer_of(derivation: Derivation, value: Any, *, lasting: bool = True) -> Answer:
    """Return an answer with the warnings and remarks of its derivation."""
    known = derivation.equations.derivation
    return Answer(value, known.warnings, known.remarks, lasting)
