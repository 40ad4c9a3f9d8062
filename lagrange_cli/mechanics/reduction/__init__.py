"""From Cartesian components and constraints to generalized coordinates.

A scene goes in; what comes out is a :class:`~.reduce.Reduced`, in which every component is a
function of q and t, closures stand for what has no closed form, and an account says what each
constraint contributes. Integrability follows Frobenius (Bloch, *Nonholonomic Mechanics and
Control*, 2nd ed. 2015, section 2.4). Read :mod:`.reduce` first.
"""

__all__ = ["cartesian_form", "geometry", "no_minimal_form", "reduce"]
