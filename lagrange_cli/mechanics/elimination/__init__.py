"""Elimination of names by equations, in the order of a calculation by hand.

Definitions and constraints go in; names as functions of the others come out, with the equations
that nothing could be solved for. Read :mod:`.eliminate` first.
"""

__all__ = ["branches", "eliminate", "implicitization", "solve_equation"]
