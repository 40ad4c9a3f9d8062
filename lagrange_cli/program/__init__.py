"""Equations → Program: straight-line code and loops that any language prints.

Equations go in; a :class:`~.program.Program` comes out. Its statements compute equal values once,
its linear systems are split into blocks, and none of its names is from the scene. No language is
known here. Read :mod:`.program` first.
"""

__all__ = [
    "canonical_programs",
    "constraint_programs",
    "derivative_programs",
    "index_tables",
    "operations",
    "printing",
    "program",
]
