"""Paths of stationary action between two configurations at two times.

Models of a motion and of its Jacobi fields go in; solutions of the two-point problem come out,
each with its action, its kind, and how near its motion comes to the other end. Read :mod:`.find`
first.
"""

__all__ = ["ends", "find", "measure", "models", "result", "scan"]
