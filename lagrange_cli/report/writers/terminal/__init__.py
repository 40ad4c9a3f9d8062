"""Sections as a person reads them in a terminal, in Unicode or plain ASCII.

Sections go in, rows of a page come out: :mod:`.sections` writes those of derivations, boards and
their blocks, :mod:`.results` those of analyses. Read :mod:`.sections` first.
"""
