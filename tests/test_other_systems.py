"""Files, limits and signals where the calls of POSIX are missing, as on Windows.

The system is a stand-in: it has no locks and no owners, and neither renames nor removes open files.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lagrange_cli.check.check import check_paths
from lagrange_cli.check.model import Limits
from lagrange_cli.cli.terminal.interrupts import Terminated
from lagrange_cli.errors import InputError
from lagrange_cli.files import sole_writer, temporary_folder, whole_file, write_file, write_files


def refusing_open_files(call: Callable[..., None]) -> Callable[..., None]:
    """Return a call of the system that refuses a path that this process has open."""

    def refusing(path: Any, *others: Any) -> None:
        handles = Path("/proc/self/fd").iterdir()
        if os.path.realpath(path) in {os.path.realpath(handle) for handle in handles}:
            raise PermissionError(13, "The process cannot access the file", str(path))
        call(path, *others)

    return refusing


@pytest.fixture
def windows(monkeypatch: pytest.MonkeyPatch) -> None:
    if not os.path.isdir("/proc/self/fd"):
        pytest.skip("the open files of this process are not listed")
    for module in ("locks", "temporary"):
        monkeypatch.setattr(f"lagrange_cli.files.{module}.POSIX", False)
    for name in ("pwrite", "fchown", "uname", "killpg", "O_NOFOLLOW", "O_NONBLOCK"):
        monkeypatch.delattr(os, name, raising=False)
    for name in ("fcntl", "resource"):
        monkeypatch.setitem(sys.modules, name, None)
    for name in ("replace", "unlink"):
        monkeypatch.setattr(os, name, refusing_open_files(getattr(os, name)))


@pytest.mark.usefixtures("windows")
def test_files_are_written_whole_and_nothing_else_is_left(tmp_path: Path) -> None:
    for text in ("first", "second"):
        write_file(tmp_path / "one", text)
        write_files(tmp_path / "some", {"a": text, "b": text})
        with whole_file(tmp_path / "parts") as stream:
            stream.write(text.encode())
        with sole_writer(str(tmp_path / "locked")):
            write_file(tmp_path / "locked", text)
        with temporary_folder() as folder:
            assert os.path.isdir(folder)
        assert not os.path.exists(folder)
    names = sorted(path.name for path in tmp_path.rglob("*"))
    assert names == ["a", "b", "locked", "one", "parts", "some"]
    assert {path.read_text() for path in tmp_path.rglob("*") if path.is_file()} == {"second"}


@pytest.mark.usefixtures("windows")
def test_what_fails_leaves_what_was_there(tmp_path: Path) -> None:
    write_file(tmp_path / "one", "first")
    with pytest.raises(ZeroDivisionError), whole_file(tmp_path / "one") as stream:
        stream.write(b"%d" % (1 // 0))
    assert [path.name for path in tmp_path.iterdir()] == ["one"]
    assert (tmp_path / "one").read_text() == "first"


@pytest.mark.parametrize("system", ["win32", "darwin"])
def test_memory_is_not_limited_where_the_system_does_not(
    system: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.yaml").write_text("coordinates: [x]\n")
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(InputError, match="this system limits the memory of no process"):
        check_paths([str(tmp_path)], limits=Limits(memory=10**9))


def test_a_signal_is_sent_again_where_threads_get_none(monkeypatch: pytest.MonkeyPatch) -> None:
    heard: list[int] = []
    ended = Terminated(signal.SIGTERM, lambda: None)  # which nobody hears of
    before = signal.signal(signal.SIGTERM, lambda number, frame: heard.append(number))
    monkeypatch.delattr(signal, "pthread_kill")
    try:
        del ended
        started = time.monotonic()
        while not heard and time.monotonic() - started < 60:
            time.sleep(0.01)
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == [signal.SIGTERM]
