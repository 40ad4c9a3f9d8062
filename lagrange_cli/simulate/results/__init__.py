"""The result of a simulation: its columns, files, pictures and status.

Samples and measured errors go in; a frozen trajectory comes out, or files written window by
window. Read :mod:`.trajectory` first.
"""

__all__ = ["columns", "curves", "formats", "outcome", "picture", "plot", "streaming", "trajectory"]
