"""Studies of runs: references, trade-offs of work and precision, stress, fits.

A model goes in; tables of errors and seconds come out, measured against a solution of much higher
accuracy. Read :mod:`.reference` first.
"""

__all__ = ["effective_potential", "linear_motion", "lyapunov", "reference", "step_error"]
