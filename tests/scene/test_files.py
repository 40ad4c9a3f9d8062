"""Reading files: bounded, and refused where there is no scene file."""

import errno
import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.files import MAX_BYTES, read_bytes
from lagrange_cli.scene import read_file


def message(path: str) -> str:
    with pytest.raises(InputError) as caught:
        read_file(path)
    (problem,) = caught.value.problems
    assert problem.mark is not None
    return problem.message


def test_missing_folder_and_odd_names(tmp_path: Path) -> None:
    assert message(str(tmp_path / "no.yaml")) == "no such file"
    assert message(str(tmp_path)) == "this is a folder, not a scene file"
    assert message("a\0b") == "this is not the name of a file"
    assert message("") == "no such file"
    assert "cannot be read" in message("x" * 5000)


def test_unreadable_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> int:
        raise PermissionError(errno.EACCES, "Permission denied")

    path = tmp_path / "scene.yaml"
    path.write_text("name: a\n")
    monkeypatch.setattr(os, "open", refuse)
    assert message(str(path)) == "cannot be read: Permission denied"


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_without_a_writer_does_not_hang(tmp_path: Path) -> None:
    path = tmp_path / "pipe.yaml"
    os.mkfifo(path)
    assert message(str(path)) == "this is not a regular file"


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero on this system")
def test_an_endless_device_is_refused() -> None:
    assert message("/dev/zero") == "this is not a regular file"


def test_endless_standard_input_is_read_up_to_the_limit() -> None:
    code = "from lagrange_cli.scene import read_file; read_file('-')"
    with open("/dev/zero", "rb") as zero:
        done = subprocess.run(
            [sys.executable, "-c", code], stdin=zero, capture_output=True, timeout=60, check=False
        )
    assert b"<stdin>:1:1: larger than 4 MiB" in done.stderr


def test_size_limit(tmp_path: Path) -> None:
    path = tmp_path / "scene.yaml"
    text = b"particles: {a: {mass: 1}}\n#"
    path.write_bytes(text + b" " * (MAX_BYTES - len(text)))
    assert read_file(str(path)).name == "scene"
    path.write_bytes(text + b" " * (MAX_BYTES - len(text) + 1))
    assert message(str(path)) == "larger than 4 MiB"


def test_standard_input(monkeypatch: pytest.MonkeyPatch) -> None:
    data = io.TextIOWrapper(io.BytesIO(b"particles: {a: {mass: 1}}\n"))
    monkeypatch.setattr(sys, "stdin", data)
    scene = read_file("-")
    assert (scene.file, scene.name) == ("<stdin>", "stdin")


def test_bytes_are_those_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(bytes(range(256)))
    assert read_bytes(str(path)) == bytes(range(256))
