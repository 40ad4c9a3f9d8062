"""Find the folder of the cache, and refuse it unless only the user can write there.

Files in it are shown as lagrange's results, and loaded as libraries. So nobody else may be able to
write there: the folder belongs to the user and denies access to others, and each folder on the way
to it belongs to the user or to root, and does not let everybody put another folder in its place.
Members of a group that may write to a folder on the way are trusted.
"""

from __future__ import annotations

import os
import stat
from contextlib import suppress

from lagrange_cli.cache.store import Cache

#: The environment variable that turns the cache off.
_SWITCH = "LAGRANGE_CACHE"

#: Permissions of the group and of others.
_OTHERS = 0o077
#: Permissions of the group and of others to write.
_OTHERS_WRITE = 0o022


class _UnusableError(Exception):
    """There is no usable folder; the message says why."""


def open_cache() -> Cache:
    """Return the user's cache; if there can be none, an empty one that says why.

    The folder is ``$XDG_CACHE_HOME/lagrange``, else ``~/.cache/lagrange``. It is made if it is
    missing.
    """
    try:
        _refuse_switched_off()
        folder = os.path.join(_base(), "lagrange")
    except _UnusableError as why:
        return Cache(None, str(why))
    try:
        return _opened(folder, _prepared(folder))
    except _UnusableError as why:
        return Cache(None, str(why))
    except OSError as error:
        return Cache(None, f"'{folder}' cannot be used: {error.strerror or error}")


def _opened(folder: str, open_to_others: bool) -> Cache:
    if not os.access(folder, os.W_OK | os.X_OK):
        return Cache(folder, f"'{folder}' is read-only")
    cache = Cache(folder)
    if open_to_others:
        cache.clear()
    return cache


def _refuse_switched_off() -> None:
    value = os.environ.get(_SWITCH, "on")
    if value == "off":
        raise _UnusableError(f"{_SWITCH} is off")
    if value not in ("on", ""):
        raise _UnusableError(f"{_SWITCH} is neither on nor off but {value!r}")


def _base() -> str:
    """Return the real path of the user's folder of caches."""
    base = os.environ.get("XDG_CACHE_HOME", "")
    # The specification of base directories has relative paths ignored.
    if os.path.isabs(base):
        return os.path.realpath(base)
    home = os.environ["HOME"] if "HOME" in os.environ else os.path.expanduser("~")
    if not os.path.isabs(home):
        raise _UnusableError("there is no home folder: HOME is not an absolute path")
    if not os.path.isdir(home):
        raise _UnusableError(f"there is no home folder: '{home}' is no folder")
    return os.path.realpath(os.path.join(home, ".cache"))


def _prepared(folder: str) -> bool:
    """Make the folder, or take it over; say whether others could have written there.

    Raises
    ------
    _UnusableError
        It is no folder, or others can replace it.
    OSError
        It cannot be made, or its permissions cannot be mended.
    """
    os.makedirs(os.path.dirname(folder), mode=0o700, exist_ok=True)
    if os.name == "posix":
        _refuse_untrusted_parents(os.path.dirname(folder))
    with suppress(FileExistsError):
        os.mkdir(folder, 0o700)
    status = os.lstat(folder)
    if not stat.S_ISDIR(status.st_mode):
        raise _UnusableError(f"'{folder}' is not a folder")
    if os.name != "posix":
        return False
    if status.st_uid != os.geteuid():
        raise _UnusableError(f"'{folder}' belongs to another user")
    if status.st_mode & _OTHERS:
        os.chmod(folder, 0o700)
    return bool(status.st_mode & _OTHERS_WRITE)


def _refuse_untrusted_parents(path: str) -> None:
    """Refuse a path on which anybody but the user and root can replace a folder by another."""
    while True:
        status = os.stat(path)
        if status.st_uid not in (0, os.geteuid()):
            raise _UnusableError(f"'{path}' belongs to another user")
        if status.st_mode & stat.S_IWOTH and not status.st_mode & stat.S_ISVTX:
            raise _UnusableError(f"every user can write to '{path}'")
        parent = os.path.dirname(path)
        if parent == path:
            return
        path = parent
