"""How a program solves M a = f and what stands beside it.

The zero pattern of M and of the closures goes in; blocks, an order and a factorization come out
(Ng, Peyton, *SIAM J. Sci. Comput.* 14 (1993) 1034). Read :mod:`.blocks` first.
"""

__all__ = ["bandwidth", "blocks", "sparse_factorization"]
