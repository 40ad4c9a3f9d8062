"""What results depend on: versions of Python, of libraries, of this program and its code."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Mapping
from functools import cache
from importlib.metadata import PackageNotFoundError, version

from lagrange_cli.version import __version__

#: Libraries that results and their way to this process depend on.
_LIBRARIES = ("numpy", "scipy", "sympy", "mpmath", "dask", "distributed", "cloudpickle")

#: The name under which the digest of this program's sources stands.
_CODE = "the code of lagrange_cli"


@cache
def installed() -> dict[str, str]:
    """Return what results depend on in this process: name → version."""
    found = {"python": sys.version.split()[0], "lagrange_cli": __version__}
    for name in _LIBRARIES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return {**found, _CODE: _code_digest()}


def _code_digest() -> str:
    """Hash the contents of the package's sources, in 12 digits."""
    package = next(iter(sys.modules["lagrange_cli"].__path__))
    hasher = hashlib.sha256()
    for folder, folders, files in os.walk(package):
        folders.sort()
        for name in sorted(files):
            if name.endswith((".py", ".c", ".h", ".in")):
                path = os.path.join(folder, name)
                with open(path, "rb") as stream:
                    data = stream.read()
                hasher.update(f"{os.path.relpath(path, package)}\0{len(data)}\0".encode())
                hasher.update(data)
    return hasher.hexdigest()[:12]


def difference(here: Mapping[str, str], there: Mapping[str, str]) -> str:
    """Say which versions differ, or ``""``."""
    names = [name for name in here if here[name] != there.get(name, "none")]
    if names and names[-1] == _CODE and len(names) > 1:
        names.pop()  # of course: another version of it, or other libraries, say enough
    return ", ".join(
        f"{name} {there.get(name, 'none')} where this process has {here[name]}" for name in names
    )
