"""Model → right-hand side and the other functions of a motion.

A model and values of its parameters go in; functions of t and y come out, compiled where there is
a compiler, else interpreted, with projections, events, inputs and rounding models. Read
:mod:`.functions` first.
"""

__all__ = [
    "contacts",
    "functions",
    "inputs",
    "library_sources",
    "linearization",
    "rounding",
    "singular_guard",
    "tables",
    "tracing",
]
