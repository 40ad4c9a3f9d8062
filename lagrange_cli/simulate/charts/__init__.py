"""Motions past places where the coordinates of a scene are singular.

A simulation that meets such a place goes in; one in Cartesian coordinates with multipliers comes
out, read in the scene's coordinates. Read :mod:`.simulation` first.
"""

__all__ = ["simulation"]
