"""Speed against accuracy: methods × tolerances on one scene.

A model and methods go in; errors, seconds and the Pareto front come out. Read :mod:`.measure`
first.
"""

__all__ = ["measure", "result", "runs"]
