"""One function of many tasks, on the workers of a user's Dask cluster.

The function travels once, with all that it needs; tasks are small and so are their results. Workers
that run other versions than this process are refused before anything is run. Lost workers are
Dask's to replace: their tasks are run again by others. No scheduler is started here. Read
:mod:`.tasks` first.
"""

__all__ = ["tasks", "workers"]
