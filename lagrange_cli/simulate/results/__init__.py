"""The result of a simulation: its columns, files and status.

Samples and measured errors go in; a frozen trajectory comes out, or files written window by
window. Read :mod:`.trajectory` first.
"""

__all__ = ["columns", "formats", "outcome", "streaming", "trajectory"]
