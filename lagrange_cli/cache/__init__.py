"""Results of earlier runs: a folder of verified files, found by the hash of their inputs.

Importing this room imports neither Click nor anything of mathematics, and takes milliseconds.

>>> key = digest("derive", fingerprint(), scene_bytes)
>>> cache = open_cache()
>>> text = cache.get(key)
>>> if text is None:
...     text = work_it_out(scene_bytes)
...     cache.put(key, text)

Nothing here raises because of the state of the disk: results that cannot be kept are worked out
again, and ``cache.reason`` says why.
"""

from lagrange_cli.cache.folder import open_cache
from lagrange_cli.cache.keys import digest, fingerprint
from lagrange_cli.cache.store import MAX_CACHE_BYTES, Cache, Entry, Removed

__all__ = [
    "MAX_CACHE_BYTES",
    "Cache",
    "Entry",
    "Removed",
    "digest",
    "fingerprint",
    "open_cache",
]
