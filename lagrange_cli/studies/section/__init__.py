"""Poincaré sections: the points at which motions meet a condition on the state or the time.

A model whose outputs include the condition goes in; points come out, each with the estimate of its
error, and the times at which their number is open (H. Poincaré, *Les méthodes nouvelles de la
mécanique céleste* III, 1899, chapter 27; M. Hénon, On the numerical computation of Poincaré maps,
Physica D 5 (1982) 412). Read :mod:`.find` first.
"""

__all__ = ["members", "result"]
