"""Equations as LaTeX: a document, a snippet, single equations, formulas of Markdown.

Sections of :mod:`.emit.document` go in; LaTeX that needs amsmath, and for documents booktabs,
comes out. Read :mod:`.equations` first.
"""

__all__ = ["equations", "markdown"]
