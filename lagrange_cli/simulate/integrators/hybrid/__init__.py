"""Motions in smooth pieces: contacts that open and close, kinks that are crossed, samples.

A right-hand side for each mode goes in; one run comes out, whose pieces end at located events (A.
F. Filippov, *Differential Equations with Discontinuous Righthand Sides*, 1988). Read
:mod:`.motion`, then :mod:`.contact_motion` and :mod:`.surface_motion`; :mod:`.meeting` decides
how a motion goes on from kinks that meet. :mod:`.sampled_motion` is around them.
"""

__all__ = [
    "contact_motion",
    "contact_system",
    "meeting",
    "motion",
    "sampled_motion",
    "surface_motion",
]
