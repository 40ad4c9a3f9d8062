"""What every test shares: a cache that is not the user's, marks, and the switch of goldens."""

from __future__ import annotations

import gc
import itertools
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from lagrange_cli.cli.main import COLLECTION


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--update-goldens",
        action="store_true",
        help="write expected outputs and messages anew; read the difference before committing it",
    )


def pytest_collection_finish() -> None:
    """Collect garbage as seldom as the command does, and never what is there before any test."""
    gc.set_threshold(*COLLECTION)
    gc.freeze()


@pytest.fixture
def updates(request: pytest.FixtureRequest) -> bool:
    """Whether expected outputs are to be written anew."""
    return bool(request.config.getoption("--update-goldens"))


@pytest.fixture(scope="session", autouse=True)
def caches(tmp_path_factory) -> Iterator[Iterator[Path]]:
    """Names of folders for caches; tests share another, with what was compiled for others.

    The one that is shared is that of all processes of ``pytest -n``, whose temporary folders lie
    side by side: kernels are compiled once for them all.
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
        # Making matplotlib's list of fonts takes seconds: once is enough.
        patch.setenv("MPLCONFIGDIR", os.environ.get("MPLCONFIGDIR") or str(shared / "matplotlib"))
        yield names


@pytest.fixture
def cache_folder(caches, monkeypatch) -> Path:
    """Where this test's cache is, in its subprocesses too; nothing is there yet."""
    base = next(caches)
    monkeypatch.setenv("XDG_CACHE_HOME", str(base))
    return base / "lagrange"
