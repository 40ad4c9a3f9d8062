"""What a derivation holds, for the classes that its methods are in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from lagrange_cli.mechanics.equations import Equations
    from lagrange_cli.scene.conditions import Formulation
    from lagrange_cli.scene.reader import SceneText


@dataclass(frozen=True)
class Derived:
    """Certified equations and where they came from.

    Attributes
    ----------
    equations
        The equations, with all that is known of the system.
    source
        The scene's text, with the values that were derived.
    formulation
        The formulation that was asked for; where it was the program's choice, a simulation may
        take the other one at singular configurations.
    forces
        Constraint forces were derived.
    """

    equations: Equations
    source: SceneText
    formulation: Formulation = "auto"
    forces: bool = False
