"""Equations → Program: straight-line code and loops that any language prints.

Equations go in; what comes out is a :class:`~.program.Program`, whose statements share what is
equal, whose linear systems are taken apart, and which names nothing after the scene. No language
is known here. Read :mod:`.program` first.
"""

__all__ = ["constraint_programs", "index_tables", "printing", "program"]
