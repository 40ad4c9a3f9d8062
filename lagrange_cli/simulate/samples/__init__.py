"""Samples of runs, in memory or in a file.

Times and states go in, part by part; reading gives them back in the same way, wherever they are.
Read :mod:`.rows` first.
"""

__all__ = ["buffer", "rows"]
