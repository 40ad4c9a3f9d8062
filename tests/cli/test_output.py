"""Files are written whole or not at all, and every failure is explained."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.files import check_writable, write_file, write_files

NOBODY = 65534


def test_new_file_has_the_content_and_the_permissions_of_the_umask(tmp_path):
    previous = os.umask(0o027)
    try:
        write_file(tmp_path / "a.txt", "θ̇ = 1\n")
    finally:
        os.umask(previous)
    assert (tmp_path / "a.txt").read_bytes() == "θ̇ = 1\n".encode()
    assert stat.S_IMODE((tmp_path / "a.txt").stat().st_mode) == 0o640
    assert os.listdir(tmp_path) == ["a.txt"]


def test_replaced_file_keeps_its_permissions(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o600)
    write_file(path, b"new")
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_symbolic_link_stays_a_link(tmp_path):
    (tmp_path / "real.txt").write_text("old")
    (tmp_path / "link.txt").symlink_to("real.txt")
    write_file(tmp_path / "link.txt", "new")
    assert (tmp_path / "link.txt").is_symlink()
    assert (tmp_path / "real.txt").read_text() == "new"


def test_dangling_link_makes_its_target(tmp_path):
    (tmp_path / "link.txt").symlink_to("real.txt")
    write_file(tmp_path / "link.txt", "new")
    assert (tmp_path / "real.txt").read_text() == "new"


def test_missing_folder_is_refused_for_a_file(tmp_path):
    with pytest.raises(InputError, match=r"cannot write '.*nowhere/a\.txt': No such file"):
        write_file(tmp_path / "nowhere" / "a.txt", "x")
    assert os.listdir(tmp_path) == []


def test_folder_is_refused_as_a_file(tmp_path):
    with pytest.raises(InputError, match="it is a folder and not a file"):
        write_file(tmp_path, "x")


def test_missing_folders_are_made_for_a_folder(tmp_path):
    written = write_files(tmp_path / "a" / "b", {"x.h": "1", "x.c": "2"})
    assert [Path(p).read_text() for p in written] == ["1", "2"]


def test_file_is_refused_as_a_folder(tmp_path):
    (tmp_path / "out").write_text("kept")
    with pytest.raises(InputError, match="it is a file and not a folder"):
        write_files(tmp_path / "out", {"x.h": "1"})
    with pytest.raises(InputError, match="cannot write into"):
        write_files(tmp_path / "out" / "deeper", {"x.h": "1"})
    assert (tmp_path / "out").read_text() == "kept"


def test_nothing_is_touched_when_one_of_several_cannot_be_written(tmp_path):
    (tmp_path / "x.h").write_text("old")
    (tmp_path / "x.c").mkdir()
    with pytest.raises(InputError, match=r"x\.c"):
        write_files(tmp_path, {"x.h": "new", "x.c": "new"})
    assert (tmp_path / "x.h").read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["x.c", "x.h"]


def as_ordinary_user(action: Callable[[], None], folder: Path) -> None:
    """Run an action in a child that is not root, to whom permissions mean nothing."""
    if os.geteuid() == 0:
        for path in (folder, *folder.iterdir()):
            os.chown(path, NOBODY, NOBODY)
        for parent in folder.parents:
            parent.chmod(parent.stat().st_mode | stat.S_IXOTH)
    child = os.fork()
    if child == 0:
        status = 1
        try:
            if os.geteuid() == 0:
                os.setgid(NOBODY)
                os.setuid(NOBODY)
            action()
            status = 0
        finally:
            os._exit(status)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def test_read_only_file_is_not_replaced(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    path.chmod(0o400)

    def try_to_replace() -> None:
        with pytest.raises(InputError, match="read-only"):
            write_file(path, "new")

    as_ordinary_user(try_to_replace, tmp_path)
    assert path.read_text() == "old"


def test_read_only_folder_is_explained(tmp_path):
    tmp_path.chmod(0o500)

    def try_to_write() -> None:
        with pytest.raises(InputError, match="cannot write"):
            write_file(tmp_path / "b.txt", "new")

    as_ordinary_user(try_to_write, tmp_path)
    assert os.listdir(tmp_path) == []


def test_a_file_in_a_read_only_folder_is_refused_before_the_work(tmp_path):
    (tmp_path / "b.txt").write_text("old")
    tmp_path.chmod(0o500)

    def check() -> None:
        with pytest.raises(InputError, match="the folder is read-only"):
            check_writable(tmp_path / "b.txt")

    as_ordinary_user(check, tmp_path)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_full_disk_is_explained():
    with pytest.raises(InputError, match="cannot write '/dev/full': No space left"):
        write_file("/dev/full", "x")


def test_device_is_written_and_not_replaced():
    write_file(os.devnull, "x")
    assert stat.S_ISCHR(os.stat(os.devnull).st_mode)


def printed(
    text: str, format_: str = "text", stdout: int | None = subprocess.PIPE, **environment: str
):
    program = (
        "import sys; from lagrange_cli.cli.terminal.output import print_text\n"
        "from lagrange_cli.errors import InputError\n"
        "try: print_text(*sys.argv[1:])\n"
        "except InputError as error: sys.exit(str(error))"
    )
    return subprocess.run(
        [sys.executable, "-c", program, text, format_],
        stdout=stdout,
        stderr=subprocess.PIPE,
        env=os.environ | environment,
        timeout=60,
    )


def test_characters_that_the_encoding_lacks_are_escaped():
    done = printed("θ = ½\n", PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stdout) == (0, b"\\u03b8 = \\xbd\n")


def test_json_is_escaped_as_json():
    value = {"é": 'θ = ½ \U0001d703 \\ "\n'}
    done = printed(json.dumps(value, ensure_ascii=False), "json", PYTHONIOENCODING="ascii")
    assert (done.returncode, json.loads(done.stdout.decode("ascii"))) == (0, value)
    assert json.loads(printed(json.dumps("\udc80", ensure_ascii=True), "json").stdout) == "\udc80"


def test_a_reader_that_went_away_is_no_error():
    read, write = os.pipe()
    os.close(read)
    try:
        done = printed("x" * 100_000, stdout=write)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (141, b"")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full on this system")
def test_full_disk_behind_standard_output_is_explained():
    with open("/dev/full", "w") as full:
        done = printed("x", stdout=full.fileno())
    assert b"cannot write standard output: No space left" in done.stderr
    assert done.returncode == 1
