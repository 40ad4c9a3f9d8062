"""The numbers that are stored of each motion: extrema, means, first times, values at the end.

Samples of motions go in; numbers with estimates of their errors, and maps of these over a plane,
come out. Read :mod:`.selection` first.
"""

__all__ = ["plane_map", "selection"]
