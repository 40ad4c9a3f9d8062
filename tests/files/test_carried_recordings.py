"""Recordings are read once and carried: another folder's file of that name is not looked at."""

from __future__ import annotations

import os

import pytest

from lagrange_cli.errors import InputError, Mark
from lagrange_cli.files import Recording, carried_files, read_recording, reading_carried


def recording(folder, file="f.csv"):
    place = Mark("scene.yaml", 1, 1)
    return Recording(file, str(folder), "F", place, place, "linear")


def test_contents_are_those_of_when_they_were_read(tmp_path):
    (tmp_path / "f.csv").write_text("t,F\n0,1\n1,2\n")
    declared = recording(tmp_path)
    files, before = carried_files([declared]), read_recording(declared)
    (tmp_path / "f.csv").write_text("t,F\n0,5\n1,6\n")
    now = declared.stamp
    with reading_carried(files):
        assert read_recording(declared) == before
        os.unlink(tmp_path / "f.csv")
        assert read_recording(declared) == before
        assert declared.stamp not in (now, ())
    assert declared.stamp == ()


def test_what_could_not_be_read_is_refused_in_the_same_words(tmp_path):
    missing, other = recording(tmp_path, "missing.csv"), recording(tmp_path, "other.csv")
    with pytest.raises(InputError) as here:
        read_recording(missing)
    files = carried_files([missing])
    (tmp_path / "missing.csv").write_text("t,F\n0,1\n1,2\n")
    (tmp_path / "other.csv").write_text("t,F\n0,1\n1,2\n")
    with reading_carried(files):
        with pytest.raises(InputError) as there:
            read_recording(missing)
        with pytest.raises(InputError, match="was not sent along"):
            read_recording(other)
    assert there.value.problems == here.value.problems
