"""Checks of a derivation by routes that share nothing with it.

Derived equations go in; their distances from Newton's law and from Lagrange's equations at random
states, in high precision, come out, or an internal error. Nothing uncertified is shown.
Read :mod:`.certificate` first.
"""

__all__ = ["certificate", "constraints", "facts", "printed", "routes"]
