"""Equations as a Python module that needs only NumPy.

Equations go in; the text of a module with one function a quantity comes out, runnable as a
script. Read :mod:`.module` first.
"""

__all__ = ["module"]
