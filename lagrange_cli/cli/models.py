"""The model of a scene, as the commands that integrate need it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from lagrange_cli.cli.derive import derived
from lagrange_cli.cli.remembered import Answer, Source, remembered
from lagrange_cli.stages import announce

if TYPE_CHECKING:
    from collections.abc import Mapping

    from lagrange_cli.cli.session import Session
    from lagrange_cli.scene.model import Formulation
    from lagrange_cli.simulate.model import Model

__all__ = ["model_of_scene"]


def model_of_scene(
    session: Session,
    source: Source,
    *,
    parameters: Mapping[str, str],
    initial: Mapping[str, str],
    times: Mapping[str, str],
    forces: bool,
    formulation: Formulation | None,
) -> Model:
    """The model of a scene: that of before, or derived anew."""

    def work() -> Answer:
        equations = derived(
            session,
            source,
            parameters=parameters,
            initial=initial,
            times=times,
            forces=forces,
            formulation=formulation,
        )
        from lagrange_cli.simulate.modelling import model_of

        announce("preparing the simulation")
        value = model_of(equations).to_json()
        return Answer(value, equations.warnings, equations.remarks)

    given = [sorted(given.items()) for given in (parameters, initial, times)]
    asked = [*given, forces, formulation]
    value = remembered(session, "simulate", source, asked, work)
    from lagrange_cli.simulate.model import Model

    return Model.from_json(value)
