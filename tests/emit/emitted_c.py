"""Compiling emitted C and calling it from tests."""

from __future__ import annotations

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS

WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Werror"]
TYPES = {"float": np.float32, "double": np.float64, "long-double": np.longdouble}


def in_types(systems):
    """Pairs of each system with doubles, and of every second one with another type in turn."""
    systems = list(systems)
    others = [(system, ("float", "long-double")[k % 2]) for k, system in enumerate(systems[::2])]
    return [*((system, "double") for system in systems), *others]


def compiler(name="gcc"):
    """The compiler's path; without one the test is skipped (and fails in CI)."""
    found = shutil.which(name)
    if found is None:
        message = f"{name} is not installed"
        if os.environ.get("CI") == "true":
            pytest.fail(message)
        pytest.skip(message)
    return found


def write(equations, folder, real="double", main=False):
    """Emit the C files into a folder; the path of the source."""
    files = EMITTERS["c"].emit(equations, {"real": real, "main": main})
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8", newline="\n")
    (source,) = [name for name in files if name.endswith(".c")]
    return folder / source


def run(*arguments, **more):
    done = subprocess.run(
        [str(a) for a in arguments], capture_output=True, text=True, timeout=120, **more
    )
    assert done.returncode == 0, done.stderr[:3000]
    return done.stdout


def shared_library(source, *flags):
    """Compile a C file into a shared library, which processes of a run share for equal texts.

    What is compared are values, which the compiler's optimization does not change.
    """
    words = [compiler(), "-std=c99", "-O0", *WARNINGS, *flags, "-shared", "-fPIC"]
    texts = [path.read_bytes() for path in (source, source.with_suffix(".h")) if path.exists()]
    key = hashlib.sha256(b"\0".join([" ".join(words).encode(), *texts])).hexdigest()
    folder = Path(os.environ["XDG_CACHE_HOME"]) / "test-libraries"
    library = folder / f"{key}.so"
    if not library.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as made:
            run(*words, source, "-o", Path(made) / "library.so", "-lm")
            os.replace(Path(made) / "library.so", library)
    return ctypes.CDLL(str(library))


class Compiled:
    """The functions of one emitted system, over arrays of its number type."""

    def __init__(self, equations, folder, real="double"):
        source = write(equations, folder, real)
        self.library = shared_library(source)
        self.type = TYPES[real]
        self.prefix = source.stem
        self.header = source.with_suffix(".h").read_text(encoding="utf-8")
        defaults = getattr(self.library, f"{self.prefix}_defaults")
        self.defaults = np.zeros(max(1, len(equations.system.parameters)), self.type)
        defaults.restype = None
        defaults(ctypes.c_void_p(self.defaults.ctypes.data))

    def macro(self, name):
        (line,) = [
            line for line in self.header.splitlines() if f"define {self.prefix}_{name} " in line
        ]
        return int(line.split()[-1])

    def __call__(self, function, t, y, p, size):
        """Status and result of a function of the interface."""
        arrays = [np.ascontiguousarray(a, self.type) for a in (y, p)]
        work = np.full(self.macro("WORK"), np.nan, self.type)
        out = np.full(size, np.nan, self.type)
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, work, out)]
        c_type = {np.float32: ctypes.c_float, np.float64: ctypes.c_double}.get(
            self.type, ctypes.c_longdouble
        )
        status = getattr(self.library, f"{self.prefix}_{function}")(
            c_type(t), pointers[0], None, *pointers[1:]
        )
        return status, out
