"""Equations as LaTeX: a document, frames, a snippet, single equations, formulas of Markdown.

Sections of :mod:`lagrange_cli.emit.document` go in; LaTeX that needs amsmath, and for documents
booktabs, comes out. Read :mod:`.document` first.
"""

__all__ = ["document", "markdown"]
