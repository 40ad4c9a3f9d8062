"""Models of a two-point problem: the motion, and the motion with its Jacobi fields.

Jacobi fields are the derivatives of the motion by its initial velocities: they vanish at the
start, and solve Jacobi's equation, that of the second variation of the action. Their model is that
of the variational equations (:mod:`lagrange_cli.simulate.model.sensitivities`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.model.model import Model


@dataclass(frozen=True)
class PathModels:
    """What paths of one system are found with.

    Attributes
    ----------
    motion
        Model of the motion, whose outputs are those of :func:`.lagrangian.with_action`.
    jacobi
        The same with the derivatives by the n initial velocities as further coordinates, those by
        the first velocity first.
    periodic
        For each coordinate, True if L is proven to be the same a whole turn further.
    """

    motion: Model
    jacobi: Model
    periodic: tuple[bool, ...]

    def to_json(self) -> dict[str, Any]:
        """Return the models as values that JSON holds."""
        return {
            "motion": self.motion.to_json(),
            "jacobi": self.jacobi.to_json(),
            "periodic": list(self.periodic),
        }

    @classmethod
    def from_json(cls, value: Mapping[str, Any]) -> PathModels:
        """Make the models that :meth:`to_json` gave."""
        motion, jacobi = (Model.from_json(value[name]) for name in ("motion", "jacobi"))
        return cls(motion, jacobi, tuple(value["periodic"]))


def require_smooth(model: Model) -> None:
    """Refuse kinks, across which Jacobi's equation is not known.

    Raises
    ------
    InputError
        Forces have switching surfaces.
    """
    if model.surfaces:
        message = (
            f"no path of stationary action for '{model.name}': forces with abs, sign, min or max"
            " change by jumps, across which paths are not varied"
        )
        raise InputError(Problem(message, rule="path"))
