"""Rewriting of expressions: expanded, collected and shortened as in a textbook.

Expressions go in and equal expressions come out, in work that is bounded by a count of terms
beforehand. Read :mod:`.collect` first.
"""

__all__ = [
    "alpha_equivalence",
    "collect",
    "derivatives",
    "energies",
    "expand",
    "factor",
    "group_by_velocity",
    "identities",
    "plain_products",
    "plain_sums",
    "polynomials",
    "positive_roots",
    "printed_length",
    "shared_products",
    "shorten",
    "shortest",
    "substitution",
    "templates",
    "trig_polynomials",
]
