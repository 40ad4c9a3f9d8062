"""Parameters and initial values from measurements: least squares over simulated motions.

A table of measurements and names go in; values with standard errors come out. Read :mod:`.fit`
first.
"""

__all__ = ["fit", "measurements", "result"]
