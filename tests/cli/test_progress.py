"""What a long run says of itself, and how it is ended."""

from __future__ import annotations

import os
import pty
import re
import signal
import subprocess
import sys
import time

import pytest

from lagrange_cli.cli.terminal import progress
from lagrange_cli.cli.terminal.interrupts import noted_interrupts
from lagrange_cli.cli.terminal.progress import ProgressBar

pytestmark = pytest.mark.slow

PENDULUM = """
particles: {bob: {mass: 1, position: [sin(theta), 0, -cos(theta)]}}
coordinates: [theta]
potentials: {weight: 9.81*z_bob}
initial: {theta: 2.0}
simulate: {until: 1e6}
"""


class Bar:
    """What stands for Click's bar."""

    pos, current_item, rendered = 0, None, 0

    def update(self, steps):
        self.pos += steps

    def render_progress(self):
        self.rendered += 1


@pytest.fixture
def clock(monkeypatch):
    """A clock that is set by hand."""

    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

    found = Clock()
    monkeypatch.setattr(progress, "time", found)
    return found


def test_a_bar_shows_the_time_and_its_rate(clock):
    bar = Bar()
    told = ProgressBar(bar)
    told(0.25)
    told.reached(10.0)
    clock.now += 2.0
    told.reached(50.0)
    assert (bar.pos, bar.current_item, bar.rendered) == (250, "t = 50, 20 a second", 1)


def test_a_pass_that_begins_anew_has_a_rate_of_its_own(clock):
    bar = Bar()
    told = ProgressBar(bar)
    told.reached(0.0)
    clock.now += 1.0
    told.reached(1000.0)
    clock.now += 1.0
    told.reached(0.0)
    clock.now += 4.0
    told.reached(2.0)
    assert bar.current_item == "t = 2, 0.5 a second"


def test_lines_come_now_and_then(clock):
    lines = []
    told = ProgressBar(None, lines.append)
    for _ in range(30):
        clock.now += 1.0
        told.reached(2.0 * (clock.now - 101.0))
    told(0.5)
    assert len(lines) == 3
    assert lines[-1] == "t = 58, 2 a second, 0 % done"


def test_the_first_signal_is_noted_and_the_second_acts():
    with noted_interrupts() as found:
        signal.raise_signal(signal.SIGTERM)
        assert (found.asked, found.exit_code) == (True, 143)
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_run_on_a_terminal_shows_simulated_time_until_it_is_interrupted(tmp_path):
    (tmp_path / "pendulum.yaml").write_text(PENDULUM)
    words = "simulate pendulum.yaml --method RK4 --step 1e-3 --samples 1001 -o t.csv --plot t.svg"
    ours, theirs = pty.openpty()
    running = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", *words.split()],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
    )
    os.close(theirs)
    seen = b""
    deadline = time.monotonic() + 60
    while b"a second" not in seen and time.monotonic() < deadline:
        seen += os.read(ours, 4096)
    while b"t = " in seen and not re.search(rb"t = [1-9]\d{3}", seen):
        seen += os.read(ours, 4096)
    running.send_signal(signal.SIGINT)
    while running.poll() is None:
        try:
            seen += os.read(ours, 4096)
        except OSError:
            break
    assert running.wait(30) == 130
    assert b"integrating" in seen
    said = re.search(rb"what is kept ends at t = (\d+)", seen)
    last = (tmp_path / "t.csv").read_text().splitlines()[-1]
    assert float(last.split(",")[0]) == float(said[1])
    assert (tmp_path / "t.svg").stat().st_size > 0
