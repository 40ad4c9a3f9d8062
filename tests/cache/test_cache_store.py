"""What is kept comes back as it was, or not at all."""

from __future__ import annotations

import os
import resource
import stat
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lagrange_cli.cache import Cache, digest, open_cache, store

KEY = digest("a key")
OTHER = digest("another key")
DAY = 24 * 3600


@pytest.fixture
def cache(cache_folder) -> Cache:
    opened = open_cache()
    assert opened.reason is None
    return opened


def files(cache: Cache) -> list[Path]:
    assert cache.folder is not None
    return sorted(Path(cache.folder).iterdir())


def only(cache: Cache) -> Path:
    (path,) = files(cache)
    return path


def name_of(cache: Cache, data: bytes, suffix: str = ".json") -> str:
    """The name that an entry of KEY with these bytes has; nothing is there any more."""
    cache.put(KEY, data, suffix)
    (name,) = (p.name for p in files(cache) if p.name.startswith(KEY) and p.suffix == suffix)
    os.unlink(os.path.join(cache.folder, name))
    return name


def age(path: Path, seconds: float) -> None:
    then = time.time() - seconds
    os.utime(path, (then, then))


@pytest.mark.parametrize("data", [b"", b"{}", bytes(range(256)) * 4096])
@pytest.mark.parametrize("suffix", [".json", ".so", ".db"])
def test_what_was_put_comes_back(cache, data, suffix):
    assert cache.get(KEY, suffix) is None
    assert cache.put(KEY, data, suffix)
    assert cache.get(KEY, suffix) == data
    assert Path(cache.path(KEY, suffix)).read_bytes() == data
    assert cache.get(OTHER, suffix) is None
    assert open_cache().get(KEY, suffix) == data


def test_kinds_are_kept_apart(cache):
    cache.put(KEY, b"text")
    assert cache.path(KEY, ".so") is None
    cache.put(KEY, b"object", ".so")
    assert (cache.get(KEY), cache.get(KEY, ".so")) == (b"text", b"object")
    assert [entry.suffix for entry in cache.entries()].count(".so") == 1


@pytest.mark.parametrize("key", ["", "x", "../" * 22, KEY.upper(), KEY + "0", KEY[:-1] + "\n"])
def test_what_is_no_hash_is_no_key(cache, key):
    with pytest.raises(ValueError, match="no key"):
        cache.put(key, b"")
    with pytest.raises(ValueError, match="no key"):
        cache.get(key)


def test_what_is_no_kind_is_no_key(cache):
    with pytest.raises(ValueError, match="no key"):
        cache.put(KEY, b"", "/../../x.so")


def test_others_cannot_read_what_is_kept(cache):
    previous = os.umask(0)
    try:
        cache.put(KEY, b"mine")
    finally:
        os.umask(previous)
    assert stat.S_IMODE(only(cache).stat().st_mode) == 0o600
    assert stat.S_IMODE(os.stat(cache.folder).st_mode) == 0o700


@given(st.binary(min_size=1, max_size=60), st.data())
@settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
def test_damage_is_never_shown(cache, data, draw):
    cache.clear()
    cache.put(KEY, data)
    damaged = draw.draw(st.binary(max_size=60).filter(lambda other: other != data))
    only(cache).write_bytes(damaged)
    assert cache.get(KEY) is None
    assert files(cache) == []
    assert cache.put(KEY, data)
    assert cache.get(KEY) == data


def test_a_planted_entry_is_not_used(cache):
    honest = name_of(cache, b"honest")
    for name in (honest, name_of(cache, b"honest", ".so")):
        (Path(cache.folder) / name).write_bytes(b"planted")
    for name in (f"{KEY}.json", f"{KEY}-.json", f"{honest}.json", f"{KEY}.so"):
        (Path(cache.folder) / name).write_bytes(b"honest")
    assert cache.get(KEY) is None
    assert cache.path(KEY) is None


@pytest.mark.parametrize("suffix", [".json", ".so", ".db"])
@pytest.mark.parametrize("key", [KEY, OTHER], ids=["same", "other"])
@pytest.mark.parametrize("kind", [".json", ".so"])
def test_an_intact_entry_under_the_name_of_another_is_not_used(cache, suffix, key, kind):
    cache.put(KEY, b"answer", suffix)
    name = only(cache).name
    foreign = Path(cache.folder) / (key + name[64 : -len(suffix)] + kind)
    only(cache).rename(foreign)
    if foreign.name == name:
        assert cache.get(KEY, suffix) == b"answer"
        return
    assert cache.path(key, kind) is None
    assert files(cache) == []


def test_a_link_in_place_of_an_entry_is_not_followed(cache, tmp_path):
    target = tmp_path / "target"
    target.write_bytes(b"honest")
    link = Path(cache.folder) / name_of(cache, b"honest")
    link.symlink_to(target)
    assert cache.get(KEY) is None
    assert target.read_bytes() == b"honest"
    assert not link.is_symlink()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes on this system")
def test_a_pipe_in_place_of_an_entry_does_not_wait(cache):
    os.mkfifo(Path(cache.folder) / name_of(cache, b""))
    assert cache.get(KEY) is None


@pytest.fixture
def folder_in_place(cache, tmp_path) -> Path:
    """A folder that is called as an entry of KEY, with a link out of it."""
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "file").write_bytes(b"outside")
    folder = Path(cache.folder) / name_of(cache, b"x")
    (folder / "below").mkdir(parents=True)
    (folder / "below" / "file").write_bytes(b"below")
    (folder / "link").symlink_to(tmp_path / "outside")
    return folder


def test_a_folder_in_place_of_an_entry_goes(cache, folder_in_place, tmp_path):
    open_files = os.listdir("/proc/self/fd") if os.path.isdir("/proc/self/fd") else []
    assert cache.get(KEY) is None
    assert not folder_in_place.exists()
    assert cache.put(KEY, b"x")
    assert cache.get(KEY) == b"x"
    assert (tmp_path / "outside" / "file").read_bytes() == b"outside"
    if open_files:
        assert len(os.listdir("/proc/self/fd")) == len(open_files)


def test_a_folder_in_place_of_an_entry_is_cleared(cache, folder_in_place, tmp_path):
    (Path(cache.folder) / "folder").mkdir()
    assert cache.clear().files == 1
    assert [path.name for path in files(cache)] == ["folder"]
    assert (tmp_path / "outside" / "file").read_bytes() == b"outside"


def test_a_folder_that_cannot_be_removed_is_no_failure(cache, folder_in_place, monkeypatch):
    def refuse(*words, **more):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(os, "rmdir", refuse)
    assert cache.get(KEY) is None
    assert not cache.put(KEY, b"x")
    assert "cannot be written" in cache.reason
    assert cache.clear() == (0, 0, 1)


def test_an_entry_of_another_user_is_not_used(cache, monkeypatch):
    cache.put(KEY, b"theirs")
    monkeypatch.setattr(os, "geteuid", lambda: os.getuid() + 1)
    assert cache.get(KEY) is None


def test_of_two_entries_of_a_key_an_intact_one_is_used(cache):
    cache.put(KEY, b"one")
    cache.put(KEY, b"two")
    assert len(files(cache)) == 2
    first = cache.get(KEY)
    assert first in (b"one", b"two")
    Path(cache.path(KEY, ".json")).write_bytes(b"damaged")
    assert cache.get(KEY) == ({b"one", b"two"} - {first}).pop()


@contextmanager
def no_file_larger_than(size: int):
    """As on a disk that becomes full while a file is written."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_a_disk_that_becomes_full_leaves_nothing_half_written(cache):
    cache.put(OTHER, b"small")
    with no_file_larger_than(4096):
        assert not cache.put(KEY, bytes(100_000))
    assert "cannot be written: File too large" in cache.reason
    assert cache.get(KEY) is None
    assert cache.get(OTHER) == b"small"
    assert len(files(cache)) == 1
    assert cache.put(KEY, bytes(100_000))


def test_a_folder_that_disappears_is_no_failure(cache):
    os.rmdir(cache.folder)
    assert not cache.put(KEY, b"x")
    assert "No such file" in cache.reason
    assert (cache.get(KEY), cache.entries(), cache.clear()) == (None, [], (0, 0, 0))


def test_least_recently_used_entries_go_beyond_the_largest_number(cache, monkeypatch):
    monkeypatch.setattr(store, "MAX_CACHE_ENTRIES", 3)
    keys = [digest(str(n)) for n in range(5)]
    for n, key in enumerate(keys[:3]):
        cache.put(key, b"%d" % n)
        age(next(p for p in files(cache) if p.name.startswith(key)), (10 - n) * DAY)
    assert cache.get(keys[0]) == b"0"  # used today
    cache.put(keys[3], b"3")
    cache.put(keys[4], b"4")
    assert [cache.get(key) for key in keys] == [b"0", None, None, b"3", b"4"]


def test_least_recently_used_entries_go_beyond_the_largest_size(cache, monkeypatch):
    monkeypatch.setattr(store, "MAX_CACHE_BYTES", 1000)
    cache.put(KEY, bytes(600))
    age(only(cache), 2 * DAY)
    cache.put(OTHER, bytes(600))
    assert cache.get(KEY) is None
    assert cache.get(OTHER) == bytes(600)
    assert not cache.put(KEY, bytes(1001))
    assert cache.get(OTHER) == bytes(600)


@pytest.mark.parametrize(("seconds", "noted"), [(2 * DAY, True), (3600, False), (-2 * DAY, True)])
def test_use_is_noted_once_a_day(cache, seconds, noted):
    cache.put(KEY, b"x")
    age(only(cache), seconds)
    before = only(cache).stat().st_mtime
    cache.get(KEY)
    assert (only(cache).stat().st_mtime != before) == noted
    assert not noted or abs(only(cache).stat().st_mtime - time.time()) < 60


def test_what_killed_processes_left_is_swept_at_once(cache):
    left = [Path(cache.folder) / f".lagrange-1-{n:032x}.tmp" for n in range(2)]
    for path in left:
        path.write_bytes(b"half")
    cache.put(KEY, b"x")
    assert [path.exists() for path in left] == [False, False]
    assert len(cache.entries()) == 1


def test_clearing_removes_our_files_and_no_other(cache):
    cache.put(KEY, b"four")
    cache.put(KEY, b"object", ".so")
    (Path(cache.folder) / f".lagrange-1-{0:032x}.tmp").write_bytes(b"h")
    others = ["notes.txt", f"{KEY}.json", ".hidden", "x" * 133 + ".json", f"{KEY}-{KEY}.txt"]
    for name in others:
        (Path(cache.folder) / name).write_bytes(b"kept")
    (Path(cache.folder) / "folder").mkdir()
    assert cache.clear() == (3, 11, 0)
    assert {path.name for path in files(cache)} == {*others, "folder"}
    assert cache.compiler_folder is not None
    (Path(cache.compiler_folder) / "o").mkdir(parents=True)
    assert cache.clear().files == 1
    assert {path.name for path in files(cache)} == {*others, "folder"}
    assert cache.clear() == (0, 0, 0)


def test_what_others_remove_or_write_meanwhile_is_no_failure_to_clear(cache, monkeypatch):
    for text in ("removed by another", "written again"):
        cache.put(digest(text), text.encode())
    unlink = os.unlink

    def meanwhile(path):
        unlink(path)
        if Path(path).name.startswith(digest("removed by another")):
            raise FileNotFoundError(2, "No such file or directory")
        cache.put(digest("written again"), b"written again")

    monkeypatch.setattr(os, "unlink", meanwhile)
    assert cache.clear() == (1, len("written again"), 0)
    assert len(files(cache)) == 1


WORK = """
import sys
from lagrange_cli.cache import digest, open_cache
cache, bad = open_cache(), 0
for n in range(300):
    key = digest(str(n % 7))
    data = f"{n % 7} {n % 3} ".encode() * 2000
    if sys.argv[1] == "put":
        cache.put(key, data)
    elif sys.argv[1] == "clear":
        cache.clear()
    else:
        found = cache.get(key)
        words = set(zip(*[iter((found or b"").split())] * 2))
        bad += found is not None and (
            len(found) != len(data) or len(words) != 1 or words.pop()[0] != b"%d" % (n % 7)
        )
sys.exit(bad)
"""


@pytest.mark.slow
def test_processes_side_by_side_see_whole_entries_or_none(cache):
    roles = ["put", "put", "get", "get", "clear"]
    running = [subprocess.Popen([sys.executable, "-c", WORK, role]) for role in roles]
    assert [process.wait(timeout=60) for process in running] == [0] * len(roles)
    assert not [path for path in files(cache) if path.suffix == ".tmp"]
    assert all(cache.get(entry.name[:64]) is not None for entry in cache.entries())
