"""The C compiler: looked up, never assumed, and without it everything goes on."""

from __future__ import annotations

import os
import signal
import stat
import subprocess
import sys
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.cache import Cache, open_cache
from lagrange_cli.errors import StoppedError
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.integrators.external.heyoka_method import Taylor
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.model.model import Model
from lagrange_cli.simulate.system.functions import interpreted, right_hand_side
from lagrange_cli.toolchain import compiler
from lagrange_cli.toolchain.compiler import CompileError, find_compiler
from lagrange_cli.toolchain.shared_library import CSource
from tests.simulate.compiling import compiled_or_skip, skip_without_compiler
from tests.simulate.native_systems import compiled

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


@pytest.fixture(autouse=True)
def _without_heyoka(monkeypatch):
    """Where no compiler is at hand NumPy and SciPy do it all, whatever is installed."""
    monkeypatch.setattr(Taylor, "suits", classmethod(lambda cls, rhs, size: False))


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
def alone(monkeypatch, tmp_path, without_packaged_compiler):
    """No compiler on the path but those put into the folder, and an empty cache."""
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv("CC", raising=False)
    return tmp_path


def test_without_a_compiler_python_runs_it(model, alone):
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation == "interpreted Python: no C compiler was found"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("body", "reason"),
    [
        ("raise SystemExit('cannot\\neven')", "cc failed: cannot"),
        ("raise SystemExit(3)", "cc failed: exit status 3"),
        ("open('object.so', 'w').write('no library')", "the compiled code cannot be loaded"),
        ("pass", "cc failed: no object was made"),
        ("import os; os.kill(os.getpid(), 9)", "cc failed: exit status -9"),
        (
            "raise SystemExit('In file included from a.c:1:\\na.h:2: fatal error: no b.h\\nstop')",
            "cc failed: a.h:2: fatal error: no b.h",
        ),
        (r"raise SystemExit('\x1b[31mred\x07\u202e')", r"cc failed: \x1b[31mred\x07\x202e"),
        ("raise SystemExit('x' * 10**5)", "cc failed: " + "x" * 186 + "..."),
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
    assert find_compiler({"CC": " ", "PATH": str(alone)}).name == "gcc"


@pytest.mark.parametrize(
    ("named", "reason"),
    [
        ("nowhere -m64", "CC names 'nowhere', which was not found"),
        ("/no/where", "CC names '/no/where', which was not found"),
        ("''", "CC names '', which was not found"),
        ("gcc 'unbalanced", "CC cannot be read: no closing quotation"),
        ("\x1b[31m", r"CC names '\x1b[31m', which was not found"),
    ],
)
def test_nothing_stands_in_for_what_cc_names(model, alone, monkeypatch, named, reason):
    command(alone, "gcc", "raise AssertionError")
    monkeypatch.setenv("CC", named)
    assert right_hand_side(model).implementation == f"interpreted Python: {reason}"


def test_what_is_not_executable_is_no_compiler(alone):
    (alone / "cc").write_text("#!/bin/sh\n")
    (alone / "gcc").mkdir()
    for path in ("", str(alone)):
        with pytest.raises(CompileError, match="no C compiler was found"):
            find_compiler({"PATH": path})


def test_the_compiler_behind_a_link_to_a_compiler_cache_counts(alone, tmp_path):
    """As Debian has it: folders of links named gcc to ccache, before those of the compilers."""
    links, others = tmp_path / "links", tmp_path / "others"
    links.mkdir()
    others.mkdir()
    command(alone, "ccache", "")
    (links / "gcc").symlink_to(alone / "ccache")
    path = os.pathsep.join(map(str, (links, alone, others)))
    seen = [find_compiler({"PATH": path})]
    command(others, "gcc", "")
    seen.append(find_compiler({"PATH": path}))
    command(others, "gcc", "pass")
    seen.append(find_compiler({"PATH": path}))
    seen.append(find_compiler({"PATH": path, "CCACHE_COMPILER": "clang"}))
    assert len({found.identity for found in seen}) == 4
    assert {found.command for found in seen} == {(str(links / "gcc"),)}
    assert find_compiler({"PATH": path}).identity == seen[2].identity


def test_a_compiler_behind_a_wrapper_is_told_from_another_one(alone):
    command(alone, "wrapper", "")
    environment = {"CC": "wrapper gcc -O1", "PATH": str(alone)}
    without = find_compiler(environment).identity
    command(alone, "gcc", "")
    one = find_compiler(environment).identity
    command(alone, "gcc", "pass")
    assert len({without, one, find_compiler(environment).identity}) == 3
    assert find_compiler(environment).command == (str(alone / "wrapper"), "gcc", "-O1")


#: A compiler that takes no options of GCC alone, as clang.
PARTICULAR = """
import subprocess, sys
if any(word.startswith(("-fira", "-fpeel")) for word in sys.argv):
    raise SystemExit("error: unknown argument")
raise SystemExit(subprocess.call([{real!r}, *sys.argv[1:]]))
"""


@pytest.mark.slow
def test_a_compiler_that_refuses_options_of_gcc_is_called_without_them(
    model, monkeypatch, tmp_path
):
    compiled_or_skip(model)
    real = find_compiler().command[0]
    monkeypatch.setenv("CC", str(command(tmp_path, "particular", PARTICULAR.format(real=real))))
    assert simulate(model).implementation == "compiled C"


@pytest.fixture
def package(alone, monkeypatch):
    """A folder with a package ``ziglang`` that is found before any other."""
    folder = alone / "site" / "ziglang"
    folder.mkdir(parents=True)
    (folder / "__init__.py").touch()
    monkeypatch.delitem(sys.modules, "ziglang")
    monkeypatch.syspath_prepend(folder.parent)
    return folder


def test_the_compiler_of_a_package_comes_last(package, alone):
    with pytest.raises(CompileError, match="no C compiler was found"):
        find_compiler()
    path = command(package, "zig", "")
    found = find_compiler()
    assert found.command[:2] == (str(path), "cc")
    assert "ziglang" not in sys.modules
    with pytest.raises(CompileError, match="CC names 'nowhere', which was not found"):
        find_compiler({"CC": "nowhere", "PATH": str(alone)})
    command(package, "zig", "pass")
    assert find_compiler().identity != found.identity
    command(alone, "clang", "")
    assert find_compiler().name == "clang"


@pytest.fixture
def packaged(alone, monkeypatch):
    """The compiler of the package ``ziglang`` and no other."""
    monkeypatch.delitem(sys.modules, "ziglang")
    if find_spec("ziglang") is None:
        skip_without_compiler("the package ziglang is not installed")


@pytest.mark.slow
def test_the_compiler_of_a_package_gives_the_same_numbers(model, packaged, monkeypatch):
    """Equations to the last bit; steps fuse other products and sums, and differ by rounding."""
    found, functions = simulate(model), right_hand_side(model)
    assert found.implementation == "compiled C by zig"
    assert (Path(os.environ["XDG_CACHE_HOME"]) / "lagrange" / "compiler").is_dir()
    monkeypatch.undo()
    machine, theirs = simulate(model), compiled_or_skip(model)
    assert machine.implementation == "compiled C"
    assert (found.method, found.steps) == (machine.method, machine.steps)
    assert found.columns["theta"] == pytest.approx(machine.columns["theta"], abs=1e-13)
    for y in np.random.default_rng(0).uniform(-3, 3, (20, 2)):
        assert functions.rhs(0.0, y).tobytes() == theirs.rhs(0.0, y).tobytes()


#: Starts a process that holds what it inherits, signals that it is there, and waits for it. Of two
#: that run side by side the second one signals, when both have been started.
HANGS = """
import os, signal, subprocess, sys, time
pipe = os.open({pipe!r}, os.O_WRONLY)
os.set_inheritable(pipe, True)
late = f"import os, time; time.sleep(600); os.write({{pipe}}, b'late')"
sleeping = subprocess.Popen([sys.executable, "-c", late], close_fds=False)
try:
    os.mkdir({pipe!r} + ".first")
except FileExistsError:
    time.sleep(0.3)
    os.kill(os.getppid(), signal.SIGUSR1)
sleeping.wait()
"""


@pytest.fixture
def hanging(alone):
    """A compiler that takes long; gives what says whether all of it was ended before."""
    pipe = alone / "pipe"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    command(alone, "cc", HANGS.format(pipe=str(pipe)))

    def ended():
        for _ in range(3000):
            try:
                return not os.read(reader, 100)
            except BlockingIOError:
                time.sleep(0.1)
        return False

    yield ended
    os.close(reader)


def test_an_interrupted_compilation_ends_with_all_its_processes(model, hanging):
    class Interrupted(BaseException):
        pass

    def interrupt(number, frame):
        raise Interrupted

    previous = signal.signal(signal.SIGUSR1, interrupt)
    try:
        with pytest.raises(Interrupted):
            simulate(model)
    finally:
        signal.signal(signal.SIGUSR1, previous)
    assert hanging()


@pytest.fixture
def deaf():
    """The signal that a hanging compiler sends changes nothing."""
    previous = signal.signal(signal.SIGUSR1, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGUSR1, previous)


@pytest.mark.slow
@pytest.mark.usefixtures("deaf")
def test_a_compilation_that_takes_too_long_is_given_up(model, monkeypatch, hanging):
    monkeypatch.setattr(compiler, "LONGEST_COMPILATION", 0.5)
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation == "interpreted Python: cc took more than 0.5 s"
    assert hanging()


@pytest.mark.slow
@pytest.mark.usefixtures("deaf")
def test_the_compiler_has_half_of_a_budget(model, hanging):
    found = simulate(model, budget=1.0)
    assert found.implementation.startswith("interpreted Python: cc took more than")
    assert found.status in ("ok", "stopped")
    assert hanging()


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
def test_wider_arithmetic_that_takes_the_rest_of_a_budget_stops_the_run(
    model, monkeypatch, tmp_path
):
    compiled_or_skip(model)
    if EXTENDED.epsilon >= DOUBLE.epsilon:
        pytest.skip("this machine has no arithmetic wider than double")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    right_hand_side(model)
    kept = right_hand_side(model, budget=1e-6)
    assert kept.implementation == "compiled C"
    with pytest.raises(StoppedError):
        kept.wider()


@pytest.fixture
def without_functions(model, quick_compiler, monkeypatch, tmp_path):
    """A compiler that makes sound libraries with nothing in them."""
    compiled_or_skip(model)
    (tmp_path / "nothing.c").write_text("int nothing;\n")
    words = [*find_compiler().command, "-shared", "-fPIC", "-o", "object.so"]
    words.append(str(tmp_path / "nothing.c"))
    return command(tmp_path, "empty cc", f"import subprocess; subprocess.run({words}, check=True)")


def kept_objects(folder: Path) -> list[Path]:
    return sorted((folder / "lagrange").glob("*.so"))


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
def test_objects_without_the_functions_are_neither_used_nor_kept(
    model, monkeypatch, tmp_path, without_functions
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setenv("CC", f"'{without_functions}'")
    for _ in range(2):
        found = simulate(model)
        assert found.status == "ok"
        assert found.implementation == "interpreted Python: the compiled code lacks 'system_rhs'"
        assert kept_objects(tmp_path) == []


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
def test_objects_without_the_functions_are_replaced_in_the_cache(
    model, monkeypatch, tmp_path, without_functions
):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    right_hand_side(model)
    subprocess.run([without_functions], cwd=tmp_path, check=True)
    content = (tmp_path / "object.so").read_bytes()
    good = kept_objects(tmp_path)
    cache = open_cache()
    cache.clear()
    for path in good:
        cache.put(path.name.partition("-")[0], content, ".so")
    assert simulate(model).implementation == "compiled C"
    assert [path.name for path in kept_objects(tmp_path)] == [path.name for path in good]


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("fails", [True, False])
def test_folders_whose_names_are_no_text(
    model, monkeypatch, tmp_path, without_functions, kept, fails
):
    folder = Path(os.fsdecode(os.fsencode(tmp_path) + b"/\xff\x1b"))
    try:
        folder.mkdir()
    except OSError:
        pytest.skip("this file system refuses such names")
    monkeypatch.setenv("XDG_CACHE_HOME", str(folder))
    monkeypatch.setenv("LAGRANGE_CACHE", "" if kept else "off")
    monkeypatch.setattr("tempfile.tempdir", str(folder))
    if fails:
        monkeypatch.setenv("CC", f"'{without_functions}'")
    found = simulate(model)
    assert found.status == "ok"
    assert found.implementation.startswith("interpreted" if fails else "compiled C")
    assert bool(kept_objects(folder)) == (kept and not fails)


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
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


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
def test_compiled_once_and_then_loaded(model, monkeypatch, tmp_path):
    compiled_or_skip(model)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert simulate(model).implementation == "compiled C"
    monkeypatch.setattr("subprocess.Popen", None)
    assert simulate(model).implementation == "compiled C"


@pytest.mark.slow
@pytest.mark.usefixtures("quick_compiler")
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


def test_a_library_calls_what_it_was_made_from():
    sources = [CSource({"a.c": f"int number(void) {{ return {k}; }}\n"}) for k in (1, 2)]
    one, two = compiled(*sources, cache=Cache(None))
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
    assert "evil" not in found.code.functions.text


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
