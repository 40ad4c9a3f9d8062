"""What was worked out before: a folder of verified files, found again by the hash of their inputs.

Importing this room imports neither Click nor anything of mathematics, and takes milliseconds.

>>> key = digest("derive", fingerprint(), scene_bytes)
>>> cache = open_cache()
>>> text = cache.get(key)
>>> if text is None:
...     text = work_it_out(scene_bytes)
...     cache.put(key, text)

Nothing here raises because of the state of the disk: what cannot be kept is worked out again,
and ``cache.reason`` says why.
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
