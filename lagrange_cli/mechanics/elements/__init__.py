"""Elements that carry mass: a particle, a rigid body.

Symbols of a particle or body go in; an element comes out, with the places whose motion it follows,
its constants, its kinetic energy, and the forces of its inertia by Newton's and Euler's laws, which
the certificate compares with what was derived by another route. :mod:`.motion` has the motions that
equations hold, :mod:`.tree` the frames that bodies stand on. Read :mod:`.particle` first.
"""

__all__ = ["body", "motion", "particle", "tree"]
