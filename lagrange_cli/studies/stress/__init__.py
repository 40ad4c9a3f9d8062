"""A scene at its extremes: which results hold, are refused, or degrade.

A scene goes in; points at extreme values come out, each with its outcome. Read
:mod:`.measure` first.
"""

__all__ = ["measure", "points", "runs"]
