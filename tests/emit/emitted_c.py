"""Compiling emitted C and calling it from tests."""

from __future__ import annotations

import ctypes
import os
import shutil
import subprocess

import numpy as np
import pytest

from lagrange_cli.emit.registry import EMITTERS

WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Werror"]
TYPES = {"float": np.float32, "double": np.float64, "long-double": np.longdouble}


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


class Compiled:
    """The functions of one emitted system, over arrays of its number type."""

    def __init__(self, equations, folder, real="double"):
        source = write(equations, folder, real)
        library = folder / f"{source.stem}_{real}.so"
        gcc = compiler()
        run(gcc, "-std=c99", "-O1", *WARNINGS, "-shared", "-fPIC", source, "-o", library, "-lm")
        self.library = ctypes.CDLL(str(library))
        self.type = TYPES[real]
        self.prefix = source.stem
        self.header = source.with_suffix(".h").read_text(encoding="utf-8")
        defaults = getattr(self.library, f"{self.prefix}_defaults")
        self.defaults = np.zeros(max(1, len(equations.parameters)), self.type)
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
