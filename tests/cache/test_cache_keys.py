"""Keys differ where anything differs that a result depends on."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import lagrange_cli
from lagrange_cli.cache import digest, fingerprint

PACKAGE = Path(lagrange_cli.__file__).parent
PARTS = st.lists(st.one_of(st.binary(max_size=4), st.text(max_size=4)), max_size=4)


@given(PARTS, PARTS)
def test_sequences_have_one_hash_exactly_if_they_are_the_same(first, second):
    assert (digest(*first) == digest(*second)) == (first == second)


def test_boundaries_and_kinds_of_parts_count():
    sequences = [("ab", "c"), ("a", "bc"), ("abc",), (b"abc",), ("abc", ""), ("", "abc"), ()]
    sequences += [("s1:a",), ("s1:a", "s1:a"), ("a1:", "b"), ("1:ab",)]
    assert len({digest(*parts) for parts in sequences}) == len(sequences)


def test_names_of_files_that_are_no_text_have_a_hash():
    assert digest(os.fsdecode(b"\xff.yaml")) != digest(os.fsdecode(b"\xfe.yaml"))


@pytest.fixture
def installed(tmp_path) -> Path:
    """A folder with a copy of what takes part, and stand-ins for two libraries."""
    for name in ("cache", "files"):
        shutil.copytree(PACKAGE / name, tmp_path / "lagrange_cli" / name)
    for name in ("__init__.py", "errors.py", "version.py"):
        shutil.copy2(PACKAGE / name, tmp_path / "lagrange_cli" / name)
    for name, file in (("sympy", "release.py"), ("numpy", "version.py")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("raise RuntimeError('imported')\n")
        (tmp_path / name / file).write_text("__version__ = '1.0'\n")
    return tmp_path


def fingerprint_of(installed: Path) -> str:
    program = "from lagrange_cli.cache import fingerprint; print(fingerprint())"
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"PYTHONPATH": str(installed)},
        cwd=installed,
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def add_module(installed: Path) -> None:
    (installed / "lagrange_cli" / "more.py").write_text("")


def add_kernel(installed: Path) -> None:
    (installed / "lagrange_cli" / "cache" / "kernel.c").write_text("")


def add_template(installed: Path) -> None:
    (installed / "lagrange_cli" / "cache" / "solve.c.in").write_text("")


def remove_module(installed: Path) -> None:
    (installed / "lagrange_cli" / "cache" / "unused.py").unlink()


def edit_module(installed: Path) -> None:
    with (installed / "lagrange_cli" / "errors.py").open("a") as file:
        file.write("# more\n")


def edit_to_the_same_size(installed: Path) -> None:
    path = installed / "lagrange_cli" / "errors.py"
    before = path.stat()
    path.write_text(path.read_text())
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns + 1))


def another_sympy(installed: Path) -> None:
    path = installed / "sympy" / "release.py"
    before = path.stat()
    path.write_text("__version__ = '1.1'\n")
    os.utime(path, ns=(before.st_atime_ns, before.st_mtime_ns))


def another_place_of_numpy(installed: Path) -> None:
    shutil.rmtree(installed / "numpy")


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        add_module,
        add_kernel,
        add_template,
        remove_module,
        edit_module,
        edit_to_the_same_size,
        another_sympy,
        another_place_of_numpy,
    ],
)
def test_fingerprint_changes_with_the_code_and_the_libraries(change, installed):
    (installed / "lagrange_cli" / "cache" / "unused.py").write_text("")
    before = fingerprint_of(installed)
    change(installed)
    assert fingerprint_of(installed) != before


def test_fingerprint_stays_when_nothing_changes(installed):
    first = fingerprint_of(installed)
    (installed / "lagrange_cli" / "notes.txt").write_text("not code")
    cache = installed / "lagrange_cli" / "__pycache__"
    cache.mkdir(exist_ok=True)
    (cache / "more.py").write_text("")
    assert fingerprint_of(installed) == first


def test_a_package_that_is_no_folder_recognizes_nothing(monkeypatch):
    def refuse(path):
        raise NotADirectoryError(path)

    monkeypatch.setattr(os, "scandir", refuse)
    of_each_process = fingerprint.__wrapped__
    assert of_each_process() != of_each_process()


def test_importing_the_room_imports_nothing_heavy():
    program = (
        "import sys, lagrange_cli.cache as cache\n"
        "cache.open_cache(), cache.fingerprint(), print(*sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60, check=True
    )
    loaded = {name.partition(".")[0] for name in done.stdout.split()}
    heavy = {"sympy", "numpy", "scipy", "yaml", "mpmath", "click", "subprocess", "tempfile"}
    assert loaded & heavy == set()
