"""The model that a section is found with, and what is known of the section before any run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.simulate.model.requested_outputs import WrittenCondition


@dataclass(frozen=True)
class SectionModel:
    """A model whose outputs include the condition of a section.

    Attributes
    ----------
    condition
        As it was written.
    model
        The model.
    free, turning
        As in :class:`.result.Section`.
    """

    condition: str
    model: Model
    free: tuple[str, ...]
    turning: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return values that JSON holds."""
        return {**vars(self), "model": self.model.to_json()}

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> SectionModel:
        """Make what :meth:`to_json` gave."""
        known = (tuple(value[name]) for name in ("free", "turning"))
        return cls(value["condition"], Model.from_json(value["model"]), *known)


def section_model(equations: Equations, condition: WrittenCondition) -> SectionModel:
    """Make the model of a section of the motions of equations.

    Raises
    ------
    InputError
        As :func:`.simulate.model.requested_outputs.with_section`.
    """
    from lagrange_cli.simulate.model.build import model_of
    from lagrange_cli.simulate.model.requested_outputs import (
        free_coordinates,
        turning_coordinates,
        with_section,
    )

    return SectionModel(
        condition.text.strip(),
        model_of(with_section(equations, condition)),
        free_coordinates(equations, condition),
        turning_coordinates(equations),
    )
