"""A signal that asks a command to end is not lost, whoever takes its exception."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from tests.systems.shipped import SYSTEMS

#: Work that swallows one exception, whatever it is, as extension modules do at their import.
SWALLOWING = """
import os, sys, time
from lagrange_cli.cli.main import lagrange, run

def work(*words, **options):
    try:
        os.kill(os.getpid(), {number})
        time.sleep(20)
    except BaseException:
        pass
    time.sleep(20)

lagrange.main = work
sys.exit(run([]))
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP])
def test_a_swallowed_signal_is_sent_again(number: signal.Signals) -> None:
    program = SWALLOWING.format(number=int(number))
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=15)
    assert done.returncode == 128 + number
    assert b"Traceback" not in done.stderr


#: The import of an extension module swallows what is raised meanwhile.
IMPORTING = """
import os, signal, sys, time
from importlib.machinery import ExtensionFileLoader
from lagrange_cli.cli.main import lagrange, run

class Loader(ExtensionFileLoader):
    def exec_module(self, module):
        try:
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(0.2)
        except BaseException:
            pass

def work(*words, **options):
    Loader("swallows", "swallows.so").exec_module(None)
    time.sleep(20)

lagrange.main = work
try:
    run([])
except KeyboardInterrupt:  # click turns it into its own
    sys.exit(130)
"""


@pytest.mark.slow
def test_an_interrupt_waits_for_the_end_of_an_import() -> None:
    done = subprocess.run([sys.executable, "-c", IMPORTING], capture_output=True, timeout=15)
    assert (done.returncode, done.stderr) == (130, b"")


#: Ctrl-C arrives when the compiler runs and nobody knows of it yet.
STARTING = """
import os, signal, subprocess, sys
from lagrange_cli.cli.main import run

class Popen(subprocess.Popen):
    def __init__(self, command, **options):
        super().__init__(["sleep", "1000"], **options)
        os.write(1, b"%d" % self.pid)
        os.kill(os.getpid(), signal.SIGINT)

subprocess.Popen = Popen
sys.exit(run(["simulate", sys.argv[1], "-o", "out.csv"]))
"""


def test_a_compiler_ends_if_ctrl_c_comes_as_it_starts(tmp_path: Path) -> None:
    environment = {**os.environ, "LAGRANGE_CACHE": "off", "PYTHONPATH": os.getcwd()}
    done = subprocess.run(
        [sys.executable, "-c", STARTING, SYSTEMS / "pendulums" / "pendulum.yaml"],
        capture_output=True,
        cwd=tmp_path,
        env=environment,
    )
    assert (done.returncode, done.stderr.strip()) == (130, b"interrupted")
    compiler = int(done.stdout)
    with pytest.raises(ProcessLookupError):
        os.kill(compiler, 0)
