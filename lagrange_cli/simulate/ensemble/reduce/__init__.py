"""The numbers that are stored of each motion: extrema, means, first times, values at the end.

Samples of motions go in; numbers with bounds of their errors come out. Intervals of the time are
divided until interval arithmetic with Taylor series tells a number (R. E. Moore, R. B. Kearfott and
M. J. Cloud, *Introduction to Interval Analysis*, 2009). Read :mod:`.selection`, then
:mod:`.reductions`.
"""

__all__ = ["dense_motion", "selection"]
