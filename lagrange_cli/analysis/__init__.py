"""What a course does with equations of motion once it has them, and a controller's designer.

Certified :class:`~lagrange_cli.mechanics.equations.Equations` go in; symmetries, equilibria,
linear systems, modes and other forms of the equations come out, as frozen values. Nothing is
found unless it is asked for. Read :mod:`.analyze` first; :mod:`.symmetries` has Noether's theorem.
"""

__all__ = [
    "analyze",
    "brackets",
    "branch_values",
    "constants_of_motion",
    "energies",
    "frequency_response",
    "hamiltonian",
    "legendre",
    "momenta",
    "phrases",
    "response_values",
    "routhian",
    "small_oscillations",
    "symmetries",
    "values",
    "verdicts",
]
