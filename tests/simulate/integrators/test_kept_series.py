"""What heyoka compiles is kept in lagrange's cache alone, verified as all there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.cache import digest, open_cache
from lagrange_cli.simulate.integrators.external.heyoka_method import SUFFIX, compiled_once
from tests.simulate.available import or_skip

ROOT = Path(__file__).parents[3]
KEY = digest("of these tests")
RUN = ("simulate", "systems/pendulums/pendulum.yaml", "--method", "taylor", "--rtol", "1e-9", "-q")


class State:
    """What stands for heyoka's ``llvm_state``: it writes a file while it compiles."""

    def __init__(self) -> None:
        self.path, self.enabled = Path("/nowhere/heyoka"), True
        self.seen: list[bytes | None] = []

    def get_diskcache_path(self):
        return self.path

    def set_diskcache_path(self, path):
        # It closes its files.
        (self.path / "cache.db-wal").unlink(missing_ok=True)
        self.path = Path(path)

    def get_diskcache_enabled(self):
        return self.enabled

    def set_diskcache_enabled(self, enabled):
        self.enabled = enabled

    def build(self):
        if not self.enabled:
            self.seen.append(None)
            return "compiled"
        file = self.path / "cache.db"
        self.seen.append(file.read_bytes() if file.exists() else b"")
        file.write_bytes(b"code")
        (self.path / "cache.db-wal").write_bytes(b"")
        return "compiled"


@pytest.fixture
def state(cache_folder):
    return State()


def test_it_is_kept_and_found_again(state):
    for _ in range(2):
        assert compiled_once(state, KEY, state.build) == "compiled"
    assert state.seen == [b"", b"code"]
    assert open_cache().get(KEY, SUFFIX) == b"code"
    assert (state.path, state.enabled) == (Path("/nowhere/heyoka"), True)


def test_what_is_damaged_is_made_again(state):
    compiled_once(state, KEY, state.build)
    folder = open_cache().folder
    assert folder is not None
    (entry,) = Path(folder).glob(f"*{SUFFIX}")
    entry.write_bytes(b"cope")
    compiled_once(state, KEY, state.build)
    assert state.seen == [b"", b""]
    assert open_cache().get(KEY, SUFFIX) == b"code"


def test_another_key_is_another_code(state):
    compiled_once(state, KEY, state.build)
    compiled_once(state, digest("others"), state.build)
    assert state.seen == [b"", b""]


def test_nothing_is_kept_where_the_cache_is_off(state, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    assert compiled_once(state, KEY, state.build) == "compiled"
    assert state.seen == [None]
    assert state.enabled


def test_a_folder_that_cannot_be_made_is_done_without(state, monkeypatch, tmp_path):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "nowhere"))
    assert compiled_once(state, KEY, state.build) == "compiled"
    assert state.seen == [None]


def test_what_is_not_complete_is_not_kept(state):
    def interrupted():
        state.build()
        state.path.joinpath("cache.db-journal").write_bytes(b"half")
        return "compiled"

    assert compiled_once(state, KEY, interrupted) == "compiled"
    assert open_cache().get(KEY, SUFFIX) is None


def test_settings_are_what_they_were_after_a_failure(state):
    def fail():
        raise RuntimeError

    with pytest.raises(RuntimeError):
        compiled_once(state, KEY, fail)
    assert (state.path, state.enabled) == (Path("/nowhere/heyoka"), True)


@pytest.mark.slow
@pytest.mark.parametrize("switch", ["on", "off"])
def test_heyoka_writes_nothing_elsewhere(tmp_path, switch):
    or_skip("taylor")
    kept = {k: v for k, v in os.environ.items() if k != "XDG_CACHE_HOME"}
    environment = {**kept, "HOME": str(tmp_path), "LAGRANGE_CACHE": switch}

    def run(*words: str) -> str:
        command = [sys.executable, "-m", "lagrange_cli", *words]
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    first = run(*RUN).partition("Energy")[0]
    if switch == "on":
        assert run(*RUN).partition("Energy")[0] == first
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    if switch == "off":
        assert files == []
        return
    assert {path.parent for path in files} == {tmp_path / ".cache" / "lagrange"}
    assert [path.suffix for path in files].count(".db") == 1
    assert json.loads(run("cache", "--json"))["entries"]["compiled"] >= 1
    run("cache", "--clear")
    assert not any(path.is_file() for path in tmp_path.rglob("*"))
