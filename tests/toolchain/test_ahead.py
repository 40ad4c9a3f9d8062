"""Libraries compiled ahead, while other work is done: once, and nothing of them is left behind."""

from __future__ import annotations

import contextlib
import os
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from lagrange_cli.cache import open_cache
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import (
    CSource,
    compilations_ahead,
    compile_ahead,
    load_libraries,
)
from tests.simulate.compiling import skip_without_compiler

SOURCE = CSource({"answer.c": "int answer(void) { return 42; }\n"})

SCENE = """
particles: {bob: {mass: 1, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: sin(theta), y: 0, z: -cos(theta)}
potentials: {weight: 9.81*z}
initial: {theta: 1.0}
simulate: {until: 1.0}
"""

#: Refused when it is reduced: no angle has this sine.
CONTRADICTION = SCENE + "constraints: {wall: x = 5}\n"

#: A compiler that notes that it was called, with an end of a pipe that its child has too.
HANGS = """
import os, subprocess, time
writer = os.open({pipe!r}, os.O_WRONLY)
subprocess.Popen(["sleep", "60"], pass_fds=[writer])
open({log!r}, "a").write("called\\n")
time.sleep(60)
"""

#: One that does its work.
WORKS = """
import os, sys
open({log!r}, "a").write("called\\n")
os.execv({real!r}, [{real!r}, *sys.argv[1:]])
"""


def _command(path: Path, body: str) -> Path:
    path.write_text(f"#!{sys.executable}\n{body}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def place(monkeypatch, tmp_path) -> Path:
    """An empty cache, and a folder of temporary files."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    (tmp_path / "temporary").mkdir()
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr("tempfile.tempdir", None)
    return tmp_path


@pytest.fixture
def calls(monkeypatch, place) -> Callable[[], int]:
    """A compiler that does its work; gives how often it was called."""
    try:
        real = find_compiler().command[0]
    except CompileError as error:
        skip_without_compiler(error.reason)
    log = place / "log"
    log.touch()
    body = WORKS.format(log=str(log), real=real)
    monkeypatch.setenv("CC", str(_command(place / "working", body)))
    return lambda: len(log.read_text().splitlines())


@pytest.fixture
def hanging(monkeypatch, place) -> Iterator[Callable[[], bool]]:
    """A compiler that takes long; gives what says whether all of its processes have ended."""
    os.mkfifo(place / "pipe")
    reader = os.open(place / "pipe", os.O_RDONLY | os.O_NONBLOCK)
    body = HANGS.format(pipe=str(place / "pipe"), log=str(place / "log"))
    monkeypatch.setenv("CC", str(_command(place / "hanging", body)))

    def ended() -> bool:
        for _ in range(3000):
            try:
                return not os.read(reader, 100)
            except BlockingIOError:
                time.sleep(0.1)
        return False

    yield ended
    os.close(reader)


def _wait_for(path: Path) -> None:
    for _ in range(3000):
        if path.exists():
            return
        time.sleep(0.1)
    raise AssertionError(f"{path} does not appear")


def _left(place: Path) -> list[str]:
    return os.listdir(place / "temporary")


def _answer() -> int:
    library = load_libraries(find_compiler(), [SOURCE], open_cache())[0]
    return int(library.answer())


def test_what_was_begun_is_fetched_and_kept(calls, place):
    with compilations_ahead():
        compile_ahead(SOURCE, open_cache())
        compile_ahead(SOURCE, open_cache())
        assert _answer() == 42
        assert calls() == 1
        compile_ahead(SOURCE, open_cache())
    assert _answer() == 42
    assert calls() == 1
    assert _left(place) == []


def test_nothing_is_begun_outside_nor_without_a_compiler(calls, place, monkeypatch):
    compile_ahead(SOURCE, open_cache())
    with compilations_ahead():
        pass
    compile_ahead(SOURCE, open_cache())
    assert calls() == 0
    monkeypatch.setenv("CC", str(place / "absent"))
    with compilations_ahead():
        compile_ahead(SOURCE, open_cache())
    assert _left(place) == []


def test_what_fails_ahead_fails_when_it_is_loaded(calls, place):
    wrong = CSource({"wrong.c": "int answer(void) { return }\n"})
    with compilations_ahead():
        compile_ahead(wrong, open_cache())
        with pytest.raises(CompileError, match="error"):
            load_libraries(find_compiler(), [wrong], open_cache())
    assert _left(place) == []


@pytest.mark.parametrize("refused", [False, True])
def test_what_nobody_fetches_is_stopped(hanging, place, refused):
    def work() -> None:
        with compilations_ahead():
            compile_ahead(SOURCE, open_cache())
            _wait_for(place / "log")
            if refused:
                raise KeyboardInterrupt

    if refused:
        with pytest.raises(KeyboardInterrupt):
            work()
    else:
        work()
    assert hanging()
    assert _left(place) == []


@pytest.mark.usefixtures("hanging")
def test_a_deadline_counts_when_it_is_fetched(place):
    with compilations_ahead():
        compile_ahead(SOURCE, open_cache())
        _wait_for(place / "log")
        with pytest.raises(CompileError, match="took more than"):
            load_libraries(find_compiler(), [SOURCE], open_cache(), time.perf_counter() + 0.2)
    assert _left(place) == []


def _simulate(scene: str) -> subprocess.Popen[bytes]:
    words = [sys.executable, "-m", "lagrange_cli", "simulate", "-"]
    pipe = subprocess.PIPE
    process = subprocess.Popen(words, stdin=pipe, stdout=pipe, stderr=pipe)
    assert process.stdin is not None
    process.stdin.write(scene.encode())
    process.stdin.close()
    return process


@pytest.mark.slow
def test_a_command_compiles_the_integrators_once(calls, place):
    with _simulate(SCENE) as process:
        assert process.wait(120) == 0
    assert calls() == 2
    assert len(list((place / "cache" / "lagrange").glob("*.so"))) == 2
    assert _left(place) == []


@pytest.mark.slow
def test_a_refused_scene_leaves_no_compiler(hanging, place):
    with _simulate(CONTRADICTION) as process:
        assert process.wait(120) == 2
    assert hanging()  # The scene may be refused before the compiler runs.
    assert _left(place) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_command_that_is_ended_leaves_no_compiler(hanging, place, number):
    # A short motion may end in Python before it looks for the signal that has ended the compiler.
    with _simulate(SCENE.replace("until: 1.0", "until: 10000")) as process:
        _wait_for(place / "log")
        # Code in C that runs just then may swallow an interrupt; a user presses the keys again.
        while process.poll() is None:
            process.send_signal(number)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(3)
        # Shells report the same of a process that its signal ended.
        assert process.returncode in (128 + number, -number)
    assert hanging()
    assert _left(place) == []
