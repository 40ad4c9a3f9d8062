"""Reports of values: what a person reads of each, and its JSON.

In go the values that the rooms below work out (a derivation, an analysis, a trajectory, the
outcomes of a check), out come texts; nothing is computed here and nothing is printed. Read
:mod:`.tree` first, the parts that all documents are made of; :mod:`.contents` says what a report
holds, :mod:`.writers` print it, :mod:`.phrases` has its sentences in every language, and
:mod:`.values` its JSON.
"""

from lagrange_cli.notation.page import UNBROKEN, USUAL_WIDTH, Page, Paint, Role

__all__ = [
    "UNBROKEN",
    "USUAL_WIDTH",
    "Page",
    "Paint",
    "Role",
    "contents",
    "document_options",
    "formats",
    "tables",
    "tree",
]
