"""Equations as LaTeX: a document, frames, a snippet, single equations.

Sections of :mod:`lagrange_cli.report.contents.derivation` go in; LaTeX that needs amsmath, and for
documents booktabs, comes out. Read :mod:`.document` first.
"""
