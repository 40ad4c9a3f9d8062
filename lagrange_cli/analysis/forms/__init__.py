"""Other forms of the equations of motion: Hamilton's and Routh's, and Poisson brackets.

Equations of motion go in; H with the canonical equations, R with the reduced equations, the
bracket of two functions, or equations over independent velocities (:mod:`.voronets`) come out, each
certified at random states (:mod:`.certificate`) before anything is shown. Read :mod:`.hamiltonian`
first; :mod:`.legendre` solves momenta for velocities (H. Goldstein, C. Poole and J. Safko,
Classical Mechanics, 3rd ed., chapters 8 and 9).
"""

__all__ = ["brackets", "hamiltonian", "legendre", "momenta", "routhian", "voronets"]
