"""Constraint forces on particles, and the multipliers they come from.

Certified equations go in; forces f = m r̈ − F come out, compared with Newton's law before they
are kept. Read :mod:`.constraint_forces` first.
"""

__all__ = ["applied_forces", "constraint_forces"]
