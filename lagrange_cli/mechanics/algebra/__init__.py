"""Rewriting of expressions: expanded, collected and shortened as in a textbook.

Expressions go in and equal expressions come out, in work that is bounded by a count of terms
beforehand. Read :mod:`.collect` first.
"""

__all__ = [
    "alpha_equivalence",
    "arithmetic",
    "collect",
    "derivatives",
    "energies",
    "factor",
    "identities",
    "polynomials",
    "printed_length",
    "rate_sums",
    "shared_products",
    "shorten",
    "shortest",
    "substitution",
    "trig_polynomials",
]
