"""Emitted Python programs, run in the process of the tests: each of its own would import NumPy."""

from __future__ import annotations

import contextlib
import io
import runpy
import subprocess
import sys
from unittest import mock


def run_python(path, *arguments):
    """Run a file as Python's main program and return what a process of its own would give."""
    words = [str(path), *map(str, arguments)]
    out, err, code = io.StringIO(), io.StringIO(), 0
    with (
        mock.patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            runpy.run_path(str(path), run_name="__main__")
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else int(ended.code is not None)
            if code and not isinstance(ended.code, int):
                print(ended.code, file=err)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())


def run_program(path, *arguments):
    """Run a compiled program, or one in Python."""
    if str(path).endswith(".py"):
        return run_python(path, *arguments)
    words = [str(path), *map(str, arguments)]
    return subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
