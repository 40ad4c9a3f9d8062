"""The C compiler: looked up, never assumed, and without it everything goes on."""

from __future__ import annotations

import os
import stat
import sys
from pathlib import Path

import numpy as np
import pytest
from compiling import compiled_or_skip

from lagrange_cli import loads
from lagrange_cli.cache import Cache
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.compiler import find_compiler
from lagrange_cli.simulate.library import Source, load
from lagrange_cli.simulate.model import Model
from lagrange_cli.simulate.modelling import model_of
from lagrange_cli.simulate.right_hand_side import interpreted, right_hand_side

PENDULUM = """
name: pendulum
parameters: {m: 1.0, l: 1.0, g: 9.81}
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), y: 0, z: -l*cos(theta)}
potentials: {weight: m*g*z}
initial: {theta: 1.0}
simulate: {until: 2.0, accuracy: 1e-9, samples: 21}
"""


@pytest.fixture(scope="module")
def model():
    return model_of(loads(PENDULUM).derive().equations)


def command(folder: Path, name: str, body: str) -> Path:
    """An executable Python script."""
    path = folder / name
    path.write_text(f"#!{sys.executable}\n{body}\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture
def alone(monkeypatch, tmp_path):
    """No compiler on the path but those put into the folder, and an empty cache."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("CC", raising=False)
    return tmp_path


def test_without_a_compiler_python_runs_it(model, alone):
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation == "interpreted Python: no C compiler was found"


@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("raise SystemExit('cannot\\neven')", "cc failed: cannot"),
        ("raise SystemExit(3)", "cc failed: exit status 3"),
        ("open('object.so', 'w').write('no library')", "the compiled code cannot be loaded"),
        ("pass", "cc failed: no object was made"),
        ("import os; os.kill(os.getpid(), 9)", "cc failed: exit status -9"),
    ],
)
def test_a_compiler_that_fails_is_reported_and_does_without(model, alone, body, reason):
    command(alone, "cc", body)
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation == f"interpreted Python: {reason}"


def test_the_variable_cc_comes_first_with_its_options(alone):
    path = command(alone, "my cc", "")
    command(alone, "gcc", "")
    found = find_compiler({"CC": f"'{path}' -m64", "PATH": str(alone)})
    assert found.command == (str(path), "-m64")
    assert find_compiler({"PATH": str(alone)}).name == "gcc"
    assert find_compiler({"CC": "nowhere", "PATH": str(alone)}) is None
    assert find_compiler({"CC": "'unbalanced", "PATH": str(alone)}) is None
    assert find_compiler({"PATH": ""}) is None


def test_what_is_not_executable_is_no_compiler(alone):
    (alone / "cc").write_text("#!/bin/sh\n")
    (alone / "gcc").mkdir()
    assert find_compiler({"PATH": str(alone)}) is None


def test_an_unwritable_cache_compiles_all_the_same(model, monkeypatch, tmp_path):
    compiled_or_skip(model)
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("XDG_CACHE_HOME", str(blocked))
    monkeypatch.setenv("HOME", "/nonexistent")
    assert simulate(model).implementation == "compiled C"


def test_without_any_place_to_write_python_runs_it(model, monkeypatch, tmp_path):
    compiled_or_skip(model)
    monkeypatch.setenv("LAGRANGE_CACHE", "off")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "missing"))
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation.startswith("interpreted Python: no temporary folder")


def test_compiled_once_and_then_loaded(model, monkeypatch, tmp_path):
    compiled_or_skip(model)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert simulate(model).implementation == "compiled C"
    monkeypatch.setattr("subprocess.Popen", None)
    assert simulate(model).implementation == "compiled C"


def test_a_damaged_object_is_made_anew(model, monkeypatch, tmp_path):
    compiled_or_skip(model)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    right_hand_side(model)
    objects = sorted((tmp_path / "lagrange").glob("*.so"))
    assert objects
    for path in objects:
        path.unlink()
        path.write_bytes(b"garbage")
    assert simulate(model).implementation == "compiled C"
    assert all(path.read_bytes()[:4] != b"garb" for path in (tmp_path / "lagrange").glob("*.so"))


def test_a_library_calls_what_it_was_made_from(tmp_path):
    compiler = find_compiler()
    if compiler is None:
        assert os.environ.get("CI") != "true"
        pytest.skip("no C compiler was found")
    sources = [Source({"a.c": f"int number(void) {{ return {k}; }}\n"}) for k in (1, 2)]
    one, two = load(compiler, sources, Cache(None))
    assert (one.number(), two.number()) == (1, 2)


def test_a_model_survives_json_to_the_last_bit(model):
    import json

    back = Model.from_json(json.loads(json.dumps(model.to_json())))
    assert back == model


def test_no_text_of_a_scene_reaches_the_compiler_or_the_interpreter():
    text = PENDULUM.replace("theta", "evil_coordinate").replace("bob", "evil_bob")
    text = text.replace("g: 9", "evil_g: 9").replace("m*g", "m*evil_g")
    text = text.replace("name: pendulum", "name: evil_name\ntitle: evil */ text")
    found = model_of(loads(text).derive().equations)
    assert "evil" in found.name
    assert "evil" not in found.code.c
    assert "evil" not in found.code.python


def test_equal_systems_share_their_code(model):
    renamed = model_of(loads(PENDULUM.replace("theta", "phi")).derive().equations)
    heavier = model_of(loads(PENDULUM, parameters={"m": 2}).derive().equations)
    assert renamed.code == heavier.code == model.code


def test_both_paths_give_the_same_functions(model):
    native, python = compiled_or_skip(model), interpreted(model, "")
    states = np.random.default_rng(0).uniform(-3, 3, (20, 2))
    t = np.zeros(20)
    for y in states:
        assert native.rhs(0.0, y) == pytest.approx(python.rhs(0.0, y), rel=1e-15)
    for name in ("energy", "positions", "velocities"):
        ours, theirs = getattr(native, name)(t, states), getattr(python, name)(t, states)
        assert ours == pytest.approx(theirs, rel=1e-14, abs=1e-15)
