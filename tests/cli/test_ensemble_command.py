"""``lagrange simulate --ensemble`` and ``--vary`` as a user runs them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import lagrange_cli
from tests.cli.terminal import lagrange, succeed

pytestmark = pytest.mark.slow

SCENE = """
name: pendulum
sizes: {n: 1}
parameters: {m: 1, l: 2, g: 9.81, T: 2}
plane: xz
particles: {bob: {mass: m, position: [x, y, z]}}
coordinates: [theta]
definitions: {x: l*sin(theta), z: -l*cos(theta)}
potentials: {weight: {gravity: g}}
initial: {theta: 1, dot(theta): 0}
simulate: {until: T, samples: 11, accuracy: 1e-8}
"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


def run(folder, *words):
    return lagrange("simulate", "scene.yaml", *words, cwd=folder)


def report(folder, *words):
    done = run(folder, "--json", *words)
    return done.returncode, json.loads(done.stdout)


def test_a_grid_equals_single_runs(folder):
    ranges = ("--vary", "theta=linspace(0.1,3,2)", "--vary", "m=[0.5,2]")
    code, found = report(folder, *ranges, "-o", "out.npz", "-j", "1")
    assert (code, found["counts"], found["members"]) == (0, {"ok": 4}, 4)
    assert found["numbers_alone"] is True
    with np.load(folder / "out.npz") as arrays:
        many = {name: arrays[name] for name in arrays.files}
    for k, (theta, m) in enumerate((t, m) for t in ("0.1", "3.0") for m in ("0.5", "2")):
        words = ("-i", f"theta={theta}", "-p", f"m={m}", "-o", "one.npz")
        succeed("simulate", "scene.yaml", *words, cwd=folder)
        with np.load(folder / "one.npz") as one:
            assert one["t"].tobytes() == many["t"].tobytes()
            for name in one.files[1:]:
                # Within both accuracies; the scales are at most those of the largest numbers.
                allowed = 2e-8 * max(1.0, np.abs(one[name]).max())
                assert np.abs(many[name][k] - one[name]).max() <= allowed
        assert (many["given/theta"][k], many["given/m"][k]) == (float(theta), float(m))
        assert many["scale/theta"][k] == 1.0
        fastest = max(np.abs(many["dot(theta)"][k]).max(), 1 / (many["t"][-1] - many["t"][0]))
        assert np.isclose(many["scale/dot(theta)"][k], fastest)
    assert many["member/status"].tolist() == ["ok"] * 4


def test_files_do_not_depend_on_jobs(folder):
    (folder / "members.csv").write_text("theta,l\n0.1,1\n0.2,2\nl/4,3\n")
    for jobs in ("1", "2"):
        words = ("--ensemble", "members.csv", "-j", jobs, "-o", f"{jobs}.npz")
        assert run(folder, *words).returncode == 0
    assert (folder / "1.npz").read_bytes() == (folder / "2.npz").read_bytes()
    with np.load(folder / "1.npz") as arrays:
        assert arrays["theta"][:, 0].tolist() == [0.1, 0.2, 0.75]
    assert sorted(p.name for p in folder.iterdir()) == [
        *("1.npz", "2.npz", "members.csv", "scene.yaml")
    ]


def test_failures_are_listed_and_exit_with_1(folder):
    code, found = report(folder, "--vary", "m=[1,0,-1]", "-j", "1")
    assert (code, found["counts"]) == (1, {"ok": 1, "refused": 2})
    assert [of["member"] for of in found["failed"]] == [1, 2]
    assert found["failed"][0]["values"] == {"m": "0"}
    assert "positive" in found["failed"][0]["reason"]
    done = run(folder, "--vary", "m=[1,0,-1]", "-j", "1")
    assert "Status    1 ok, 2 refused" in done.stdout
    assert "  2  m = -1: refused, " in done.stdout


def test_accuracy_is_that_of_each_member(folder):
    # Next to its highest point the pendulum cannot be followed for long.
    words = (
        "--vary",
        "theta=[1, 3.141592653589793]",
        "--until",
        "60",
        "--samples",
        "301",
        "-j",
        "1",
    )
    code, found = report(folder, *words)
    assert (code, found["counts"]) == (1, {"accuracy_not_reached": 1, "ok": 1})
    assert 0 < found["failed"][0]["holds_until"] < 60
    assert found["estimated"] < 1e-8


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--vary", "mm=[1]"), "--vary:1:1: unknown name 'mm'"),
        (("--vary", "dot(mm)=[1]"), "--vary:1:1: unknown name 'mm'"),
        (("--vary", "m=[q]"), "--vary:1:3: 'q' is no parameter"),
        (("--vary", "n=[1,2]"), "the size 'n' cannot differ"),
        (("--vary", "T=[1,2]"), "'until' differs between members"),
        (("--vary", "m=[1]", "--ensemble", "a.csv"), "each say what the members are"),
        (("--vary", "m=[1]", "-o", "out.csv"), "written as .npz, .parquet, .zarr"),
        (("--vary", "m=[1]", "-o", "none/out.zarr"), "cannot write"),
        (("--vary", "m=[1]", "-o", "out.parquet"), "no place for samples"),
        (("--map", "theta,m"), "--map is for ensembles"),
        (("--vary", "m=[1,2]", "--map", "m,theta"), "a map is drawn into the file of --plot"),
        (("--vary", "m=[1,2]", "--map", "m,theta", "--plot", "m.png"), "'theta' is not varied"),
        (("--vary", "m=[1,2]", "--map", "m,theta", "--plot", "m.tex"), "a map is an image"),
        (("-o", "out.zarr"), "does not end in .csv or .npz"),
        (("--vary", "m=[1]", "--resume"), "--resume needs"),
        (("--vary", "m=[1]", "--method", "nonsense"), "unknown method"),
        (("--vary", "m=[1]", "-o", "none/out.npz"), "cannot write"),
        (("--resume",), "--resume needs the file of --checkpoint"),
        (("-j", "2"), "--jobs is for ensembles"),
        (("--final",), "--final is for ensembles"),
        (("--members", "9"), "--members is for ensembles"),
        (("--vary", "m=[1]", "--seed", "3"), "of members that are drawn"),
        (("--vary", "m=[1]", "--final", "--columns", "theta"), "--final keeps no samples"),
        (("--vary", "m=[1]", "--columns", "thata", "-o", "o.npz"), "there is no column 'thata'"),
        (("--vary", "m=[1]", "--final"), "say what a file keeps"),
        (("--vary", "m=[1]", "--reduce", "theta"), "--reduce:1:1: this is no reduction"),
        (("--vary", "m=[1]", "--reduce", "max(thata)"), "--reduce:1:5: unknown name 'thata'"),
        (("--vary", "m=[1]", "--reduce", "first(theta)"), "a condition has one of <, <=, >, >="),
        (("--vary", "m=[1]", "--reduce", "mean(ddot(theta))"), "accelerations"),
        (("--sample", "m ~ uniform(1,2)"), "how many members are drawn?"),
        (("--sample", "m ~ uniform(2,1)", "--members", "3"), "--sample:1:5: uniform takes"),
        (("--sample", "m ~ cauchy(2,1)", "--members", "3"), "this is no distribution"),
        (("--sample", "m = 1", "--members", "3"), "not of the form NAME ~ DISTRIBUTION"),
        (("--sample", "mm ~ normal(0,1)", "--members", "3"), "unknown name 'mm'"),
        (("--sample", "m ~ normal(0,1)", "--members", "1e10"), "more than 1,000,000,000 members"),
        (("--sample", "m ~ normal(0,1)", "--members", "1.5"), "no whole number"),
        (("--sample", "m ~ normal(0,1)", "--members", "1.25e1"), "no whole number"),
        (("--sample", "m ~ cauchy(2,1)", "--members", "12e5"), "this is no distribution"),
        (("--ensemble", "none.csv"), "none.csv:1:1: no such file"),
        (("--ensemble", "scene.yaml"), "scene.yaml:2:1: there is no member"),
        (("--vary", "m=[-1]"), "the mass of 'bob' must be positive, found m = -1"),
    ],
)
def test_wrong_input_exits_with_2(folder, words, said):
    done = run(folder, *words)
    assert (done.returncode, done.stdout) == (2, "")
    assert said in done.stderr
    assert [p.name for p in folder.iterdir()] == ["scene.yaml"]


def test_the_place_of_a_wrong_value_is_that_in_the_file(folder):
    (folder / "members.csv").write_text("m,theta\n1, 0.5\n1, nan\n")
    done = run(folder, "--ensemble", "members.csv")
    assert done.returncode == 2
    assert "members.csv:3:4: 'nan' is no parameter of the scene" in done.stderr


def test_an_interrupted_run_goes_on(folder):
    words = ("--vary", "theta=linspace(0.1,3,40)", "-o", "out.npz", "-j", "1")
    stopped = run(folder, *words, "--budget", "1e-9")
    assert stopped.returncode == 1
    assert "--resume" in stopped.stderr
    parts = sorted(p.name for p in (folder / "out.npz.parts").iterdir())
    assert parts == ["block-000000000.npz", "ensemble.json"]
    assert not (folder / "out.npz").exists()
    assert run(folder, *words).returncode == 2
    changed = run(folder, *words, "--resume", "--accuracy", "1e-6")
    assert (changed.returncode, "another ensemble" in changed.stderr) == (2, True)
    (folder / "scene.yaml").write_text(SCENE.replace("9.81", "9.80"))
    assert run(folder, *words, "--resume").returncode == 2
    (folder / "scene.yaml").write_text(SCENE)
    assert run(folder, *words, "--resume").returncode == 0
    resumed = (folder / "out.npz").read_bytes()
    assert run(folder, *words).returncode == 0
    assert (folder / "out.npz").read_bytes() == resumed
    assert not (folder / "out.npz.parts").exists()


@pytest.mark.parametrize(
    ("number", "code", "jobs"),
    [
        (signal.SIGTERM, 143, "1"),
        (signal.SIGINT, 130, "2"),
        pytest.param(signal.SIGINT, 130, "1", marks=pytest.mark.campaign),
        pytest.param(signal.SIGTERM, 143, "2", marks=pytest.mark.campaign),
    ],
)
def test_signals_leave_finished_blocks(folder, number, code, jobs):
    words = ("--vary", "theta=linspace(0.1,3,20000)", "--until", "400", "-o", "out.npz")
    process = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", "simulate", "scene.yaml", *words, "-j", jobs],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    parts = folder / "out.npz.parts"
    give_up = time.monotonic() + 60
    while not list(parts.glob("block-*")) and time.monotonic() < give_up:
        time.sleep(0.02)
    process.send_signal(number)
    _, stderr = process.communicate(timeout=60)
    assert (process.returncode, b"Traceback" in stderr) == (code, False)
    assert not (folder / "out.npz").exists()
    assert list(parts.glob("block-*.npz"))
    assert not [p for p in parts.iterdir() if p.suffix == ".tmp"]


def test_a_map_is_drawn_of_a_grid(folder):
    """Of what is in a file, or in memory alone; the same bytes."""
    plane = ("--vary", "theta=linspace(0.1,1,8)", "--vary", "m=[1,2,0,4]", "--map", "theta,m")
    reduce = ("--reduce", "first(theta < 0)")
    for k, words in enumerate([(), ("-o", "out.npz"), ("-o", "out.zarr"), ("-o", "out.parquet")]):
        kept = ("--final",) if words else ()
        done = run(folder, *plane, *reduce, "--plot", f"{k}.png", *words, *kept)
        assert (done.returncode, done.stderr) == (1, ""), done.stderr  # m = 0 is refused
        assert (folder / f"{k}.png").read_bytes() == (folder / "0.png").read_bytes()
    done = run(folder, *plane, "--final", "--plot-of", "dot(theta)", "--plot", "end.svg")
    assert done.returncode == 1
    assert b"<svg" in (folder / "end.svg").read_bytes()


#: An ensemble of several blocks.
MANY = ("--sample", "theta ~ uniform(-3, 3)", "--members", "30000", "--until", "40", "--final")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The arrays of a run of many members that nothing ends early."""
    folder = tmp_path_factory.mktemp("whole")
    (folder / "scene.yaml").write_text(SCENE)
    assert run(folder, *MANY, "-o", "out.npz").returncode == 0
    with np.load(folder / "out.npz") as arrays:
        return dict(arrays)


def children(process):
    """The processes that a process has started, where the system tells."""
    listed = Path(f"/proc/{process}/task/{process}/children")
    return listed.read_text().split() if listed.exists() else []


def is_running(process):
    try:
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.parametrize("jobs", [pytest.param("1", marks=pytest.mark.campaign), "2"])
def test_a_killed_run_goes_on_in_its_store(folder, whole, jobs):
    """Neither half a block is counted nor a whole one run again."""
    zarr = pytest.importorskip("zarr")
    words = MANY
    store, own = folder / "out.zarr", (*words, "-j", jobs, "-o", "out.zarr")
    process = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", "simulate", "scene.yaml", *own],
        cwd=folder,
        # The program of this process: one that is installed elsewhere is another version.
        env={**os.environ, "PYTHONPATH": str(Path(lagrange_cli.__file__).parents[1])},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    give_up = time.monotonic() + 60
    # Its folder is made before the chunk is in its place.
    while not (store / "block.finished" / "c" / "0").exists() and time.monotonic() < give_up:
        time.sleep(0.02)
    workers = children(process.pid)
    process.kill()
    process.wait()
    while any(map(is_running, workers)) and time.monotonic() < give_up:
        time.sleep(0.02)
    assert not [worker for worker in workers if is_running(worker)]
    finished = zarr.open_group(str(store), mode="r")["block.finished"][:]
    assert 0 < finished.sum() < len(finished)
    assert run(folder, *words, "-o", "out.zarr").returncode == 2
    code, found = report(folder, *words, "-o", "out.zarr", "--resume", "-j", jobs)
    assert (code, found["counts"], found["finished"]) == (0, {"ok": 30000}, 30000)
    group = zarr.open_group(str(store), mode="r")
    for name in ("given/theta", "final/theta", "member/estimated", "member/status"):
        assert np.array_equal(group[name.replace("/", ".")][:].tolist(), whole[name])
    again = run(folder, *words, "-o", "out.zarr")
    assert (again.returncode, "is there already" in again.stderr) == (2, True)


def test_a_method_can_be_chosen_for_all_members(folder):
    words = ("--vary", "theta=[1,2]", "--method", "DOP853", "--rtol", "1e-9", "-j", "1")
    code, found = report(folder, *words)
    assert (code, found["counts"], found["estimated"]) == (0, {"ok": 2}, None)
