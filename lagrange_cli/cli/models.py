"""Derivation and model of a scene for the commands: the Python interface, with its remarks told."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.remembered import Answer, SceneSource, remembered
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from lagrange_cli.api import Derivation, LoadedScene
    from lagrange_cli.cli.session import Session
    from lagrange_cli.mechanics.step_values import Way
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.simulate.ensemble.plan.recipe import MemberValues, Recipe
    from lagrange_cli.simulate.model.model import Model
    from lagrange_cli.simulate.model.requested_outputs import Reduction, WrittenCondition
    from lagrange_cli.simulate.options import SimulationOptions
    from lagrange_cli.studies.path.models import PathModels
    from lagrange_cli.studies.section.members import SectionModel


@dataclass(frozen=True)
class SceneRequest:
    """A scene, and what the options of a command say of it.

    Attributes
    ----------
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
    """

    source: SceneSource
    parameters: Mapping[str, str]
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

    def recipe(self) -> Recipe:
        """Return the same for runs of many models."""
        from lagrange_cli.scene import SceneText
        from lagrange_cli.simulate.ensemble.plan.recipe import Recipe

        texts = self.parameters, self.initial, self.times
        text = SceneText(self.source.file, self.source.data, *texts)
        return Recipe(text, self.forces, self.formulation, reductions=self.reductions)


@dataclass(frozen=True)
class SimulationRequest:
    """The options of ``lagrange simulate``, for one motion or all members of an ensemble.

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
    as_json
        True if the report is JSON.
    """

    scene: SceneRequest
    options: SimulationOptions
    columns: tuple[str, ...]
    output: str | None
    plot: str | None
    plot_of: str | None
    as_json: bool


def derivation_of_scene(
    session: Session,
    scene: SceneRequest,
    digits: int = 30,
    when_read: Callable[[LoadedScene], None] = lambda loaded: None,
) -> Derivation:
    """Derive a scene for a command; its warnings and remarks go to stderr.

    ``when_read`` is called with the scene before it is derived.
    """
    from lagrange_cli.api import loads

    started = perf_counter()
    announce("reading the scene")
    # Reading imports no mathematics: a mistake in the scene is answered at once.
    loaded = loads(
        scene.source.data,
        file=scene.source.file,
        parameters=scene.parameters,
        initial=scene.initial,
        times=scene.times,
    )
    when_read(loaded)
    derivation = loaded.derive(
        digits=digits,
        forces=scene.forces,
        formulation=scene.formulation,
        steps=scene.steps,
        cache=session.cache,
    )
    announce("")
    session.tell(derivation.equations.derivation.warnings, derivation.equations.derivation.remarks)
    session.detail(f"derived and certified in {perf_counter() - started:.2f} s")
    return derivation


def model_of_scene(session: Session, scene: SceneRequest) -> Model:
    """Return the model of a scene, kept from before or derived anew.

    Within :func:`.compilations_ahead` the integrators are compiled while a scene is derived (the
    number of its coordinates is nearly always that of the equations) and the model while what
    runs it is imported.
    """

    def compile_integrators(loaded: LoadedScene) -> None:
        coordinates = loaded.scene.coordinates
        if coordinates is not None:
            from lagrange_cli.simulate.system.library_sources import stepping_source
            from lagrange_cli.simulate.toolchain.shared_library import compile_ahead

            number = len(coordinates) * (1 + len(scene.sensitivity))
            compile_ahead(stepping_source(number), session.cache)

    def work() -> Answer:
        from lagrange_cli.simulate.system.library_sources import system_source
        from lagrange_cli.simulate.toolchain.shared_library import compile_ahead

        derivation = derivation_of_scene(session, scene, when_read=compile_integrators)
        announce("preparing the simulation")
        if scene.reductions:
            from lagrange_cli.simulate.model.build import model_of

            model = model_of(scene.recipe().prepared(derivation.equations))
        else:
            model = derivation.model(scene.sensitivity, extra=scene.extra)
        compile_ahead(system_source(model.code), session.cache)
        return answer_of(derivation, model.to_json())

    texts = [reduction.text for reduction in scene.reductions]
    asked = [scene.forces, scene.formulation, scene.sensitivity, scene.extra, texts]
    question = [*scene.values, *asked]
    value = remembered(session, "simulate", scene.source, question, work)
    from lagrange_cli.simulate.model.model import Model

    return Model.from_json(value)


def section_model_of_scene(
    session: Session, scene: SceneRequest, condition: WrittenCondition
) -> SectionModel:
    """Return what a section of a scene is found with, kept from before or derived anew."""

    def work() -> Answer:
        from lagrange_cli.studies.section.members import section_model

        derivation = derivation_of_scene(session, scene)
        announce("preparing the section")
        return answer_of(derivation, section_model(derivation.equations, condition).to_json())

    question = [*scene.values, scene.formulation, condition.text]
    value = remembered(session, "section", scene.source, question, work)
    from lagrange_cli.studies.section.members import SectionModel

    return SectionModel.from_json(value)


@dataclass(frozen=True)
class RememberedMembers:
    """Models of members of an ensemble, kept in the cache.

    Attributes
    ----------
    session
        Has the cache.
    scene
        The scene of all members.
    model
        Returns the model of a scene, with the values of one member.
    section
        Condition whose values are further outputs of the models; None if there is none.
    """

    session: Session
    scene: SceneRequest
    model: Callable[[SceneRequest], Model]
    section: WrittenCondition | None = None

    @property
    def recipe(self) -> Recipe:
        """The scene, and what options say of all members."""
        return replace(self.scene.recipe(), section=self.section)

    def model_of(self, member: MemberValues) -> Model:
        """Return the model of a member."""
        parameters = {**self.scene.parameters, **member.parameters}
        initial = {**self.scene.initial, **member.initial}
        return self.model(replace(self.scene, parameters=parameters, initial=initial))

    def differ_in_numbers(self, member: MemberValues, model: Model) -> bool:
        """Tell if members differ from the model of one of them in numbers alone."""

        def work() -> Answer:
            from lagrange_cli.simulate.ensemble.plan.variants import differ_in_numbers

            return Answer(differ_in_numbers(self.recipe, member, model))

        scene = self.scene
        values = [sorted(texts.items()) for texts in (member.parameters, member.initial)]
        outputs = [*(r.text for r in scene.reductions), self.section and self.section.text]
        question = [*scene.values, *values, scene.forces, scene.formulation, outputs]
        return bool(remembered(self.session, "members", scene.source, question, work))


def path_models_of_scene(session: Session, scene: SceneRequest) -> PathModels:
    """Return what paths of a scene are found with, kept from before or derived anew."""

    def work() -> Answer:
        derivation = derivation_of_scene(session, scene)
        announce("preparing the search")
        return answer_of(derivation, derivation.path_models().to_json())

    value = remembered(session, "path", scene.source, [*scene.values, scene.formulation], work)
    from lagrange_cli.studies.path.models import PathModels

    return PathModels.from_json(value)


def answer_of(derivation: Derivation, value: Any, *, lasting: bool = True) -> Answer:
    """Return an answer with the warnings and remarks of its derivation."""
    return Answer(
        value,
        derivation.equations.derivation.warnings,
        derivation.equations.derivation.remarks,
        lasting,
    )
