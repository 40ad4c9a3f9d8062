"""Equations → Program: straight-line code and loops that any language prints.

Equations go in; a :class:`~.program.Program` comes out. Its statements compute equal values once,
its linear systems are split into blocks, and none of its names is from the scene. No language is
known here. Read :mod:`.program` first.
"""

__all__ = ["emitted_functions", "kinds", "operations", "printing", "program"]
