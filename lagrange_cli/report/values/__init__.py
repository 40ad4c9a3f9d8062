"""Derivations and analyses as JSON values.

Equations or an analysis go in, dictionaries that JSON can hold come out; expressions are in the
scene language. Read :mod:`.derivation` first.
"""
