"""Values, derivatives and ranks of expressions, in high precision.

SymPy expressions go in and become straight-line code, evaluated in decimal digits or doubles with
derivatives; out come feasible configurations, Newton and least-squares steps, and numerical ranks
at them. Read :mod:`.autodiff`, then :mod:`.sampling`.
"""

__all__ = [
    "autodiff",
    "bounded_functions",
    "constraint_manifold",
    "elementary",
    "gauss_newton",
    "rank",
    "sampling",
]
