"""SymPy symbols for the names of a scene.

Syntax trees and declared names go in; SymPy expressions in independent symbols q, v, t come out,
with the values of parameters and the masses of particles. No text is evaluated. Read
:mod:`.convert` first.
"""

__all__ = [
    "convert",
    "inputs",
    "names",
    "quoting",
    "values",
    "written_sums",
]
