"""Emitted files: none hides a module or a header, and two of C are of one emission."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from lagrange_cli.api import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cli.main import run
from lagrange_cli.emit.naming import C_HEADERS, PYTHON_MODULES, file_stem
from tests.campaign import slice_of

SCENE = """\
name: {name}
particles: {{bob: {{mass: 1, position: [sin(theta), 0, -cos(theta)]}}}}
coordinates: [theta]
potentials: {{weight: 9.81*z_bob}}
initial: {{theta: 2.0}}
simulate: {{until: 1}}
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    slice_of(
        ["math", "numpy", "typing", "random", "re", "Math"],
        0,
        {"math", "numpy", "random", "Math"}.__contains__,
    ),
)
def test_a_module_runs_beside_what_it_imports(name, tmp_path):
    (files,) = loads(SCENE.format(name=name)).derive().emit("python").items()
    path = tmp_path / files[0]
    path.write_text(files[1])
    assert path.name == f"{name}_.py"
    done = subprocess.run(
        [sys.executable, str(path)], cwd=tmp_path, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("t,theta,")


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler is installed")
@pytest.mark.parametrize("name", ["math", "features", "stdlib"])
def test_code_compiles_where_its_folder_is_searched_first(name, tmp_path):
    files = loads(SCENE.format(name=name)).derive().emit("c", main=True)
    assert sorted(files) == [f"{name}_.c", f"{name}_.h"]
    for file, text in files.items():
        (tmp_path / file).write_text(text)
    words = ["cc", "-std=c99", "-I.", "-Werror", "-Wall", f"{name}_.c", "-o", "program", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True, timeout=60)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["math", "swing", "class"])
@pytest.mark.parametrize("to", EMITTERS)
def test_names_are_those_that_are_announced(name, to):
    derivation, format_ = loads(SCENE.format(name=name)).derive(), EMITTERS[to]
    files = format_.package(name, derivation.emit(to)).files
    assert tuple(files) == EMITTERS[to].files(name)
    assert bool(EMITTERS[to].renamed(name)) == (name not in next(iter(files)).split("."))


def test_a_changed_name_is_told_also_from_the_cache(cache_folder, tmp_path, capsys):
    (tmp_path / "s.yaml").write_text(SCENE.format(name="math"))
    for _ in range(2):
        words = ["emit", str(tmp_path / "s.yaml"), "--to", "python", "-o", str(tmp_path)]
        assert run(words) == 0
        said = capsys.readouterr().err
        assert "named math_.py: math.py would hide" in said
    assert not (tmp_path / "math.py").exists()


def test_an_old_file_of_the_plain_name_stays(tmp_path):
    (tmp_path / "s.yaml").write_text(SCENE.format(name="math"))
    (tmp_path / "math.py").symlink_to("s.yaml")
    assert run(["emit", str(tmp_path / "s.yaml"), "--to", "python", "-o", str(tmp_path)]) == 0
    assert (tmp_path / "math_.py").exists()


def test_a_path_with_the_ending_of_the_format_is_a_file(tmp_path, capsys):
    scene = str(tmp_path / "s.yaml")
    Path(scene).write_text(SCENE.format(name="swing"))
    file = tmp_path / "out" / "f.rs"
    assert run(["emit", scene, "--to", "rust", "-o", str(file)]) == 0
    assert capsys.readouterr().err == f"wrote {file}\n"
    assert run(["emit", scene, "--to", "rust", "-o", "-"]) == 0
    assert capsys.readouterr().out == file.read_text()
    assert run(["emit", scene, "--to", "c", "-o", str(tmp_path / "out" / "f.c")]) == 2
    assert f"--to c -o {tmp_path / 'out'}\n" in capsys.readouterr().err
    assert run(["emit", scene, "--to", "c", "-o", "-"]) == 2
    named = tmp_path / "s.py"
    named.write_text(SCENE.format(name="swing"))
    assert run(["emit", str(named), "--to", "python", "-o", str(named)]) == 2
    assert "would replace the scene" in capsys.readouterr().err


@pytest.mark.parametrize("reserved", [PYTHON_MODULES, C_HEADERS])
def test_no_name_with_a_tail_is_reserved(reserved):
    for name in reserved:
        assert file_stem(name, reserved) not in reserved
    assert file_stem("pendulum", reserved) == "pendulum"


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler is installed")
@pytest.mark.parametrize(("header", "source"), [("float", "double"), ("double", "float")])
def test_files_of_two_emissions_do_not_compile(header, source, tmp_path):
    derivation = loads(SCENE.format(name="swing")).derive()
    (tmp_path / "swing.h").write_text(derivation.emit("c", real=header)["swing.h"])
    (tmp_path / "swing.c").write_text(derivation.emit("c", real=source)["swing.c"])
    words = ["cc", "-std=c99", "-c", "swing.c"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode != 0
    assert "are not of one emission: emit both once more" in done.stderr


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler is installed")
def test_a_header_alone_holds_the_source_of_one_unit(tmp_path):
    """Two units include the header, one of them twice; the one with the macro has the functions."""
    derivation = loads(SCENE.format(name="swing")).derive()
    files = derivation.emit("c", header_only=True, main=True)
    assert list(files) == ["swing.h"]
    (tmp_path / "swing.h").write_text(files["swing.h"])
    whole = '#include "swing.h"\n#define swing_IMPLEMENTATION\n#include "swing.h"\n'
    (tmp_path / "whole.c").write_text(whole)
    part = '#include "swing.h"\nint count(void);\nint count(void) { return swing_DOF; }\n'
    (tmp_path / "part.c").write_text(part)
    words = [
        "cc",
        "-std=c99",
        "-Wall",
        "-Wextra",
        "-pedantic",
        "-Werror",
        "whole.c",
        "part.c",
        "-o",
        "alone",
        "-lm",
    ]
    subprocess.run(words, cwd=tmp_path, check=True, timeout=60)
    pair = derivation.emit("c", main=True)
    for name, text in pair.items():
        (tmp_path / name).write_text(text)
    words = ["cc", "-std=c99", "swing.c", "-o", "pair", "-lm"]
    subprocess.run(words, cwd=tmp_path, check=True, timeout=60)
    rows = [
        subprocess.run([tmp_path / name], capture_output=True, check=True, timeout=60).stdout
        for name in ("alone", "pair")
    ]
    assert rows[0] == rows[1]
    assert rows[0].count(b"\n") > 500
