"""One initial value problem, and one integration of it.

A right-hand side, a start and sample times go in; samples and an account of the work come out,
with no statement about the error. Read :mod:`.problem` first.
"""

__all__ = ["problem", "run"]
