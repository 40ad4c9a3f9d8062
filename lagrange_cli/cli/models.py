"""Derivation and model of a scene for the commands: the Python interface, with what is told."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING, Any

from lagrange_cli.cli.remembered import Answer, SceneSource, remembered
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lagrange_cli.api import Derivation
    from lagrange_cli.cli.session import Session
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.simulate.model.model import Model


def derivation_of_scene(
    session: Session,
    source: SceneSource,
    *,
    parameters: Mapping[str, str],
    initial: Mapping[str, str] | None = None,
    times: Mapping[str, str] | None = None,
    **options: Any,
) -> Derivation:
    """Derive a scene for a command; its warnings and remarks go to stderr.

    ``options`` are those of :meth:`lagrange_cli.api.LoadedScene.derive`.
    """
    from lagrange_cli.api import loads

    started = perf_counter()
    announce("reading the scene")
    # Reading imports no mathematics: a mistake in the scene is answered at once.
    scene = loads(
        source.data, file=source.file, parameters=parameters, initial=initial, times=times
    )
    derivation = scene.derive(**options)
    announce("")
    session.tell(derivation.equations.warnings, derivation.equations.remarks)
    session.detail(f"derived and certified in {perf_counter() - started:.2f} s")
    return derivation


def model_of_scene(
    session: Session,
    source: SceneSource,
    *,
    parameters: Mapping[str, str],
    initial: Mapping[str, str],
    times: Mapping[str, str],
    forces: bool,
    formulation: Formulation | None,
) -> Model:
    """The model of a scene: that of before, or derived anew."""

    def work() -> Answer:
        values = {"parameters": parameters, "initial": initial, "times": times}
        derivation = derivation_of_scene(
            session, source, **values, forces=forces, formulation=formulation
        )
        announce("preparing the simulation")
        value = derivation.model().to_json()
        return Answer(value, derivation.equations.warnings, derivation.equations.remarks)

    given = [sorted(given.items()) for given in (parameters, initial, times)]
    asked = [*given, forces, formulation]
    value = remembered(session, "simulate", source, asked, work)
    from lagrange_cli.simulate.model.model import Model

    return Model.from_json(value)
