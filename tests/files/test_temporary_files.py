"""Temporary files and folders: whose they are, and what becomes of those of the dead."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.files import (
    discard,
    is_temporary,
    remove_abandoned_folders,
    temporary_file,
    temporary_folder,
    whole_file,
    write_file,
    write_files,
)

#: Makes a temporary file in a folder, and waits to be killed.
WAITING = """
import sys, time
from lagrange_cli.files import temporary_file, temporary_folder
with temporary_file(sys.argv[1]) as made, temporary_folder() as folder:
    open(f"{folder}/code.c", "w").close()
    print(made.path, folder, flush=True)
    time.sleep(60)
"""


#: What a process prints is text, and it ends well.
TOLD = {"capture_output": True, "text": True, "check": True}


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """A folder of temporary files of its own, also for other processes."""
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setenv("TMPDIR", str(folder))
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def out(tmp_path):
    folder = tmp_path / "out"
    folder.mkdir()
    return folder


@pytest.fixture
def waiting(out):
    """A process that has a temporary file and a folder, and their paths."""
    words = [sys.executable, "-c", WAITING, str(out)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        yield process, process.stdout.readline().split()
        process.kill()


def make_both(out):
    remove_abandoned_folders()
    with temporary_file(out), temporary_folder():
        pass


def test_those_of_a_living_process_are_left_alone(waiting, out):
    _, paths = waiting
    make_both(out)
    assert all(os.path.exists(path) for path in paths)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM], ids=["kill", "term"])
def test_those_of_a_dead_one_go_with_the_next_run(waiting, out, place, number):
    process, paths = waiting
    process.send_signal(number)
    process.wait()
    assert all(os.path.exists(path) for path in paths)
    make_both(out)
    assert os.listdir(out) == os.listdir(place) == []


def test_a_stopped_process_still_lives(waiting, out):
    process, paths = waiting
    process.send_signal(signal.SIGSTOP)
    make_both(out)
    assert all(os.path.exists(path) for path in paths)


def test_the_number_of_a_process_that_is_taken_again_protects_nothing(out):
    """A file of a dead process whose number another one has now: init's."""
    left = out / f".lagrange-1-{0:032x}.tmp"
    left.write_bytes(b"half")
    make_both(out)
    assert not left.exists()


def test_files_of_other_names_and_kinds_stay(out, place):
    names = [".lagrange-1-short.tmp", f"lagrange-1-{0:032x}.tmp", ".1.tmp", f".{0:032x}.tmp"]
    for name in names:
        (out / name).write_bytes(b"mine")
    (out / f".lagrange-1-{1:032x}.tmp").symlink_to(out / names[0])
    (out / f".lagrange-1-{2:032x}.tmp").mkdir()
    os.mkfifo(out / f".lagrange-1-{3:032x}.tmp")
    (place / f"lagrange-1-{0:032x}").write_bytes(b"no folder")
    (place / "lagrange-results").mkdir()
    before = sorted(os.listdir(out)), sorted(os.listdir(place))
    make_both(out)
    assert (sorted(os.listdir(out)), sorted(os.listdir(place))) == before


def fail_after(_):
    raise RuntimeError


def test_nothing_stays_where_all_is_well_or_fails(out, place):
    write_file(out / "a", "1")
    write_files(out, {"b.h": "1", "b.c": "2"})
    with pytest.raises(RuntimeError), whole_file(out / "a") as stream:
        fail_after(stream.write(b"half"))
    with pytest.raises(RuntimeError), temporary_folder() as folder:
        fail_after((out / "x").write_text(folder))
    assert sorted(os.listdir(out)) == ["a", "b.c", "b.h", "x"]
    assert (out / "a").read_text() == "1"
    assert os.listdir(place) == []


def test_a_temporary_file_says_whose_it_is(out):
    with temporary_file(out) as made:
        name = os.path.basename(made.path)
        assert is_temporary(name)
        assert f"-{os.getpid()}-" in name
        assert os.stat(made.path).st_mode & 0o777 == 0o600


def test_a_folder_is_removed_at_once_or_by_the_next_run(out, monkeypatch):
    (out / "parts").mkdir()
    (out / "parts" / "block").write_bytes(b"1")
    with monkeypatch.context() as patched:
        # Killed after the folder has its last name.
        patched.setattr("shutil.rmtree", lambda *_, **__: None)
        discard(out / "parts")
    assert not (out / "parts").exists()
    assert len(os.listdir(out)) == 1
    make_both(out)
    assert os.listdir(out) == []


def test_permissions_and_links_of_what_is_replaced_stay(tmp_path):
    path, link = tmp_path / "a", tmp_path / "b"
    path.write_text("old")
    path.chmod(0o640)
    link.symlink_to(path)
    with whole_file(link) as stream:
        stream.write(b"new")
    assert link.is_symlink()
    assert path.read_text() == "new"
    assert path.stat().st_mode & 0o777 == 0o640


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files away")
def test_the_owner_of_what_is_replaced_stays(tmp_path):
    (tmp_path / "a").write_text("old")
    os.chown(tmp_path / "a", 65534, 65534)
    write_file(tmp_path / "a", "new")
    found = (tmp_path / "a").stat()
    assert (found.st_uid, found.st_gid) == (65534, 65534)


def test_files_that_belong_together_are_renamed_without_a_signal_between(out, monkeypatch):
    """Python runs handlers between two calls: here a signal arrives with the first rename."""
    replace, heard = os.replace, []

    def signalled(*paths):
        replace(*paths)
        os.kill(os.getpid(), signal.SIGTERM)
        assert heard == []

    before = signal.signal(signal.SIGTERM, lambda *_: heard.append(sorted(os.listdir(out))))
    try:
        monkeypatch.setattr(os, "replace", signalled)
        write_files(out, {"x.h": "1", "x.c": "2"})
    finally:
        signal.signal(signal.SIGTERM, before)
    assert heard == [["x.c", "x.h"]]


def test_a_rename_that_fails_is_a_refusal(out, monkeypatch):
    def fail(*_):
        raise OSError(18, "Invalid cross-device link")

    monkeypatch.setattr(os, "replace", fail)
    with pytest.raises(InputError, match=r"cannot write .*cross-device"):
        write_file(out / "a", "1")
    assert os.listdir(out) == []


@pytest.mark.skipif(os.name == "nt", reason="folders have other names there")
@pytest.mark.parametrize("names", [("TMPDIR", "TEMP"), ("TEMP", "TMP"), ("TMP",)])
def test_folders_are_sought_where_they_are_made(tmp_path, monkeypatch, names):
    """An empty folder of a dead process goes where tempfile makes some, and stays elsewhere."""
    process = subprocess.run([sys.executable, "-c", "import os; print(os.getpid())"], **TOLD)
    for name in ("TMPDIR", "TEMP", "TMP"):
        monkeypatch.delenv(name, raising=False)
    left = []
    for name in names:
        (tmp_path / name).mkdir()
        monkeypatch.setenv(name, str(tmp_path / name))
        left.append(tmp_path / name / f"lagrange-{process.stdout.strip()}-{'0' * 32}")
        left[-1].mkdir()
    monkeypatch.setattr(tempfile, "tempdir", None)
    assert tempfile.gettempdir() == str(tmp_path / names[0])
    remove_abandoned_folders()
    assert [folder.exists() for folder in left] == [False, True][: len(names)]
