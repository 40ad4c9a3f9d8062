"""Run the command line in this process: what a user types, and what comes back."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from dataclasses import dataclass
from pathlib import Path

from lagrange_cli.cli.main import run

ROOT = Path(__file__).resolve().parents[2]


@dataclass(frozen=True)
class Done:
    """What a command left behind."""

    returncode: int
    stdout: str
    stderr: str


@contextlib.contextmanager
def _within(folder: Path, input: str):
    """Stand in a folder with this on standard input."""
    before, stdin = os.getcwd(), sys.stdin
    os.chdir(folder)
    sys.stdin = io.TextIOWrapper(io.BytesIO(input.encode()), encoding="utf-8")
    try:
        yield
    finally:
        os.chdir(before)
        sys.stdin = stdin


def lagrange(*words: str, cwd: Path = ROOT, input: str = "", encoding: str = "utf-8") -> Done:
    """``lagrange WORDS`` where standard output has this encoding."""
    out = io.TextIOWrapper(io.BytesIO(), encoding=encoding, newline="")
    err = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", newline="")
    with _within(cwd, input), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = run(list(words))
    texts = []
    for stream in (out, err):
        stream.flush()
        texts.append(stream.buffer.getvalue().decode("utf-8"))
    return Done(code, *texts)


def succeed(*words: str, **more) -> str:
    """What ``lagrange WORDS`` prints, if all is well."""
    done = lagrange(*words, **more)
    assert done.returncode == 0, done.stderr
    return done.stdout
