"""Bodies on surfaces: ``touch`` and ``roll``, read and written out as equations.

:mod:`.surfaces` reads planes, spheres and cylinders, at rest or fixed in a frame; :mod:`.contacts`
the bodies that touch them or roll on them, and the equations that this stands for.
"""

__all__ = ["contacts"]
