"""Progress of a run, its budget, and its state on disk.

The state of a run goes in, now and then; a file comes out from which a later process goes on bit
by bit. Read :mod:`.checkpoint` first.
"""

__all__ = ["checkpoint", "progress"]
