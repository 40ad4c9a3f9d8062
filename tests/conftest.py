"""What every test shares: a cache that is not the user's, marks, and the switch of goldens."""

from __future__ import annotations

import gc
import itertools
import os
import shlex
import shutil
import signal
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from lagrange_cli.cli.main import COLLECTION

# Tests and the processes that they start share compiled bytecode, even if the environment asks for
# none: each of some hundred processes would compile every module that it imports.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False


def _restore_signals() -> None:
    """Let child processes have the usual signals where this one ignores them.

    Processes in the background or under nohup inherit that SIGINT or SIGHUP is ignored, and pass it
    on; a handler is not passed on. SIGHUP still does nothing here.
    """
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        signal.signal(signal.SIGHUP, lambda number, frame: None)


# Properties have budgets in examples, of which campaigns try more; none fails for being slow.
settings.register_profile(
    "suite", deadline=None, max_examples=50, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("campaigns", settings.get_profile("suite"), max_examples=200)


def pytest_configure(config: pytest.Config) -> None:
    _restore_signals()
    settings.load_profile("campaigns" if config.getoption("--campaigns") else "suite")
    # Garbage is collected as seldom as in the command.
    gc.set_threshold(*COLLECTION)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-goldens",
        action="store_true",
        help="write expected outputs and messages anew; read the difference before committing it",
    )
    parser.addoption(
        "--campaigns",
        action="store_true",
        help="run tests marked 'campaign' too: every case where the suite runs a slice of them",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave campaigns out, unless they are asked for."""
    if config.getoption("--campaigns"):
        return
    left_out = [item for item in items if item.get_closest_marker("campaign")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("campaign")]


def pytest_collection_finish() -> None:
    """Leave what is there before any test to no collection of garbage."""
    gc.freeze()


@pytest.fixture
def frozen_garbage() -> None:
    """Leave what is there before a test to no collection of garbage, where the test times runs.

    A collection before each timed run takes a third of a second of what other tests have left.
    """
    gc.freeze()


@pytest.fixture
def updates(request: pytest.FixtureRequest) -> bool:
    """Whether expected outputs are to be written anew."""
    return bool(request.config.getoption("--update-goldens"))


#: Paths of C compilers by their names.
COMPILERS = {name: path for name in ("cc", "gcc") if (path := shutil.which(name))}

#: Optimizes shared objects lightly, and leaves all other options as they are.
_LIGHT_COMPILER = """\
#!/bin/sh
case " $* " in
*" -shared "*) exec {real} "$@" -Og ;;
*) exec {real} "$@" ;;
esac
"""


def _install_compilers(folder: Path) -> None:
    """Write compilers that optimize little; the first process of a run does, for all."""
    folder.mkdir(exist_ok=True)
    for name, real in COMPILERS.items():
        own = folder / f"{name}.{os.getpid()}"
        own.write_text(_LIGHT_COMPILER.format(real=shlex.quote(real)))
        own.chmod(0o700)
        with suppress(FileExistsError):
            os.link(own, folder / name)
        own.unlink()


@pytest.fixture(scope="session", autouse=True)
def caches(request, tmp_path_factory) -> Iterator[Iterator[Path]]:
    """Names of folders for caches; tests share another, with what was compiled for others.

    The one that is shared is that of all processes of ``pytest -n``, whose temporary folders lie
    side by side: kernels are compiled once for them all. Their optimization is light, but in
    campaigns, since compiling takes longer than what tests run.
    """
    base = tmp_path_factory.mktemp("caches")
    names = (base / str(number) for number in itertools.count())
    workers = "PYTEST_XDIST_WORKER" in os.environ
    shared = tmp_path_factory.getbasetemp().parent / "caches" if workers else base / "shared"
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("LAGRANGE_CACHE", raising=False)
        # What is printed has the width and the colours that are usual in pipes.
        for name in ("COLUMNS", "FORCE_COLOR", "CLICOLOR_FORCE"):
            patch.delenv(name, raising=False)
        patch.setenv("XDG_CACHE_HOME", str(shared))
        if not request.config.getoption("--campaigns"):
            compilers = shared.parent / "compilers"
            _install_compilers(compilers)
            patch.setenv("PATH", f"{compilers}{os.pathsep}{os.environ.get('PATH', os.defpath)}")
        # Making matplotlib's list of fonts takes seconds: once is enough.
        patch.setenv("MPLCONFIGDIR", os.environ.get("MPLCONFIGDIR") or str(shared / "matplotlib"))
        yield names


@pytest.fixture(scope="session")
def real_compiler() -> str:
    """The compiler of this machine with all options that it is given, as a value of ``CC``."""
    return shlex.quote(next(iter(COMPILERS.values()), ""))


@pytest.fixture(scope="session")
def unoptimizing_compiler(tmp_path_factory) -> str:
    """The compiler of this machine without optimization, as a value of ``CC``."""
    real = next(iter(COMPILERS.values()), None)
    if real is None:
        return ""
    path = tmp_path_factory.mktemp("compiler") / "cc"
    path.write_text(f'#!/bin/sh\nexec {shlex.quote(real)} "$@" -O0\n')
    path.chmod(0o700)
    return shlex.quote(str(path))


@pytest.fixture
def quick_compiler(unoptimizing_compiler, monkeypatch) -> None:
    """Code is compiled in half the time, where it is the subject what becomes of it."""
    monkeypatch.setenv("CC", unoptimizing_compiler)


@pytest.fixture
def without_packaged_compiler(monkeypatch) -> None:
    """No package brings a compiler, as where extras are not installed."""
    monkeypatch.setitem(sys.modules, "ziglang", None)


@pytest.fixture
def cache_folder(caches, monkeypatch) -> Path:
    """Where this test's cache is, in its subprocesses too; nothing is there yet."""
    base = next(caches)
    monkeypatch.setenv("XDG_CACHE_HOME", str(base))
    return base / "lagrange"
