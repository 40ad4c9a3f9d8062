"""Results of an analysis as text of the terminal, as documents, and as JSON.

An :class:`~lagrange_cli.analysis.values.Analysis` goes in; a page, a file or JSON values come out.
Read :mod:`.text` first: it has the parts in the order in which they are printed.
"""

__all__ = ["documents", "report", "text"]
