"""The phrase catalogue: sentences between formulas in English, German and French.

A language goes in; phrases come out, without markup of a format. English
phrases stand in the code that says them and are the keys of the catalogues ``de.yaml`` and
``fr.yaml``, which have a translation of each. Read :mod:`.language` first.
"""

__all__ = ["language"]
