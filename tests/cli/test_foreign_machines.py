"""In the locales of others, as another user, and with many processes on one cold cache."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.cli.terminal import ROOT

pytestmark = pytest.mark.slow

SCENE = """\
title: A pendulum in Göttingen
parameters: {l: {value: 1.5, description: 'İzmir, ½'}}
particles: {bob: {mass: 1, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: 9.81*z_bob}
initial: {theta: 0.5}
simulate: {until: 1, samples: 5}
expect: {dof: 2}
"""

#: The command line, in a process that takes the locale of its user, as notebooks do.
PROGRAM = (
    "import locale; locale.setlocale(locale.LC_ALL, ''); "
    "from lagrange_cli.cli.main import main; main()"
)

#: The same for several command lines in turn, whose exit codes it prints.
PROGRAMS = """\
import json, locale, sys
locale.setlocale(locale.LC_ALL, "")
from lagrange_cli.cli.main import run
from lagrange_cli.cli.terminal.streams import prepare_streams
prepare_streams()
codes = [run(json.loads(words)) for words in sys.argv[1:]]
print(json.dumps(codes))
"""

#: Language, character set, and the name that both have together.
LOCALES = {
    "de_DE.UTF-8": ("de_DE", "UTF-8"),
    "tr_TR.UTF-8": ("tr_TR", "UTF-8"),
    "de_DE.ISO-8859-1": ("de_DE", "ISO-8859-1"),
    "C": None,
}

COMMANDS = (
    ("derive", "scene.yaml", "-o", "a.txt"),
    ("emit", "scene.yaml", "--to", "c", "-o", "."),
    ("simulate", "scene.yaml", "-o", "a.csv"),
    ("check", "scene.yaml", "--format", "json", "-o", "a.json"),
    ("fmt", "scene.yaml"),
)


def run(folder: Path, *words: str, **more: object) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(
        [sys.executable, "-c", PROGRAM, *words], cwd=folder, capture_output=True, **more
    )


def environment(**changed: str) -> dict[str, str]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("LC_", "LANG"))}
    return {**kept, "PYTHONPATH": str(ROOT), **changed}


@pytest.fixture(scope="module")
def locales(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of locales, made of what the C library comes with."""
    folder = tmp_path_factory.mktemp("locales")
    for name, parts in LOCALES.items():
        if parts is not None and shutil.which("localedef") is not None:
            words = ["localedef", "-i", parts[0], "-f", parts[1], str(folder / name)]
            subprocess.run(words, capture_output=True, check=False)
    return folder


def outputs(folder: Path) -> dict[str, bytes]:
    """What all commands write, the seconds of the report of a check left out."""
    shown = {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}
    lines = shown["a.json"].splitlines()
    return {**shown, "a.json": b"\n".join(line for line in lines if b'"seconds"' not in line)}


@pytest.fixture(scope="module")
def usual(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    folder = tmp_path_factory.mktemp("usual")
    run_all(folder, LC_ALL="C.UTF-8")
    return outputs(folder)


def run_all(folder: Path, **changed: str) -> None:
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", PROGRAMS, *map(json.dumps, COMMANDS)],
        cwd=folder,
        env=environment(**changed),
        capture_output=True,
        check=True,
    )
    assert b"Traceback" not in done.stderr
    codes = json.loads(done.stdout.splitlines()[-1])
    assert codes == [words[0] == "check" for words in COMMANDS], done.stderr


@pytest.mark.parametrize("name", LOCALES)
def test_files_are_the_same_in_every_locale(
    name: str, locales: Path, usual: dict[str, bytes], tmp_path: Path
) -> None:
    """Commas as decimal points, an I without a dot, and a character set that has few letters."""
    if LOCALES[name] is not None and not (locales / name).exists():
        pytest.skip(f"localedef does not make {name} here")
    foreign = {"LC_ALL": name, "LOCPATH": str(locales), "PYTHONUTF8": "0"}
    run_all(tmp_path, **foreign, PYTHONCOERCECLOCALE="0")
    assert outputs(tmp_path) == usual


@pytest.fixture
def folder_of_root() -> Iterator[Path]:
    """A folder that everyone reads and root alone writes."""
    folder = Path(tempfile.mkdtemp(prefix="lagrange-test-"))
    folder.chmod(0o755)
    (folder / "scene.yaml").write_text(SCENE, encoding="utf-8")
    yield folder
    shutil.rmtree(folder)


#: Commands in a folder of root's own, and again in another one as nobody, whose modules and
#: interpreter may stand where nobody reads them.
AS_NOBODY = """\
import json, os, sys
from lagrange_cli.cli.main import run
warm, folder, *commands = sys.argv[1:]
os.environ["LAGRANGE_CACHE"] = "off"  # what is remembered imports less
for words in map(json.loads, commands):
    os.chdir(warm)
    run(words)
os.setgroups([])
os.setgid(65534)
os.setuid(65534)
os.chdir(folder)
os.environ.update(HOME="/nonexistent", TMPDIR="/nonexistent")
for name in ("XDG_CACHE_HOME", "LAGRANGE_CACHE"):
    os.environ.pop(name, None)
print("as nobody", file=sys.stderr)
codes = [run(json.loads(words)) for words in commands]
print(json.dumps(codes))
"""


def test_another_user_in_a_folder_that_is_read_only(folder_of_root: Path, tmp_path: Path) -> None:
    if os.name == "nt" or os.getuid() != 0:
        pytest.skip("only root becomes another user")
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    commands = [("derive", "scene.yaml", "-q"), *COMMANDS]
    commands += [("check", "scene.yaml", "--update"), ("new", "other")]
    done = subprocess.run(
        [sys.executable, "-c", AS_NOBODY, tmp_path, folder_of_root, *map(json.dumps, commands)],
        env=environment(LC_ALL="C.UTF-8"),
        capture_output=True,
        text=True,
    )
    codes = json.loads(done.stdout.splitlines()[-1])
    expected = [0] + [2] * len(commands[1:])
    as_nobody = done.stderr.partition("as nobody\n")[2]
    assert codes == expected, as_nobody
    assert "Traceback" not in done.stderr
    assert as_nobody.count("cannot write") == expected.count(2), as_nobody
    assert [p.name for p in folder_of_root.iterdir()] == ["scene.yaml"]
    assert (folder_of_root / "scene.yaml").read_text(encoding="utf-8") == SCENE


@pytest.mark.parametrize("number", [3, pytest.param(8, marks=pytest.mark.campaign)])
def test_processes_side_by_side_on_a_cold_cache(number: int, tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SCENE, encoding="utf-8")
    cache = tmp_path / "cache"
    variables = environment(XDG_CACHE_HOME=str(cache), LC_ALL="C.UTF-8")
    processes = [
        subprocess.Popen(
            [sys.executable, "-c", PROGRAM, "simulate", "scene.yaml", "-o", f"{k}.csv"],
            cwd=tmp_path,
            env=variables,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
        )
        for k in range(number)
    ]
    said = [process.communicate()[1] for process in processes]
    assert [process.returncode for process in processes] == [0] * number, said
    assert len({(tmp_path / f"{k}.csv").read_bytes() for k in range(number)}) == 1
    assert not list(cache.rglob(".lagrange-*"))
    again = run(tmp_path, "cache", "--json", env=variables)
    assert again.returncode == 0
