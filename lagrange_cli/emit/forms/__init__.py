"""Other forms of the equations of motion, as sections for every format that is read.

Equations and the name of a form go in; sections of words and labelled formulas come out, which text
and documents print in their letters. Read :mod:`.contents` first.
"""

__all__ = ["contents", "json_values", "writer"]
