"""Witnesses against a finished motion, whatever its estimate says.

Samples go in; what comes out is the drift of energy and constraints, what a contact did, whether
another motion may follow, and from when on the result is disproved. Read :mod:`.disproof` first.
"""

__all__ = ["branching", "contact_history", "disproof", "drifts", "uniqueness"]
