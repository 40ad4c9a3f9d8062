"""Dask clusters of this machine, as a user starts them: schedulers and workers as processes."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import lagrange_cli

ROOT = Path(lagrange_cli.__file__).parents[1]

#: Seconds in which processes of a cluster must be there, on a machine that does much else.
PATIENCE = 300.0


def environment(path: str = "", **changes: str) -> dict[str, str]:
    """The environment of a process with the package under test, and ``path`` before it."""
    places = os.pathsep.join(filter(None, (path, str(ROOT))))
    return {**os.environ, "PYTHONPATH": places, "DASK_LOGGING__DISTRIBUTED": "error", **changes}


@contextmanager
def process(
    *words: str, largest_file: int | None = None, **options: object
) -> Iterator[subprocess.Popen]:
    """A process of a cluster, which is ended in the end."""

    def limit() -> None:
        if largest_file is not None:
            resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))

    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    command = [sys.executable, "-m", *words]
    started = subprocess.Popen(command, preexec_fn=limit, **{**quiet, **options})
    try:
        yield started
    finally:
        started.kill()
        started.wait()


@contextmanager
def scheduler(folder: Path, port: int = 0) -> Iterator[tuple[subprocess.Popen, str]]:
    """A scheduler and its address."""
    file = folder / f"scheduler-{time.monotonic_ns()}.json"
    words = ("distributed.cli.dask_scheduler", "--host", "127.0.0.1", "--port", str(port))
    rest = ("--no-dashboard", "--no-show", "--scheduler-file", str(file))
    with process(*words, *rest, env=environment()) as started:
        until(lambda: file.exists() and "address" in file.read_text())
        yield started, json.loads(file.read_text())["address"]


@contextmanager
def worker(
    address: str,
    folder: Path,
    *,
    path: str = "",
    largest_file: int | None = None,
    changes: Mapping[str, str] | None = None,
) -> Iterator[subprocess.Popen]:
    """A worker with one thread, whose working directory is a folder."""
    words = ("distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1")
    rest = ("--no-dashboard", "--memory-limit", "0")
    options = {"cwd": folder, "env": environment(path, **(changes or {}))}
    with process(*words, *rest, largest_file=largest_file, **options) as started:
        yield started


def until(condition) -> None:
    """Wait for a condition."""
    given_up = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < given_up, "a process of the cluster is late"
        time.sleep(0.05)


def wait_for_workers(client, number: int) -> None:
    until(lambda: len(client.nthreads()) == number)
