"""The phrase catalogue: sentences between formulas in English, German and French.

Values of mechanics and a language go in; phrases come out, without markup of a format. English
phrases stand in the code that says them; :mod:`.german` and :mod:`.french` have a translation of
each. Read :mod:`.language` first.
"""

__all__ = ["equations", "families", "forces", "labels", "language"]
