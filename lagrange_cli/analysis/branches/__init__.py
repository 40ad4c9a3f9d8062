"""Branches of equilibria over a parameter.

A :class:`~lagrange_cli.analysis.equilibria.rest_system.RestSystem` and a range of one parameter go
in; curves of equilibria with folds, branch points, flutter and the stability of each part come out.
Begin with :mod:`.find`; :mod:`.continuation` follows one branch by pseudo-arclength (H. B. Keller
1977), :mod:`.singular_points` locates folds and branch points in digits (W. Govaerts, Numerical
Methods for Bifurcations of Dynamical Equilibria, 2000), :mod:`.stability` decides stability.
"""

__all__ = ["find", "parameter", "values"]
