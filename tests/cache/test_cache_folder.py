"""Only a folder that is the user's alone is used, and where there is none it is said why."""

from __future__ import annotations

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.cache import digest, open_cache

KEY = digest("a key")


def refusal(cache) -> str:
    """Why a cache keeps nothing, having tried everything with it."""
    assert cache.get(KEY) is None
    assert not cache.put(KEY, b"x")
    assert not cache.put(KEY, b"x", ".so")
    assert cache.path(KEY) is None
    assert cache.entries() == []
    assert cache.clear() == (0, 0, 0)
    return cache.reason


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


class TestPlace:
    def test_folder_named_by_the_environment(self, cache_folder):
        assert open_cache().folder == str(cache_folder)
        assert mode(cache_folder) == 0o700

    @pytest.mark.parametrize("value", [None, "", "relative/path", "."])
    def test_home_where_the_environment_names_no_absolute_path(self, value, tmp_path, monkeypatch):
        monkeypatch.setenv("HOME", str(tmp_path))
        monkeypatch.chdir(tmp_path)
        if value is None:
            monkeypatch.delenv("XDG_CACHE_HOME")
        else:
            monkeypatch.setenv("XDG_CACHE_HOME", value)
        assert open_cache().folder == str(tmp_path / ".cache" / "lagrange")
        assert os.listdir(tmp_path) == [".cache"]

    def test_no_home_in_the_environment(self, monkeypatch):
        monkeypatch.delenv("HOME", raising=False)
        monkeypatch.delenv("XDG_CACHE_HOME")
        # Not opened: it is that of whoever runs the tests.
        monkeypatch.setattr(os, "makedirs", lambda *a, **k: (_ for _ in ()).throw(OSError("no")))
        home = os.path.expanduser("~")
        assert os.path.realpath(home) in refusal(open_cache())

    @pytest.mark.parametrize("home", ["", "relative", "/nonexistent/home"])
    def test_home_that_is_none_is_not_made(self, home, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        monkeypatch.setenv("HOME", home)
        monkeypatch.delenv("XDG_CACHE_HOME")
        assert "there is no home folder" in refusal(open_cache())
        assert os.listdir(tmp_path) == []
        assert not os.path.exists("/nonexistent")

    def test_base_behind_a_link_of_the_user(self, tmp_path, monkeypatch):
        (tmp_path / "disk").mkdir()
        (tmp_path / "link").symlink_to("disk")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "link"))
        assert open_cache().folder == str(tmp_path / "disk" / "lagrange")


class TestSwitch:
    @pytest.mark.parametrize("value", ["on", ""])
    def test_on(self, value, monkeypatch):
        monkeypatch.setenv("LAGRANGE_CACHE", value)
        assert open_cache().reason is None

    def test_off(self, cache_folder, monkeypatch):
        monkeypatch.setenv("LAGRANGE_CACHE", "off")
        assert refusal(open_cache()) == "LAGRANGE_CACHE is off"
        assert not cache_folder.exists()

    def test_neither(self, monkeypatch):
        monkeypatch.setenv("LAGRANGE_CACHE", "of")
        assert refusal(open_cache()) == "LAGRANGE_CACHE is neither on nor off but 'of'"


class TestUnusable:
    def test_base_is_a_file(self, cache_folder):
        cache_folder.parent.write_text("kept")
        assert "cannot be used" in refusal(open_cache())
        assert cache_folder.parent.read_text() == "kept"

    def test_base_cannot_be_made(self, monkeypatch):
        monkeypatch.setenv("XDG_CACHE_HOME", os.path.join(os.devnull, "cache"))
        assert "cannot be used: Not a directory" in refusal(open_cache())

    def test_base_is_too_long_a_name(self, monkeypatch):
        monkeypatch.setenv("XDG_CACHE_HOME", "/" + "x" * 5000)
        assert "cannot be used: File name too long" in refusal(open_cache())

    def test_folder_is_a_file(self, cache_folder):
        cache_folder.parent.mkdir()
        cache_folder.write_text("kept")
        assert refusal(open_cache()) == f"'{cache_folder}' is not a folder"
        assert cache_folder.read_text() == "kept"

    def test_folder_is_a_link(self, cache_folder, tmp_path):
        elsewhere = tmp_path / "elsewhere"
        elsewhere.mkdir(mode=0o755)
        cache_folder.parent.mkdir()
        cache_folder.symlink_to(elsewhere)
        assert refusal(open_cache()) == f"'{cache_folder}' is not a folder"
        assert mode(elsewhere) == 0o755
        assert os.listdir(elsewhere) == []

    def test_folder_of_another_user(self, cache_folder, monkeypatch):
        open_cache().put(KEY, b"theirs")
        monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
        assert "belongs to another user" in refusal(open_cache())
        monkeypatch.undo()
        assert len(os.listdir(cache_folder)) == 1

    def test_a_folder_above_that_every_user_can_write(self, cache_folder):
        cache_folder.parent.mkdir()
        cache_folder.parent.chmod(0o777)
        reason = refusal(open_cache())
        assert reason == f"every user can write to '{cache_folder.parent}'"
        assert not cache_folder.exists()

    def test_a_folder_above_where_all_keep_their_own(self, cache_folder):
        cache_folder.parent.mkdir()
        cache_folder.parent.chmod(0o1777)
        assert open_cache().put(KEY, b"x")


class TestPermissions:
    def test_what_others_could_read_is_closed(self, cache_folder):
        open_cache().put(KEY, b"x")
        cache_folder.chmod(0o755)
        assert open_cache().get(KEY) == b"x"
        assert mode(cache_folder) == 0o700

    @pytest.mark.parametrize("open_to", [0o770, 0o707])
    def test_what_others_could_write_is_emptied_as_well(self, open_to, cache_folder):
        open_cache().put(KEY, b"x")
        cache_folder.chmod(open_to)
        cache = open_cache()
        assert cache.get(KEY) is None
        assert mode(cache_folder) == 0o700
        assert cache.put(KEY, b"x")


PROGRAM = """
from lagrange_cli.cache import digest, open_cache
cache, key = open_cache(), digest("a key")
print(cache.get(key), cache.put(digest("new"), bytes(100_000)), len(cache.entries()), cache.reason)
"""

OBJECT = """
from lagrange_cli.cache import digest, open_cache
cache, key = open_cache(), digest("a key")
print(cache.put(key, b"text"), cache.put(key, b"object", ".so"), len(cache.entries()), cache.reason)
"""


def mounted(options: str, folder: Path, keep: str = "pass", program: str = PROGRAM) -> str:
    """What a program prints where a small file system is mounted on a folder.

    ``keep`` is run before it is mounted again with the options.
    """
    folder.mkdir()
    script = (
        'mount -t tmpfs -o size=64k,mode=700 none "$1" && "$2" -c "$3" && '
        'mount -o "remount,$5" "$1" && exec "$2" -c "$4"'
    )
    words = ["sh", "-c", script, "sh", str(folder), sys.executable, keep, program, options]
    done = subprocess.run(
        ["unshare", "--mount", *words],
        env=os.environ | {"XDG_CACHE_HOME": str(folder)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    if done.returncode != 0 and ("unshare" in done.stderr or "mount" in done.stderr):
        pytest.skip(f"nothing can be mounted here: {done.stderr.strip()}")
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0, reason="only root can mount")
class TestFileSystems:
    KEEP = "from lagrange_cli.cache import *; assert open_cache().put(digest('a key'), b'kept')"

    def test_full(self, tmp_path):
        said = mounted("size=64k", tmp_path / "small", self.KEEP)
        assert said.startswith("b'kept' False 1 ")
        assert said.endswith("cannot be written: No space left on device")

    def test_read_only(self, tmp_path):
        said = mounted("ro", tmp_path / "fixed", self.KEEP)
        assert said.startswith("b'kept' False 1 ")
        assert "is read-only" in said or "Read-only" in said

    def test_read_only_and_empty(self, tmp_path):
        said = mounted("ro", tmp_path / "fixed")
        assert said.startswith("None False 0 ")
        assert said.endswith("cannot be used: Read-only file system")

    def test_without_execution(self, tmp_path):
        said = mounted("noexec", tmp_path / "inert", program=OBJECT)
        assert said == f"True False 1 code in '{tmp_path / 'inert' / 'lagrange'}' cannot be run"
