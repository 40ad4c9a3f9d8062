"""Equilibria and steady motions of a system.

Equations of motion and the held values of inputs go in; configurations in which the system can stay
at rest come out, in closed form where equations can be solved one after the other, and else as
numbers of 30 digits with the count of starts that led to them. Read :mod:`.rest_system` first,
which writes the equations of equilibrium (virtual work: H. Goldstein, C. Poole and J. Safko,
Classical Mechanics, 3rd ed., section 1.4); :mod:`.closed_forms` and :mod:`.search` solve them.
:mod:`.release` drops those that only a singular chart makes. :mod:`.steady` asks the same of
Routh's equations, :mod:`.steady_rates` of Voronets'; :mod:`.state_coordinates` makes states of
first order coordinates of equations at rest.
"""

__all__ = [
    "closed_forms",
    "configuration",
    "laws",
    "parameter_relations",
    "release",
    "repeats",
    "rest_functions",
    "rest_system",
    "search",
    "single_equation",
    "state_coordinates",
    "steady",
    "steady_rates",
]
