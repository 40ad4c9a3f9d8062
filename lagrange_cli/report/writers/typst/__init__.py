"""Equations as Typst: a complete document.

Sections of :mod:`lagrange_cli.report.contents.derivation` go in; a document that compiles comes
out. Read :mod:`.document` first.
"""
