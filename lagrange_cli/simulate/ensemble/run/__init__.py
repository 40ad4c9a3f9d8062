"""The runs of an ensemble's members, block by block.

A plan, its blocks and a store go in; the store has every block afterwards. Members are stepped
side by side where that is possible (:mod:`.batched`) and one by one otherwise, on the cores of this
machine or on a cluster. Read :mod:`.run` first.
"""

__all__ = ["cluster", "run"]
