"""Whether two names are one file, whatever they look like."""

from __future__ import annotations

import os

import pytest

from lagrange_cli.errors import InputError
from lagrange_cli.files import Named, require_apart


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "sub").mkdir()
    (tmp_path / "scene").write_text("scene")
    (tmp_path / "link").symlink_to("scene")
    os.link(tmp_path / "scene", tmp_path / "hard")
    (tmp_path / "loop").symlink_to("sub/..")
    return tmp_path


SPELLINGS = ("scene", "./scene", "sub/../scene", "link", "hard", "loop/scene", "ABSOLUTE")


@pytest.mark.parametrize("output", SPELLINGS)
@pytest.mark.parametrize("read", ["scene", "link", "hard"])
def test_every_spelling_is_the_same_file(folder, read, output):
    output = output.replace("ABSOLUTE", str(folder / "scene"))
    with pytest.raises(InputError, match="would replace the scene"):
        require_apart([Named("the scene", read)], [Named("-o", output)])


def test_standard_input_that_comes_from_a_file_counts(folder):
    before = os.dup(0)
    handle = os.open(folder / "scene", os.O_RDONLY)
    try:
        os.dup2(handle, 0)
        for read in ("-", "/dev/stdin"):
            with pytest.raises(InputError, match="would replace the scene"):
                require_apart([Named("the scene", read)], [Named("-o", "hard")])
    finally:
        os.dup2(before, 0)
        os.close(before)
        os.close(handle)


@pytest.mark.parametrize(
    ("first", "second"),
    [("new", "./new"), ("new", "loop/new"), ("sub/new", "sub/../sub/new"), ("hard", "link")],
)
def test_two_outputs_that_are_one_file_are_refused(folder, first, second):
    with pytest.raises(InputError, match="--plot and -o name one file"):
        require_apart([], [Named("--plot", first), Named("-o", second)])


def test_other_files_devices_and_what_is_not_there_are_no_clash(folder):
    (folder / "copy").write_text("scene")
    reads = [Named("the scene", "scene"), Named("a recorded input", "nowhere"), Named("x", "-")]
    writes = [Named("-o", "copy"), Named("--plot", "new"), Named("--junit", "nowhere")]
    devices = [Named("-o", os.devnull), Named("--plot", os.devnull), Named("-o", "sub")]
    require_apart([*reads, Named("y", os.devnull)], [*writes, *devices])
