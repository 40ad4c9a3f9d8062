"""Printers of display trees, one a language of formulas: Unicode, LaTeX, Typst, MathML.

A tree goes in, pieces between which a line may be broken come out; printers decide nothing about
order. Read :mod:`.one_line` first, on which those of the terminal and of scenes rest, and
:mod:`.typeset`, on which the others do.
"""

__all__ = ["latex", "mathml", "one_line", "scene", "typeset", "typst", "unicode"]
