"""A scene at its extremes: where results hold, are refused, or degrade.

A scene goes in; points at extreme values come out, each with what became of it. Read
:mod:`.measure` first.
"""

__all__ = ["measure", "points", "runs"]
