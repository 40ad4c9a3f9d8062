"""Motions past singular configurations of a scene's coordinates.

A simulation that meets one goes in; one in Cartesian coordinates with multipliers, or by
quaternions, comes out, read in the scene's coordinates. Read :mod:`.simulation` first, then
:mod:`.passages`.
"""

__all__ = ["simulation"]
