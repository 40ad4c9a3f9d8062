"""Every command of docs/sweeps.md is run, on a cluster that the page itself starts."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import socket
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest

from tests.simulate.clusters import environment, process, wait_for_workers

pytest.importorskip("distributed")
for library in ("zarr", "xarray", "matplotlib"):
    pytest.importorskip(library)

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "sweeps.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)

#: Numbers of members that the page has, and those that the test runs.
FEWER = {"200": "40", "400": "40", "600": "60"}

#: The address of the page's scheduler; tests take one that is free.
ADDRESS = "localhost:8786"


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder that looks like a clone, with a few of its scenes."""
    path = tmp_path_factory.mktemp("clone")
    scenes = path / "systems" / "pendulums"
    scenes.mkdir(parents=True)
    for name in ("pendulum", "double_pendulum", "elastic_pendulum"):
        shutil.copy(ROOT / "systems" / "pendulums" / f"{name}.yaml", scenes)
    return path


def run(kind: str, body: str, folder: Path) -> str:
    """Run a block as a user of a shell would, who has this Python's programs."""
    programs = os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]])
    command = ["bash", "-ec", body] if kind == "sh" else [sys.executable, "-c", body]
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment(PATH=programs),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, (body, done.stdout, done.stderr)
    return done.stdout


@pytest.mark.slow
def test_every_block_runs(folder):
    """The installation alone is left out; commands of Dask run until the end of the page."""
    from distributed import Client

    here, told = f"127.0.0.1:{free_port()}", []
    with ExitStack() as stack:
        for kind, body in BLOCKS:
            body = re.sub(r"\b[246]00\b", lambda number: FEWER[number[0]], body)
            body = body.replace(ADDRESS, here)
            if body.startswith("dask "):
                for line in body.replace("--port 8786", f"--port {here[10:]}").splitlines():
                    words = [*shlex.split(line), "--no-dashboard"]
                    options = {"cwd": folder, "env": environment()}
                    stack.enter_context(process(*words, **options))
                with Client(f"tcp://{here}", timeout=30, set_as_default=False) as client:
                    wait_for_workers(client, 2)
            elif not body.startswith("pip "):
                told.append(run(kind, body, folder))
    assert [kind for kind, _ in BLOCKS] == ["sh", "sh", "sh", "sh", "python", "sh", "sh", "python"]
    grid, _, stopped, _, far, flips = told
    assert "40 of 40 members" in grid
    assert "40 of 40 members" in grid
    assert "stopped, 1" in stopped
    assert "60 of 60 members" in stopped
    assert "60 of 60 members" in far
    assert (folder / "flips.png").stat().st_size > 1000
    assert 0 < float(flips) < 1
    assert ends(folder / "far.zarr") == ends(folder / "sweep.zarr")


def ends(store: Path) -> bytes:
    import zarr

    return np.asarray(zarr.open_group(store, mode="r")["final.theta2"][:]).tobytes()
