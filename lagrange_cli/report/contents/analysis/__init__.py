"""Results of an analysis as text of the terminal and as documents.

An :class:`~lagrange_cli.analysis.values.Analysis` goes in; a page or a file comes out.
Read :mod:`.documents` first: it has the sections in their order, which the terminal and documents
both print.
"""
