"""Ensembles on a user's Dask cluster: the same results as here, and nothing lost."""

from __future__ import annotations

import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

from lagrange_cli import InputError, load, loads, sampled
from lagrange_cli.simulate.cluster.tasks import connected
from tests.campaign import values_of
from tests.simulate.clusters import ROOT, environment, scheduler, wait_for_workers, worker

pytest.importorskip("distributed")
pytest.importorskip("zarr")

import dask
from distributed import Client, LocalCluster

SCENE = """
name: pendulum
parameters: {m: 1, l: 1, g: 9.81}
plane: xz
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: g}}
initial: {theta: 1, dot(theta): 0}
simulate: {until: 2, samples: 21, accuracy: 1e-8}
"""

KEPT = {"columns": ["theta"], "final": True, "reduce": ["max(theta/l)", "first(theta < 0)"]}

#: Members are run one by one.
ALONE = {"method": "DOP853", "rtol": 1e-10}


def drawn(members=80):
    return sampled({"theta": "uniform(-1, 1)", "m": "uniform(1, 2)"}, members, seed=7)


def same(found, expected):
    assert set(found.arrays) == set(expected.arrays)
    for name, values in expected.arrays.items():
        assert np.array_equal(found.arrays[name], values, equal_nan=values.dtype.kind == "f"), name


@pytest.fixture(scope="module")
def pendulum():
    return loads(SCENE).derive()


@pytest.fixture(scope="module")
def client():
    """Two workers, each a process; a task that ends two of them one after the other fails."""
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(**options, dashboard_address=None) as cluster,
        Client(cluster) as client,
    ):
        yield client


@pytest.fixture
def alone(tmp_path):
    """A scheduler without workers, and a client."""
    options = {"n_workers": 0, "processes": False, "dashboard_address": ":0", "protocol": "tcp"}
    with LocalCluster(**options) as cluster, Client(cluster) as client:
        yield client


@pytest.mark.slow
@pytest.mark.parametrize(("ending", "how"), values_of(["", ".npz", ".zarr"], [{}, ALONE]))
def test_a_cluster_finds_what_this_process_finds(client, pendulum, tmp_path, ending, how):
    """Bit for bit: samples, ends, reductions and what is known of each member."""
    store = tmp_path / f"out{ending}" if ending else None
    members = drawn(80 if not how else 16)
    found = pendulum.ensemble(members, **KEPT, **how, store=store, client=client)
    same(found, pendulum.ensemble(members, **KEPT, **how))
    assert len(list(tmp_path.iterdir())) == bool(ending)


@pytest.mark.slow
@pytest.mark.parametrize("how", [{}, ALONE])
def test_threads_of_a_worker_find_the_same(pendulum, tmp_path, how):
    """Of this process, as notebooks start them; a member by itself may be derived there."""
    members = sampled({"theta": "uniform(-1, 1)", "g": "uniform(-5, 10)"}, 12, seed=7)
    options = {"n_workers": 1, "threads_per_worker": 4, "processes": False}
    with LocalCluster(**options, dashboard_address=":0") as cluster, Client(cluster) as client:
        store = tmp_path / "out.npz"
        found = pendulum.ensemble(members, **KEPT, **how, store=store, client=client)
    same(found, pendulum.ensemble(members, **KEPT, **how))


@pytest.mark.slow
def test_workers_write_to_an_address(client, pendulum, tmp_path, monkeypatch):
    """Of a file system that makes folders as object stores do: when something is put there."""
    fsspec = pytest.importorskip("fsspec")

    def make_folders(wanted):
        fsspec.config.conf["file"] = {"auto_mkdir": wanted}
        fsspec.filesystem("file").clear_instance_cache()

    make_folders(True)
    client.run(make_folders, True)
    try:
        address = f"file://{tmp_path}/out.zarr"
        found = pendulum.ensemble(drawn(), **KEPT, store=address, client=client)
        same(found, pendulum.ensemble(drawn(), **KEPT))
    finally:
        make_folders(False)
        client.run(make_folders, False)
    assert not list((tmp_path / "out.zarr").glob(".lagrange*"))


@pytest.mark.slow
def test_a_file_of_a_cluster_is_that_of_this_machine(client, pendulum, tmp_path):
    """Byte for byte, as the command writes it; the scene's file is nowhere on the workers."""
    (tmp_path / "scene.yaml").write_text(SCENE)
    words = ["--vary", "theta=linspace(0.1,3,10)", "--vary", "l=[1,2]", "--reduce", "max(theta)"]
    for name, on in (("here", "local"), ("there", client.scheduler.address)):
        done = lagrange(tmp_path, *words, "-o", f"{name}.npz", "--on", on)
        assert (done.returncode, done.stderr) == (0, "")
        assert "20 ok" in done.stdout
    assert (tmp_path / "here.npz").read_bytes() == (tmp_path / "there.npz").read_bytes()


def lagrange(folder, *words, **options):
    command = [sys.executable, "-m", "lagrange_cli", "simulate", "scene.yaml", *words]
    settings = {"capture_output": True, "text": True, "timeout": 120}
    return subprocess.run(command, cwd=folder, env=environment(), **{**settings, **options})


@pytest.mark.slow
def test_functions_of_python_travel(client, pendulum):
    """A lambda by its value, with what it closes over."""
    scale = 3.0
    functions = {"swing": lambda motion: scale * float(np.ptp(motion.columns["theta"]))}
    given = {"columns": [], "functions": functions}
    found = pendulum.ensemble(drawn(50), **given, client=client)
    same(found, pendulum.ensemble(drawn(50), **given))
    assert (found.reduced["swing"] > 0).all()


@pytest.mark.slow
def test_what_cannot_be_sent_is_refused(client, pendulum, tmp_path):
    with open(tmp_path / "x", "w") as stream:
        functions = {"bad": lambda motion: stream.write("")}
        with pytest.raises(InputError, match="cannot be sent"):
            pendulum.ensemble(drawn(50), columns=[], functions=functions, client=client)


class EndedError(Exception):
    pass


def after(part):
    """Progress that ends a run once this part of the blocks is finished."""

    def progress(done):
        if done >= part:
            raise EndedError

    return progress


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".zarr"])
def test_a_run_goes_on_on_the_other_engine(client, pendulum, tmp_path, ending):
    expected, (first, second) = pendulum.ensemble(drawn(), **KEPT), ("a", "b")
    for name, before, behind in ((first, None, client), (second, client, None)):
        store = tmp_path / f"{name}{ending}"
        given = {**KEPT, "store": store}
        with pytest.raises(EndedError):
            pendulum.ensemble(drawn(), **given, client=before, progress=after(0.3))
        with pytest.raises(InputError, match="--resume goes on"):
            pendulum.ensemble(drawn(), **given, client=behind)
        parts = []
        found = pendulum.ensemble(
            drawn(), **given, client=behind, resume=True, progress=parts.append
        )
        assert parts[0] > 0.3  # what was finished is not run again
        same(found, expected)


@pytest.mark.slow
def test_a_killed_worker_is_replaced(client, pendulum, tmp_path):
    killed = []

    def kill(part):
        if not killed:
            killed.extend(client.run(os.getpid).values())
            os.kill(killed[0], signal.SIGKILL)

    store = tmp_path / "out.npz"
    found = pendulum.ensemble(drawn(), **KEPT, store=store, client=client, progress=kill)
    assert len(killed) == 2
    same(found, pendulum.ensemble(drawn(), **KEPT))
    wait_for_workers(client, 2)


@pytest.mark.slow
def test_blocks_go_into_no_folder_that_took_the_place_of_theirs(client, pendulum, tmp_path):
    store = tmp_path / "out.npz"
    parts = tmp_path / "out.npz.parts"

    def replace(part):
        if not (tmp_path / "old").exists():
            parts.rename(tmp_path / "old")
            parts.mkdir()

    with pytest.raises(InputError, match=r"not the folder any more|cannot write|does not see"):
        pendulum.ensemble(drawn(), **KEPT, store=store, client=client, progress=replace)
    assert [path.name for path in parts.iterdir() if path.name.startswith("block")] == []


@pytest.mark.slow
def test_a_store_that_workers_do_not_see_is_refused(client, pendulum):
    """Memory of this process is none of a worker's."""
    fsspec = pytest.importorskip("fsspec")
    with pytest.raises(InputError, match=r"the worker at .* does not see 'memory://out.zarr'"):
        pendulum.ensemble(drawn(), **KEPT, store="memory://out.zarr", client=client)
    fsspec.filesystem("memory").store.clear()


@pytest.mark.slow
@pytest.mark.parametrize("library", ["sympy", "lagrange_cli"])
def test_other_versions_are_refused_by_name(alone, pendulum, tmp_path, library):
    if library == "sympy":
        (tmp_path / "sympy-1.0.dist-info").mkdir()
        (tmp_path / "sympy-1.0.dist-info" / "METADATA").write_text("Name: sympy\nVersion: 1.0\n")
        said = "has sympy 1.0 where this process has 1"
    else:
        skipped = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / "lagrange_cli", tmp_path / "lagrange_cli", ignore=skipped)
        (tmp_path / "lagrange_cli" / "version.py").write_text('"""V."""\n\n__version__ = "0.0.9"\n')
        said = "has lagrange_cli 0.0.9 where this process has 0.1.0"
    with worker(alone.scheduler.address, tmp_path, path=str(tmp_path)):
        wait_for_workers(alone, 1)
        with pytest.raises(InputError, match=f"the worker at tcp://.* {said}"):
            pendulum.ensemble(drawn(), **KEPT, store=tmp_path / "out.npz", client=alone)
    assert not list(tmp_path.glob("out.npz*"))


@pytest.mark.slow
def test_a_worker_that_comes_later_is_refused_as_well(alone, pendulum, tmp_path):
    (tmp_path / "scipy-1.0.dist-info").mkdir()
    (tmp_path / "scipy-1.0.dist-info" / "METADATA").write_text("Name: scipy\nVersion: 1.0\n")
    with (
        worker(alone.scheduler.address, tmp_path, path=str(tmp_path)),
        pytest.warns(UserWarning, match="the cluster has no workers yet"),
        pytest.raises(InputError, match=r"the worker at tcp://.*: it has scipy 1.0 where"),
    ):
        pendulum.ensemble(drawn(), **KEPT, client=alone)


@pytest.mark.slow
def test_a_task_that_ends_its_workers_is_told(client, pendulum):
    """As the system does to a process that takes too much memory."""
    functions = {"deadly": lambda motion: os.kill(os.getpid(), signal.SIGKILL)}
    with pytest.raises(InputError, match="a task ended one worker after the other"):
        pendulum.ensemble(drawn(20), columns=[], functions=functions, client=client)
    wait_for_workers(client, 2)


@pytest.mark.slow
def test_a_worker_without_compiler_interprets(alone, pendulum, tmp_path):
    with worker(alone.scheduler.address, tmp_path, changes={"CC": "/nowhere/cc"}):
        wait_for_workers(alone, 1)
        said = "interpreted, and slower, on tcp://.*: CC names '/nowhere/cc'"
        with pytest.warns(UserWarning, match=said):
            found = pendulum.ensemble(drawn(3), **KEPT, client=alone)
    here = pendulum.ensemble(drawn(3), **KEPT)
    assert found.status == ["ok"] * 3
    distance = np.abs(found.columns["theta"] - here.columns["theta"])
    assert (distance <= 1e-8 * here.scales["theta"][:, None]).all()


@pytest.mark.slow
def test_a_worker_without_compiler_that_comes_later_is_named_once(alone, pendulum, tmp_path):
    with (
        worker(alone.scheduler.address, tmp_path, changes={"CC": "/nowhere/cc"}),
        pytest.warns(UserWarning, match="interpreted, and slower, on tcp://") as warned,
    ):
        found = pendulum.ensemble(drawn(3), **KEPT, client=alone)
    assert found.status == ["ok"] * 3
    said = [str(warning.message) for warning in warned]
    assert "the cluster has no workers yet: waiting for them" in said
    assert sum("CC names '/nowhere/cc'" in text for text in said) == 1


@pytest.mark.slow
def test_the_budget_ends_while_there_are_no_workers(alone, tmp_path):
    (tmp_path / "scene.yaml").write_text(SCENE)
    words = ["--vary", "theta=linspace(0.1,3,40)", "-o", "out.npz", "--on", alone.scheduler.address]
    done = lagrange(tmp_path, *words, "--budget", "1", timeout=60)
    assert done.returncode == 1
    assert "the cluster has no workers yet" in done.stderr
    assert "stopped; --resume -o out.npz goes on with the other members" in done.stderr
    with worker(alone.scheduler.address, tmp_path):
        done = lagrange(tmp_path, *words, "--resume")
    assert done.returncode == 0
    assert "40 ok" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("ending", [".npz", ".zarr"])
def test_a_full_disk_is_told(alone, pendulum, tmp_path, ending):
    """Nothing that is not whole is kept: the run goes on where there is room."""
    store = tmp_path / f"out{ending}"
    given = {"store": store, "samples": 2001, "columns": ["theta"]}
    with worker(alone.scheduler.address, tmp_path, largest_file=8192):
        wait_for_workers(alone, 1)
        with pytest.raises(InputError, match=r"the worker at tcp://.*: cannot write") as refused:
            pendulum.ensemble(drawn(40), **given, client=alone)
    assert "--resume goes on" in refused.value.problems[0].hint
    found = pendulum.ensemble(drawn(40), **given, resume=True)
    same(found, pendulum.ensemble(drawn(40), columns=["theta"], samples=2001))


DRIVEN = """
name: driven
parameters: {m: 1, k: 4}
particles: {mass: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
inputs: {F: {file: f.csv, column: F, interpolation: linear}}
forces: {drive: {on: mass, force: [F, 0, 0]}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, samples: 6, accuracy: 1e-8}
"""


def record(folder, size):
    folder.mkdir(exist_ok=True)
    rows = [f"{t / 10},{size * math.sin(t / 10)}" for t in range(61)]
    (folder / "f.csv").write_text("\n".join(["t,F", *rows]) + "\n")


@pytest.mark.slow
def test_workers_read_no_recording_of_their_own_folder(alone, tmp_path, monkeypatch):
    """A file of that name there is another one. A member with k < 0 is derived there."""
    record(tmp_path / "here", 1.0)
    record(tmp_path / "there", 5.0)
    monkeypatch.chdir(tmp_path / "here")
    (tmp_path / "here" / "scene.yaml").write_text(DRIVEN)
    derivation = load("scene.yaml").derive()
    members = {"k": [4.0, 2.0, 1.0, -0.5]}
    with worker(alone.scheduler.address, tmp_path / "there"):
        wait_for_workers(alone, 1)
        found = derivation.ensemble(members, client=alone)
    same(found, derivation.ensemble(members))
    assert found.status == ["ok"] * 4
    record(tmp_path / "here", 5.0)
    other = load("scene.yaml").derive().ensemble(members)
    assert np.abs(other.columns["x"] - found.columns["x"]).max() > 1.0


@contextmanager
def connection(folder, port=0):
    """A client of a scheduler that is a process, and has one worker."""
    with (
        scheduler(folder, port) as (process, address),
        worker(address, folder),
        connected(address) as client,
    ):
        wait_for_workers(client, 1)
        yield client, process, address


@pytest.mark.slow
def test_a_lost_scheduler_ends_the_run_and_another_goes_on(pendulum, tmp_path):
    store, given = tmp_path / "out.npz", {**KEPT, **ALONE}
    with connection(tmp_path) as (client, process, address):

        def kill(part):
            process.kill()

        with pytest.raises(InputError, match=f"scheduler at {address} was lost") as lost:
            pendulum.ensemble(drawn(40), **given, store=store, client=client, progress=kill)
    assert "--resume goes on" in lost.value.problems[0].hint
    parts = []
    with connection(tmp_path, int(address.rpartition(":")[2])) as (client, *_):
        again = {"client": client, "resume": True, "progress": parts.append}
        found = pendulum.ensemble(drawn(40), **given, store=store, **again)
    assert parts[0] > 1 / 16
    same(found, pendulum.ensemble(drawn(40), **given))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"),
    [
        (signal.SIGINT, 130),
        pytest.param(signal.SIGTERM, 143, marks=pytest.mark.campaign),
    ],
)
def test_an_interrupt_cancels_and_says_how_to_go_on(client, tmp_path, number, code):
    (tmp_path / "scene.yaml").write_text(SCENE)
    words = ["--vary", "theta=linspace(0.1,3,160)", "--method", "DOP853", "--rtol", "1e-10"]
    words += ["-o", "out.npz", "--on", client.scheduler.address]
    command = [sys.executable, "-m", "lagrange_cli", "simulate", "scene.yaml", *words]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, cwd=tmp_path, env=environment(), **pipes) as run:
        while not list(tmp_path.glob("out.npz.parts/block*")):
            assert run.poll() is None
            time.sleep(0.02)
        run.send_signal(number)
        _, told = run.communicate(timeout=60)
    assert run.returncode == code
    assert "stopped; --resume -o out.npz goes on with the other members" in told
    done = lagrange(tmp_path, *words, "--resume")
    assert (done.returncode, done.stderr) == (0, "")
    assert "160 ok" in done.stdout


def test_no_scheduler_is_refused():
    began = time.monotonic()
    with pytest.raises(InputError, match="no Dask scheduler answers at tcp://127"):
        connected("tcp://127.0.0.1:9", patience=0.3).__enter__()
    assert time.monotonic() - began < 60


def test_a_server_that_is_no_scheduler_is_refused():
    """One that takes connections and says nothing, as Dask takes a server of web pages."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        address = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        began = time.monotonic()
        with pytest.raises(InputError, match=f"no Dask scheduler answers at {address}"):
            connected(address, patience=0.3).__enter__()
    assert time.monotonic() - began < 60


@pytest.mark.slow
def test_dask_that_is_not_installed_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="needs dask and distributed") as refused:
        connected("tcp://127.0.0.1:8786").__enter__()
    assert "pip install 'lagrange-cli[distributed]'" in refused.value.problems[0].hint
