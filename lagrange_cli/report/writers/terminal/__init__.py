"""Sections as a person reads them in a terminal, in Unicode or plain ASCII.

Sections go in, rows of a page come out: :mod:`.sections` writes those of derivations, boards and
their blocks, :mod:`.results` those of analyses. Read :mod:`.derivation` first.
"""

from lagrange_cli.report.writers.terminal.derivation import derivation_page, derivation_text

__all__ = ["derivation_page", "derivation_text"]
