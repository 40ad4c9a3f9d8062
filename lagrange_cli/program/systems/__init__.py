"""The functions of a program for closures, contacts and large systems.

Equations go in; systems to solve and expressions to evaluate come out, as loops where many are of
one shape. Projection onto closures follows Hairer, Lubich, Wanner, *Geometric Numerical
Integration*. Read :mod:`.constraint_systems` first.
"""

__all__ = [
    "agreement",
    "constraint_systems",
    "contact_systems",
    "direct_derivation",
    "large_systems",
    "loop_rolling",
    "loops",
]
