"""Results of an analysis as text of the terminal and as documents.

An :class:`~lagrange_cli.analysis.values.Analysis` goes in; a page or a file comes out.
Read :mod:`.text` first: it has the parts in the order in which they are printed.
"""
