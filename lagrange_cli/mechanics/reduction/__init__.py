"""From Cartesian components and constraints to generalized coordinates.

A scene goes in; a :class:`~.reduced_scene.Reduced` comes out, in which every component is a
function of q and t, closures stand for equations without a solution in closed form, and an account
says how many degrees of freedom each constraint takes. Integrability follows Frobenius (Bloch,
*Nonholonomic Mechanics and Control*, 2nd ed. 2015, section 2.4). Read :mod:`.reduce` first.
"""

__all__ = [
    "cartesian_form",
    "geometry",
    "no_minimal_form",
    "reduce",
    "reduced_scene",
]
