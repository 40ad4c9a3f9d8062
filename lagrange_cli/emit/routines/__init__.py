"""Routines in the languages of emission, translated from their Python.

In goes a function of :mod:`lagrange_cli.program.lowered.routines`, out comes its text in a language
that is described by its :class:`~.syntax.Syntax`. Read ``translation`` first: it says which Python
is translated.
"""

__all__ = ["signatures", "syntax", "translation"]
