"""The promise of ``--accuracy``, kept by measuring.

A problem goes in; a run comes out with an estimate of its error from companion runs, looser and
with rounding errors to order (Vignes, *Math. Comput. Simul.* 35 (1993) 233). Read
:mod:`.controller`, then :mod:`.attempt`.
"""

__all__ = [
    "coarse_run",
    "controller",
    "error_estimate",
    "event_agreement",
    "measured",
    "method_selection",
    "tuning",
    "user_method",
]
