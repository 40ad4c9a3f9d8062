"""Steps short enough for sharp forces, which may act between evaluations.

A right-hand side along a motion goes in; the longest step that passes nothing unseen comes out,
or a remark (discs: Petković and Petković, *Complex Interval Arithmetic and Its Applications*,
1998). Read :mod:`.analyticity` first.
"""

__all__ = ["analyticity", "peaks", "unwatched"]
