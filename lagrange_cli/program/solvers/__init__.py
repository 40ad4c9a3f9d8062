"""Solution of M a = f and of closures beside it, in blocks.

The zero pattern of M and of the closures goes in; blocks, an order and a factorization come out
(Ng, Peyton, *SIAM J. Sci. Comput.* 14 (1993) 1034). Derivatives of accelerations and of motions are
further right-hand sides of them. Trees of bodies are solved from their ends inwards
(:mod:`.articulated_bodies`). Read :mod:`.blocks` first.
"""

__all__ = [
    "articulated_bodies",
    "blocks",
    "composite_bodies",
    "jacobians",
    "sensitivities",
    "sparse_factorization",
    "tolerances",
]
