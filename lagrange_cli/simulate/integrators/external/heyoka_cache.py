"""Keep what heyoka compiles in lagrange's cache, and nowhere else.

heyoka has a cache on the disk of its own, in the user's folder, which holds machine code that is
loaded unverified. Here it has a private folder while it compiles: what the cache has for the same
expressions is put there, and what appears there is taken into the cache. So its code is verified,
bounded and cleared as everything else there, and nothing is kept where the cache is off.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

from lagrange_cli.cache import Cache, open_cache
from lagrange_cli.files import temporary_folder

#: Ending of the cache's entries.
SUFFIX = ".db"

#: Name of the file that heyoka makes.
_DATABASE = "cache.db"

#: The folder in which heyoka keeps code is a setting of the process.
_SETTING = threading.Lock()


def compiled_once(state: Any, key: str, build: Callable[[], Any]) -> Any:
    """Compile by ``build``, or load what it compiled when the key was the same.

    Parameters
    ----------
    state
        heyoka's ``llvm_state``; its settings are afterwards what they were.
    key
        The hash of all that the code depends on.
    """
    with _SETTING:
        path, enabled = state.get_diskcache_path(), state.get_diskcache_enabled()
        try:
            state.set_diskcache_enabled(False)
            return _compiled(state, open_cache(), key, build)
        finally:
            state.set_diskcache_path(path)
            state.set_diskcache_enabled(enabled)


def _compiled(state: Any, cache: Cache, key: str, build: Callable[[], Any]) -> Any:
    """Compile or load while heyoka's own cache is switched off."""
    if cache.reason is not None:
        return build()
    before = cache.get(key, SUFFIX)
    try:
        with temporary_folder() as folder:
            if before is not None:
                Path(folder, _DATABASE).write_bytes(before)
            built = _within(state, folder, build)
            if before is None:
                _keep(cache, key, folder)
            return built
    except OSError:
        # The folder cannot be made or written.
        return build()


def _within(state: Any, folder: str, build: Callable[[], Any]) -> Any:
    """Build with heyoka's cache in this folder, whose files are complete afterwards."""
    path = state.get_diskcache_path()
    state.set_diskcache_path(folder)
    state.set_diskcache_enabled(True)
    try:
        return build()
    finally:
        state.set_diskcache_enabled(False)
        # It closes its files when it is given others.
        state.set_diskcache_path(path)


def _keep(cache: Cache, key: str, folder: str) -> None:
    """Take what heyoka has written into the cache, if it is one file and complete."""
    if [name for name in os.listdir(folder) if name.startswith(_DATABASE)] == [_DATABASE]:
        cache.put(key, Path(folder, _DATABASE).read_bytes(), SUFFIX)
