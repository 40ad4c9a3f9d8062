"""The derivation as a person reads it in a terminal, in Unicode or plain ASCII.

Equations go in, a page of rows comes out. Read :mod:`.derivation` first: it has the sections in
order, each a function of the :class:`~.writer.TextWriter`.
"""

from lagrange_cli.report.writers.terminal.derivation import derivation_page, derivation_text

__all__ = ["derivation_page", "derivation_text"]
