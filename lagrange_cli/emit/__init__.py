"""Equations → text: C, Python, LaTeX, sketches, the terminal's text, JSON.

Equations go in; file names with their text come out. The contract of a format is in :mod:`.base`,
the list of formats in :mod:`.registry`; read these two first.
"""

__all__ = ["base", "document_options", "json_report", "registry", "template_files", "text"]
