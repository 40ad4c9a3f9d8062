"""A signal that asks a command to end is not lost, whoever takes its exception."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

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
