"""Numbers that decide when an elimination is refined, in all languages."""

from __future__ import annotations

#: Elimination that leaves less than this part of an inertia calls for refinement.
UNEVEN_PIVOT = 2.0**-8

#: An inertia below this part of the largest, with products of inertia, does so too.
LEAST_INERTIA = 2.0**-100

#: The largest exponent of inertia over gradient squared (a gradient may be as small as rounding
#: leaves it).
LARGEST_EXPONENT = 100
