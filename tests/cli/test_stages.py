"""Long work says where it stands, keeps to its budget, and ends when it is asked to."""

from __future__ import annotations

import io
import os
import re
import signal
import subprocess
import sys
import time

import pytest

from lagrange_cli.cli.terminal import progress as display
from lagrange_cli.cli.terminal.interrupts import OverdueError, within
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.mechanics.diagnosis import errors as refusals
from lagrange_cli.scene import read_text
from lagrange_cli.stages import Listener, announce, heard_by, is_heard, is_to_end
from tests.cli.terminal import lagrange

pytestmark = pytest.mark.slow

PENDULUM = """\
particles: {bob: {mass: 1, position: [sin(theta), 0, -cos(theta)]}}
coordinates: [theta]
potentials: {weight: 9.81*z_bob}
initial: {theta: 2.0}
simulate: {until: 1}
"""


def test_listeners_hear_beside_each_other():
    first, second = [], []
    with heard_by(Listener(hears=first.append, ends=lambda: bool(second))):
        assert is_heard()
        assert not is_to_end()
        announce("one")
        with heard_by(Listener(hears=second.append)):
            announce("two")
        assert is_to_end()
    announce("three")
    assert (first, second) == (["one", "two"], ["two"])
    assert not is_heard()


def test_a_derivation_says_what_it_is_at():
    heard: list[str] = []
    with heard_by(Listener(hears=heard.append)):
        derive(read_text(PENDULUM), forces=True)
    assert [stage.split()[0] for stage in dict.fromkeys(heard)] == [
        *("finding", "deriving", *["certifying"] * 8, *["finding"] * 3, "writing")
    ]


class Terminal(io.StringIO):
    def isatty(self):
        return True


def test_a_line_is_drawn_and_taken_away(monkeypatch):
    monkeypatch.setattr(display, "SHOWN_AFTER", 0.01)
    monkeypatch.setattr(display, "REDRAWN_AFTER", 0.01)
    terminal = Terminal()
    with display.shown_stage(terminal) as show:
        show("deriving \x1b[2J")
        time.sleep(0.1)
    assert re.search(r"deriving \\x1b\[2J, 0 s", terminal.getvalue())
    assert terminal.getvalue().endswith(display.ERASE)


def test_quick_work_draws_nothing():
    terminal = Terminal()
    with display.shown_stage(terminal) as show:
        show("deriving")
    assert terminal.getvalue() == ""


def test_a_terminal_that_is_gone_ends_nothing(monkeypatch):
    monkeypatch.setattr(display, "SHOWN_AFTER", 0.01)

    class Gone(Terminal):
        def write(self, text):
            raise OSError(5, "gone")

    with display.shown_stage(Gone()) as show:
        show("deriving")
        time.sleep(0.05)


# Budgets.


def _forever():
    while True:
        pass


def test_seconds_end_work_and_leave_other_alarms():
    heard = []
    before = signal.signal(signal.SIGALRM, lambda *_: heard.append(1))
    signal.setitimer(signal.ITIMER_REAL, 0.3)
    try:
        started = time.monotonic()
        with pytest.raises(OverdueError), within(0.1):
            _forever()
        assert time.monotonic() - started < 5
        with within(None), within(10.0):
            pass
        time.sleep(0.5)
        assert heard == [1]
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def test_the_budget_counts_deriving(monkeypatch, tmp_path):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    (tmp_path / "scene.yaml").write_text(PENDULUM)

    def slow(*arguments, **more):
        announce("looking for what is not there")
        _forever()

    monkeypatch.setattr("lagrange_cli.mechanics.derive", slow)
    done = lagrange("simulate", "scene.yaml", "--budget", "0.5", "-o", "t.csv", cwd=tmp_path)
    assert done.returncode == 1
    assert "0.5 s" in done.stderr
    assert "looking for what is not there" in done.stderr
    assert os.listdir(tmp_path) == ["scene.yaml"]


@pytest.mark.parametrize("budget", ["-1", "0", "nan", "inf"])
def test_a_budget_that_is_no_time_is_refused(budget, tmp_path):
    (tmp_path / "scene.yaml").write_text(PENDULUM)
    done = lagrange("simulate", "scene.yaml", "--budget", budget, cwd=tmp_path)
    assert done.returncode == 2
    assert "budget must be a positive number" in done.stderr


@pytest.mark.parametrize("what", ["coordinates", "particles", "constraints"])
def test_systems_that_would_take_hours_are_refused_at_once(what, monkeypatch):
    monkeypatch.setattr(refusals, "LARGEST_SYSTEM", 20)
    sections = {
        "coordinates": 'coordinates: ["x[i=1..n]"]\nkinetic: {k: "sum(dot(x[i])^2, i=1..n)"}\n',
        "particles": 'particles: {"p[i=1..n]": {mass: 1}}\n',
        "constraints": 'particles: {a: {mass: 1}}\nconstraints: {"c[i=1..n]": x_a = i*y_a}\n',
    }
    scene = read_text("sizes: {n: 21}\n" + sections[what])
    with pytest.raises(InputError, match=f"21 {what}") as caught:
        derive(scene)
    assert caught.value.problems[0].mark.line >= 2


# Interrupts.


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups")
def test_ctrl_c_ends_a_hanging_compiler_at_once(tmp_path):
    (tmp_path / "scene.yaml").write_text(PENDULUM)
    compiler, begun = tmp_path / "compiler", tmp_path / "begun"
    compiler.write_text(f"#!/bin/sh\nsleep 1000 &\necho $! > {begun}\nwait\n")
    compiler.chmod(0o755)
    process = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", "simulate", "scene.yaml", "-o", "out.csv"],
        cwd=tmp_path,
        env={**os.environ, "CC": str(compiler), "LAGRANGE_CACHE": "off"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        deadline = time.monotonic() + 60
        while not (begun.exists() and begun.read_text().strip()):
            assert time.monotonic() < deadline
            assert process.poll() is None
            time.sleep(0.05)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=20)
    finally:
        process.kill()
    assert process.returncode == 130, errors
    assert "Traceback" not in errors
    child = int(begun.read_text())
    for _ in range(100):
        if _state(child) in ("", "Z"):
            break
        time.sleep(0.05)
    assert _state(child) in ("", "Z")
    left = {"scene.yaml", "compiler", "begun"}
    assert set(os.listdir(tmp_path)) - left <= {"out.csv"}


_INTERRUPTED = """\
import click
from lagrange_cli.cli import main

def interrupted(*arguments, **options):
    try:
        exec("raise KeyboardInterrupt")
    except KeyboardInterrupt:
        raise click.Abort from None

main.lagrange.main = interrupted
main.main()
"""


@pytest.mark.skipif(os.name == "nt", reason="no process ends by a signal there")
def test_an_interrupt_of_an_exec_of_a_library_ends_with_the_same_code(tmp_path):
    (tmp_path / "interrupted.py").write_text(_INTERRUPTED)
    ended = subprocess.run(
        [sys.executable, "-m", "interrupted"],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
        capture_output=True,
        text=True,
    )
    assert (ended.returncode, ended.stderr) == (130, "interrupted\n")


def _state(process: int) -> str:
    """The letter of a process's state: Z for one that has ended and was not waited for."""
    try:
        with open(f"/proc/{process}/stat", encoding="ascii") as file:
            return file.read().rpartition(")")[2].split()[0]
    except OSError:
        return ""
