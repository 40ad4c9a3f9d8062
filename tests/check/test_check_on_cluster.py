"""``check`` and ``stress`` on a Dask cluster say what they say on this machine."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from lagrange_cli.check import check_paths
from tests.cli.terminal import lagrange
from tests.simulate.clusters import wait_for_workers, worker

pytest.importorskip("distributed")

from distributed import Client, LocalCluster

from lagrange_cli.simulate.cluster.tasks import Cluster

pytestmark = pytest.mark.slow

DRIVEN = """\
name: driven
parameters: {m: 1, k: 4}
particles: {mass: {mass: m, position: [x, 0, 0]}}
coordinates: [x]
potentials: {spring: k*x^2/2}
inputs: {F: {file: FILE, column: F, interpolation: linear}}
forces: {drive: {on: mass, force: [F, 0, 0]}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, accuracy: 1e-8}
expect:
"""

#: Name → the end of a scene, of each outcome that a check has.
SCENES = {
    "holds": DRIVEN.replace("FILE", "f.csv") + "  dof: 1\n",
    "fails": DRIVEN.replace("FILE", "f.csv") + "  state: {t: 5.0, x: 7.0, within: 1e-8}\n",
    "missing": DRIVEN.replace("FILE", "nowhere.csv") + "  dof: 1\n",
    "refused": DRIVEN.replace("FILE", "nowhere.csv") + "  error: {contains: no such file}\n",
    "invalid": "name: invalid\nparticels: {}\n",
    "expected": "name: expected\nparticels: {}\nexpect: {error: {contains: particels}}\n",
}


def record(folder, size):
    folder.mkdir()
    (folder / "f.csv").write_text(f"t,F\n0,{size}\n6,{-size}\n")


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    """A worker whose folder has another recording of the same name."""
    folder = tmp_path_factory.mktemp("workers")
    record(folder / "there", 5.0)
    options = {"n_workers": 0, "processes": False, "dashboard_address": ":0", "protocol": "tcp"}
    with (
        LocalCluster(**options) as cluster,
        Client(cluster) as client,
        worker(client.scheduler.address, folder / "there"),
    ):
        wait_for_workers(client, 1)
        yield client


@pytest.fixture
def folder(tmp_path, monkeypatch):
    record(tmp_path / "here", 1.0)
    for name, text in SCENES.items():
        (tmp_path / "here" / f"{name}.yaml").write_text(text)
    monkeypatch.chdir(tmp_path / "here")
    return tmp_path / "here"


def test_scenes_are_checked_as_here(client, folder):
    paths = [f"{name}.yaml" for name in SCENES]
    here = check_paths(paths)
    there = check_paths(paths, cluster=Cluster(client))
    assert [scene.outcome for scene in here.scenes] == [
        *("pass", "fail", "invalid", "pass", "invalid", "pass")
    ]
    for found, expected in zip(there.scenes, here.scenes, strict=True):
        assert replace(found, seconds=0.0) == replace(expected, seconds=0.0)


def test_the_command_checks_on_a_cluster(client, folder):
    on = ("--on", client.scheduler.address)
    done = lagrange("check", "holds.yaml", "fails.yaml", *on, "--json", cwd=folder)
    assert done.returncode == 1
    assert json.loads(done.stdout)["summary"] == {"pass": 1, "fail": 1}
    done = lagrange("check", "holds.yaml", *on, "-j", "2", cwd=folder)
    assert done.returncode == 2
    assert "--jobs is of this machine" in done.stderr


def test_points_are_those_of_this_machine(client, folder):
    found = {}
    # One job: processes that an earlier test began stand in its folder.
    for on in (("local", "-j", "1"), (client.scheduler.address,)):
        words = ("--axes", "parameter,degenerate", "--budget", "60", "--json", "--on", *on)
        done = lagrange("stress", "holds.yaml", *words, cwd=folder)
        assert done.returncode == 0, done.stderr
        found[on] = json.loads(done.stdout)["points"]
    here, there = found.values()
    assert len(here) > 3
    assert here == there
