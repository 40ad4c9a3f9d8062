"""Keys: the hash of everything that a result depends on."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from functools import cache
from hashlib import sha256
from importlib.util import find_spec

from lagrange_cli.version import __version__

#: The libraries that results depend on, each with the file in its folder that names its version.
_LIBRARIES = {
    "sympy": "release.py",
    "mpmath": "__init__.py",
    "numpy": "version.py",
    "scipy": "version.py",
    "yaml": "__init__.py",
}


def digest(*parts: bytes | str) -> str:
    """Return the SHA-256 of a sequence of texts, as 64 hexadecimal digits.

    The length and the kind of each part count, so that different sequences
    have different hashes: ``("ab", "c")``, ``("a", "bc")`` and ``(b"ab", "c")``.
    """
    hasher = sha256()
    for part in parts:
        kind = b"s" if isinstance(part, str) else b"b"
        data = part.encode("utf-8", "surrogatepass") if isinstance(part, str) else part
        hasher.update(b"%s%d:" % (kind, len(data)))
        hasher.update(data)
    return hasher.hexdigest()


@cache
def fingerprint() -> str:
    """Return a hash that changes with lagrange's code, Python's version or that of a library.

    Nothing is imported: names, sizes and times of the package's files stand for
    its code, the file that states its version for each library. They are looked at once: a
    process goes on with the code that it has loaded.
    """
    package = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    try:
        # No name holds the separator.
        files = "\0".join(sorted(_files(package)))
    except OSError:
        # A package that is no folder (an archive): nothing is recognized, so nothing is outdated.
        return os.urandom(32).hex()
    libraries = [part for name, file in _LIBRARIES.items() for part in _library(name, file)]
    machine = (sys.version, sys.implementation.name, sys.platform)
    return digest(__version__, package, *machine, files, *libraries)


#: Endings of code, templates, phrase catalogues, and what pages are made of.
_SOURCES = (".py", ".c", ".h", ".in", ".yaml", ".js", ".css", ".html")


def _files(package: str) -> Iterator[str]:
    """Yield relative name, size and time of every source file below a folder."""
    waiting = [""]
    while waiting:
        folder = waiting.pop()
        with os.scandir(package + folder) as entries:
            for entry in entries:
                if entry.name.endswith(_SOURCES):
                    status = entry.stat()
                    yield f"{folder}/{entry.name} {status.st_size} {status.st_mtime_ns}"
                elif entry.name != "__pycache__" and entry.is_dir(follow_symlinks=False):
                    waiting.append(f"{folder}/{entry.name}")


def _library(name: str, file: str) -> tuple[str | bytes, ...]:
    """Return a library's name, its place, and the text that states its version."""
    spec = find_spec(name)
    if spec is None or spec.origin is None:
        return (name, "absent")
    try:
        with open(os.path.join(os.path.dirname(spec.origin), file), "rb") as stream:
            return (name, spec.origin, stream.read())
    except OSError:
        return (name, spec.origin, "unversioned")
