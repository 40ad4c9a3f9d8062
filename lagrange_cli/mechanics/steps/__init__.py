"""The steps of a derivation, line by line as on a lecturer's board.

A certified derivation goes in; positions, their rates by the chain rule, generalized forces, and
Lagrange's equations or d'Alembert's principle part by part come out, each line compared with the
derivation by automatic differentiation (Goldstein, Poole and Safko, *Classical Mechanics*, 3rd
ed., sections 1.4 and 1.5). Read :mod:`.derive_steps` first.
"""

__all__ = ["derive_steps"]
