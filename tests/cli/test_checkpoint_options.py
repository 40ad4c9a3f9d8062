"""``--checkpoint`` and ``--resume`` as a user types them, and runs that are killed."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time

import pytest

from tests.cli.terminal import ROOT, lagrange

PENDULUM = """
particles: {bob: {mass: 1, position: [sin(theta), 0, -cos(theta)]}}
coordinates: [theta]
potentials: {weight: 9.81*z_bob}
initial: {theta: 2.0}
simulate: {until: 4000}
"""

RUN = ("simulate", "p.yaml", "--method", "Gauss4", "--step", "0.001", "--samples", "40001")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "p.yaml").write_text(PENDULUM)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGKILL, -9),
        (signal.SIGTERM, 143),
        pytest.param(signal.SIGHUP, 129, marks=pytest.mark.campaign),
    ],
    ids=["kill", "term", "hup"],
)
def test_a_run_that_was_ended_goes_on_to_the_same_file(folder, number, code):
    words = [*RUN, "-o", "part.npz", "--checkpoint", "c"]
    running = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},  # the same code as in this process
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    deadline = time.monotonic() + 60
    while not (folder / "c").exists() and time.monotonic() < deadline:
        time.sleep(0.01)
    running.send_signal(number)
    _, stderr = running.communicate(timeout=60)
    assert running.returncode == code
    assert (folder / "part.npz").exists() == (number != signal.SIGKILL)
    if number != signal.SIGKILL:
        assert re.search(rb"what is kept ends at t = \d", stderr)
        assert b"--resume c with the same options goes on from there" in stderr
    again = lagrange(*RUN, "-o", "part.npz", "--resume", "c", cwd=folder)
    assert (again.returncode, again.stderr) == (0, "")
    assert lagrange(*RUN, "-o", "whole.npz", cwd=folder).returncode == 0
    assert (folder / "part.npz").read_bytes() == (folder / "whole.npz").read_bytes()
    left = sorted(path.name for path in folder.iterdir())
    assert left == ["p.yaml", "part.npz", "whole.npz"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--resume",), "--resume needs the file of --checkpoint"),
        (("--resume", "c"), "cannot read 'c': No such file"),
        (("--resume", "c", "--checkpoint", "d"), "leave out --checkpoint"),
        (("--checkpoint", ""), "the path is empty"),
        (("--checkpoint", "nowhere/c"), "cannot write 'nowhere/c'"),
        (("--vary", "theta=[1]", "--checkpoint", "c"), "an ensemble keeps each member"),
        (("--vary", "theta=[1]", "--resume", "c"), "not from 'c'"),
    ],
)
def test_options_that_do_not_fit(folder, words, said):
    method = ("--method", "RK4", "--step", "0.1", "--until", "10")
    done = lagrange("simulate", "p.yaml", *method, *words, cwd=folder)
    assert done.returncode == 2
    assert said in done.stderr
    assert sorted(path.name for path in folder.iterdir()) == ["p.yaml"]


def test_coordinates_that_are_read_off_positions_are_refused(folder):
    scene = "systems/constraints/spherical_pendulum_from_the_pole.yaml"
    method = ("--method", "DOP853", "--rtol", "1e-6", "--formulation", "multiplier")
    done = lagrange("simulate", scene, *method, "--checkpoint", str(folder / "c"))
    assert done.returncode == 2
    assert "cannot be interrupted and go on" in done.stderr
