"""``lagrange cache`` shows what is kept, and clears it."""

from __future__ import annotations

import json
import os
import re

from lagrange_cli.cache import MAX_CACHE_BYTES, Cache, digest
from tests.cli.terminal import lagrange, succeed

BEAD = "systems/lecture/bead_on_parabola.yaml"


def report(*words: str) -> dict:
    return json.loads(succeed("cache", "--json", *words))


def test_empty(cache_folder):
    assert report() == {
        "folder": str(cache_folder),
        "usable": True,
        "reason": None,
        "entries": {"answers": 0, "compiled": 0},
        "bytes": 0,
        "largest": MAX_CACHE_BYTES,
    }


def test_what_commands_leave_is_counted_and_cleared(cache_folder):
    succeed("derive", BEAD)
    succeed("derive", BEAD)
    succeed("emit", BEAD, "--to", "python")
    Cache(str(cache_folder)).put(digest("x"), bytes(5000), ".so")
    found = report()
    # Two commands left their answers, and the first the equations and their textbook form.
    assert found["entries"] == {"answers": 4, "compiled": 1}
    assert found["bytes"] == sum(path.stat().st_size for path in cache_folder.iterdir())
    text = succeed("cache")
    assert f"Folder   {cache_folder}\n" in text
    assert "4 answers, 1 compiled" in text
    assert re.search(r"[\d.]+ KiB of at most 256\.0 MiB", text)
    cleared = report("--clear")
    assert cleared["removed"] == {"files": 5, "bytes": found["bytes"]}
    assert (cleared["entries"], cleared["bytes"]) == ({"answers": 0, "compiled": 0}, 0)
    assert os.listdir(cache_folder) == []
    assert succeed("cache", "--clear") == "removed 0 files, 0 bytes\n"


def test_clearing_leaves_what_is_not_ours(cache_folder):
    succeed("derive", BEAD)
    (cache_folder / "notes.txt").write_text("kept")
    assert succeed("cache", "--clear").startswith("removed 3 files, ")
    assert os.listdir(cache_folder) == ["notes.txt"]


def test_unusable(monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    assert succeed("cache") == "Nothing is kept: LAGRANGE_CACHE is off\n"
    found = report()
    assert (found["folder"], found["usable"]) == (None, False)
    assert found["reason"] == "LAGRANGE_CACHE is off"
    done = lagrange("cache", "--clear")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "there is no cache to clear: LAGRANGE_CACHE is off\n"


def test_what_cannot_be_removed_is_told(cache_folder, monkeypatch):
    succeed("derive", BEAD)

    def refuse(path):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "unlink", refuse)
    done = lagrange("cache", "--clear")
    assert done.returncode == 2
    assert done.stderr == f"3 files in '{cache_folder}' cannot be removed\n"


def test_a_name_of_the_folder_does_not_steer_the_terminal(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "\x1b[2J"))
    assert "\x1b" not in succeed("cache")
    assert report()["folder"] == str(tmp_path / "\x1b[2J" / "lagrange")


def test_an_argument_is_refused():
    assert lagrange("cache", "clear").returncode == 2
