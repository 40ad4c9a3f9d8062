"""Models of a two-point problem: the motion with its action, and with its Jacobi fields.

A motion without a Lagrangian, or with contacts, is refused: it makes no action stationary.

Jacobi fields are the derivatives of the motion by its initial velocities: they vanish at the
start, and solve Jacobi's equation, that of the second variation of the action. Their model is that
of the variational equations (:mod:`lagrange_cli.simulate.model.sensitivities`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from lagrange_cli.errors import InputError, Problem
from lagrange_cli.simulate.model.model import Model

if TYPE_CHECKING:
    from sympy import Expr

    from lagrange_cli.mechanics.equations import Equations


@dataclass(frozen=True)
class PathModels:
    """Models with which paths of one system are computed.

    Attributes
    ----------
    motion
        Model of the motion, whose outputs are those of :func:`with_action`.
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
            f"no path of stationary action for '{model.name}': its forces have kinks or jumps,"
            " across which paths are not varied"
        )
        raise InputError(Problem(message, rule="path"))


def with_action(equations: Equations) -> Equations:
    """Return equations whose outputs are L, momenta, and the mass matrix up to its diagonal.

    Raises
    ------
    InputError
        The motion is not that of stationary action, with the reason.
    """
    from lagrange_cli.mechanics.algebra.derivatives import derivative

    _require_action(equations)
    lagrangian = equations.system.lagrangian
    momenta = [derivative(lagrangian, c.v) for c in equations.system.coordinates]
    inertia = [
        derivative(p, c.v)
        for i, p in enumerate(momenta)
        for c in equations.system.coordinates[: i + 1]
    ]
    values: list[Expr] = [lagrangian, *momenta, *inertia]
    # No name of a scene has a blank.
    outputs = tuple((f"action {k}", value) for k, value in enumerate(values))
    return replace(equations, system=replace(equations.system, outputs=outputs))


def _require_action(equations: Equations) -> None:
    """Refuse systems whose motion makes no action stationary against fixed-end variations."""
    reason, hint = "", ""
    acting = [f.name for f in equations.system.forces if any(q != 0 for q in f.generalized)]
    if equations.system.states:
        reason = (
            f"the state '{equations.system.states[0].name}' moves by its rate: no action has it"
        )
    elif not equations.system.coordinates:
        reason = "nothing can move: there are no degrees of freedom"
    elif equations.system.dissipation != 0:
        reason = "there is dissipation, which has no potential: no action has its motion"
        hint = "set its coefficients to 0 by -p NAME=0, and leave it out of the scene"
    elif acting:
        reason = f"the force {_listed(acting)} has no potential: no action has its motion"
        hint = "write it as a potential if it has one"
    elif equations.system.controllers:
        reason = "a controller samples the motion: no action has what it holds"
    elif equations.system.contacts:
        reason = "paths are not varied across contacts, where velocities jump"
    elif any(c.kind == "velocity" for c in equations.system.closures):
        reason = (
            "a constraint between velocities cannot be integrated: paths that obey it beside the"
            " motion are no fixed-end variations, and the motion does not make the action"
            " stationary among them"
        )
    elif equations.system.closures:
        names = _listed([c.name for c in equations.system.closures])
        reason = f"{names} is kept beside the coordinates, which therefore do not vary freely"
        hint = "coordinates that solve the constraint, where there are some"
    if reason:
        message = f"no path of stationary action for '{equations.presentation.name}': {reason}"
        raise InputError(Problem(message, hint=hint, rule="path"))


def _listed(names: list[str]) -> str:
    return ", ".join(f"'{name}'" for name in names)


def periodic_coordinates(equations: Equations) -> tuple[bool, ...]:
    """Return for each coordinate if a whole turn of it is proven to leave L as it is."""
    from lagrange_cli.mechanics.proofs.zero_test import is_periodic

    return tuple(
        c.is_angle and is_periodic(equations.system.lagrangian, c.q)
        for c in equations.system.coordinates
    )
