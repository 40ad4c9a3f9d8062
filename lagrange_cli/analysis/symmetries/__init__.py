"""Symmetries of a Lagrangian and conserved quantities.

Equations of motion go in; linear symmetries with the quantities that Noether's theorem makes of
them come out (E. Noether, Invariante Variationsprobleme, Nachr. Ges. Wiss. Göttingen 1918, 235),
and energies with what they are lost to. Read :mod:`.linear_symmetries` first;
:mod:`.rigid_displacements` recognizes translations, rotations and boosts among them.
"""

__all__ = [
    "angular_momentum",
    "conserved_quantities",
    "linear_symmetries",
    "starting_values",
]
