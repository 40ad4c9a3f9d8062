"""Locks of outputs: one process makes them, and the dead hold nothing."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.files import lock_of, sole_writer

HOLDING = """
import sys, time
from lagrange_cli.files import sole_writer
with sole_writer(sys.argv[1]):
    print("held", flush=True)
    time.sleep(60)
"""


@pytest.fixture
def output(tmp_path):
    return str(tmp_path / "out.npz")


@pytest.fixture
def holder(output):
    with subprocess.Popen(
        [sys.executable, "-c", HOLDING, output], stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "held\n"
        yield process
        process.kill()


def test_the_process_that_holds_it_is_told(holder, output):
    message = f"process {holder.pid} is making '{output}'"
    with pytest.raises(InputError, match=message) as refused, sole_writer(output):
        pass
    assert f"kill {holder.pid}" in refused.value.problems[0].hint
    assert os.path.exists(lock_of(output))


def test_another_spelling_is_the_same_output(holder, output, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "link").symlink_to(tmp_path)
    for path in ("out.npz", "./out.npz", "link/out.npz"):
        with pytest.raises(InputError, match="is making"), sole_writer(path):
            pass


def test_a_killed_process_holds_nothing(holder, output):
    holder.kill()
    holder.wait()
    assert os.path.exists(lock_of(output))
    with sole_writer(output):
        assert Path(lock_of(output)).read_text().startswith(f"lagrange {os.getpid()} ")
    assert not os.path.exists(lock_of(output))


def test_child_processes_do_not_hold_it(output):
    with sole_writer(output):
        child = os.fork()
        if child == 0:
            os.execv(sys.executable, [sys.executable, "-c", "import time; time.sleep(60)"])
    try:
        with sole_writer(output):
            pass
    finally:
        os.kill(child, 9)
        os.waitpid(child, 0)


def test_it_is_gone_when_the_work_fails(output, tmp_path):
    with pytest.raises(ZeroDivisionError), sole_writer(output):
        raise ZeroDivisionError
    assert os.listdir(tmp_path) == []


def test_a_file_of_that_name_that_is_no_lock_stays(output):
    Path(lock_of(output)).write_text("precious\n")
    with pytest.raises(InputError, match="is in the way"), sole_writer(output):
        pass
    assert Path(lock_of(output)).read_text() == "precious\n"


def test_a_folder_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(InputError, match="cannot write"), sole_writer(str(tmp_path / "no" / "x")):
        pass
