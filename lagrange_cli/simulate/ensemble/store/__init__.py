"""The finished blocks of an ensemble, and the ensemble that they become.

Blocks of results go in, one by one; an :class:`~.result.Ensemble` in memory or in a file (NPZ,
Parquet, Zarr) comes out, and a run that was interrupted goes on from the blocks that it left. Read
:mod:`.store` first.
"""

__all__ = ["blocks", "opening", "result", "store"]
