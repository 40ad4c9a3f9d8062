"""Other forms of the equations as sections of words and formulas, which text and documents print.

Read :mod:`.contents` first.
"""
