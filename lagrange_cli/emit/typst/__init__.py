"""Equations as Typst: a document, or the equations alone.

Sections of :mod:`lagrange_cli.emit.document` go in; a file that Typst compiles by itself comes
out. Read :mod:`.document` first.
"""

__all__ = ["document"]
