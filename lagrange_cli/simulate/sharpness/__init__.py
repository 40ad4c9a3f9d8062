"""Sharp forces, which may act between the evaluations of a step.

A problem goes in; the same problem whose compiled integrators resolve peaks comes out, or a
remark where nothing watches for them. Read :mod:`.peaks` first.
"""

__all__ = ["peaks", "unwatched"]
