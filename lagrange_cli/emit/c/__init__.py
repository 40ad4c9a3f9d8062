"""Equations as C99: a header, a source file, and on request a main.

Equations and a number type go in; text that needs only <math.h> comes out. Read :mod:`.module`
first; the other modules write one group of functions each.
"""

__all__ = ["body", "constraints", "module", "solvers", "target"]
