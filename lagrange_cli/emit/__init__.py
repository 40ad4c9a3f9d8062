"""Equations → code: C, Python.

Equations go in; file names with their text come out. The contract of a format, code or document,
is in :mod:`.base`; read it first.
"""

__all__ = ["base", "fixed_steps", "initial_state", "naming", "template_files"]
