"""Routines that functions call: solvers of equations, projection, contacts, recorded inputs.

They are written once, in the part of Python that every language has
(:mod:`lagrange_cli.emit.routines.translation` tells which): arguments with types, integers that are
never negative, arrays that are indexed by one number and handed over whole. They run as they are
and are translated from their source. A solver overwrites its arguments, puts the solution in place
of the right-hand side, and returns whether there is one. Read ``elimination`` first.
"""

__all__ = ["impacts", "numbers", "projection", "registry"]
