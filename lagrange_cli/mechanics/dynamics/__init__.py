"""Equations of motion of reduced coordinates.

A reduction goes in; mass matrix, forcing, closures and the equations as a textbook writes them
come out (d'Alembert's principle; Goldstein, Poole and Safko, *Classical Mechanics*, 3rd ed.,
section 1.4), with the configurations where the coordinates are singular. Read :mod:`.lagrange`
first.
"""

__all__ = [
    "accelerations",
    "element_motions",
    "euler_form",
    "idle_potentials",
    "jumps",
    "lagrange",
    "momenta",
    "potential_forces",
    "singular_configurations",
    "solve_exactly",
    "textbook_form",
]
