"""Numbers that decide when an elimination is refined and how an impact is resolved."""

from __future__ import annotations

#: Elimination that leaves less than this part of an inertia calls for refinement.
UNEVEN_PIVOT = 2.0**-8

#: An inertia below this part of the largest, with products of inertia, does so too.
LEAST_INERTIA = 2.0**-100

#: The largest exponent of inertia over gradient squared (a gradient may be as small as rounding
#: leaves it).
LARGEST_EXPONENT = 100

#: Steps of the search for pushes, times one more than there are contacts.
COMPLEMENTARITY_STEPS = 64

#: Rates below this part of the magnitudes they are the sum of are zero (more in a short type).
RATE_TOLERANCE = 1e-12

#: A rate after an impact may differ by as many tolerances from what it should be.
IMPACT_TOLERANCES = 1000.0

#: Events in one step after which bounces are ended.
MOST_REBOUNDS = 50

#: Events in one step after which the run is ended.
MOST_EVENTS_A_STEP = 1000
