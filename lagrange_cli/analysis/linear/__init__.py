"""Small motions near an equilibrium.

A :class:`~lagrange_cli.analysis.equilibria.rest_system.RestSystem` and one of its equilibria go in;
out come M, C, K and the state space, modes and poles, what is proven of stability, and frequency
responses. Read :mod:`.linearize` first, which eliminates dependent displacements (H. Goldstein, C.
Poole and J. Safko, Classical Mechanics, 3rd ed., chapter 6). :mod:`.stability` applies the theorems
of Lagrange and Dirichlet and of Lyapunov (J. L. Lagrange 1788, A. M. Lyapunov 1892).
"""

__all__ = ["first_order", "frequency_response", "linearize", "modes", "sampled_loop", "stability"]
