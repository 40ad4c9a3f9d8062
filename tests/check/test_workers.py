"""Scenes checked side by side: all are reported, and a dying process takes only its own."""

from __future__ import annotations

import gc
import math
import os
import signal
import subprocess
import sys
import time

import pytest

from lagrange_cli.check.check import check_paths
from lagrange_cli.check.model import Limits, SceneReport
from lagrange_cli.check.workers import in_processes
from lagrange_cli.errors import InputError
from tests.simulate.clusters import until
from tests.systems.shipped import SCENES

pytestmark = pytest.mark.slow


def job(path: str) -> SceneReport:
    """Do what the name of the path says."""
    if path.startswith("exit"):
        os._exit(7)
    if path.startswith("kill"):
        os.kill(os.getpid(), signal.SIGKILL)
    if path.startswith("sleep"):
        time.sleep(60)
    if path.startswith("memory"):
        bytearray(10**10)
    return SceneReport(path, "pass", float(os.getpid()))


@pytest.mark.parametrize("jobs", [1, 2, 5])
def test_every_scene_is_reported_once(jobs):
    paths = [f"scene{k}" for k in range(7)]
    reports = list(in_processes(paths, jobs, job))
    assert sorted(report.path for report in reports) == paths
    assert {report.outcome for report in reports} == {"pass"}
    assert len({report.seconds for report in reports}) <= jobs  # processes, one for many scenes


def test_a_dying_process_takes_only_its_scene():
    found = {r.path: r for r in in_processes(["a", "exit", "b", "kill", "c"], 2, job)}
    assert [found[p].outcome for p in ("a", "exit", "b", "kill", "c")] == [
        "pass",
        "crash",
        "pass",
        "crash",
        "pass",
    ]
    assert "ended with exit code 7" in found["exit"].problems[0].message
    assert "ended by signal 9" in found["kill"].problems[0].message


def collecting(path: str) -> SceneReport:
    """Report the first threshold of the garbage collector for the seconds."""
    return SceneReport(path, "pass", float(gc.get_threshold()[0]))


def test_workers_collect_garbage_as_seldom_as_their_parent(monkeypatch):
    monkeypatch.setattr(gc, "get_threshold", lambda: (54_321, 20, 50))
    (report,) = in_processes(["a"], 2, collecting)
    assert report.seconds == 54_321


#: Prints the modules that checks of scenes import beside those that the server has.
IMPORTING = """
import importlib, sys
from lagrange_cli.check import check, model, workers
for name in workers._PRELOADED:
    importlib.import_module(name)
before = set(sys.modules)
for scene in sys.argv[1:]:
    report = check.check_scene(scene, model.CheckOptions(motions="short"))
    assert report.outcome == "pass"
print(*(set(sys.modules) - before))
"""


def test_checks_import_what_the_server_has_imported():
    scenes = [str(SCENES[name]) for name in ("pendulum", "heavy_top", "bouncing_ball")]
    command = [sys.executable, "-c", IMPORTING, *scenes]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    heavy = ("lagrange_cli.", "sympy.", "scipy.", "numpy.", "mpmath.")
    assert [module for module in done.stdout.split() if module.startswith(heavy)] == []


#: Prints the signals that the server of processes holds back, and those that its parent does.
HELD_BACK = """
import os
from multiprocessing import forkserver
from lagrange_cli.check.workers import _context
_context()
for process in (forkserver._forkserver._forkserver_pid, os.getpid()):
    with open(f"/proc/{process}/status") as status:
        print(next(line.split()[1] for line in status if line.startswith("SigBlk")))
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="masks are read from /proc")
def test_ctrl_c_does_not_reach_the_server_while_it_imports():
    command = [sys.executable, "-c", HELD_BACK]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    server, parent = (int(mask, 16) >> (signal.SIGINT - 1) & 1 for mask in done.stdout.split())
    assert (server, parent) == (1, 0)


def test_workers_end_with_their_reader():
    reports = in_processes(["a", "sleep"], 2, job)
    assert next(reports).path == "a"
    started = time.monotonic()
    reports.close()
    assert time.monotonic() - started < 30


def test_a_scene_that_takes_too_long_is_given_up():
    found = {r.path: r for r in in_processes(["a", "sleep", "b"], 1, job, Limits(seconds=0.5))}
    assert [found[p].outcome for p in ("a", "sleep", "b")] == ["pass", "timeout", "pass"]
    assert found["sleep"].problems[0].rule == "limit"
    assert 0.5 <= found["sleep"].seconds < 30


def test_memory_is_limited():
    found = {r.path: r for r in in_processes(["a", "memory"], 2, job, Limits(memory=2 * 10**9))}
    assert found["a"].outcome == "pass"
    # The job does not take the error for its scene's, as a check does.
    assert "ended with exit code 1" in found["memory"].problems[0].message
    limited = in_processes(["a", "b", "c"], 1, job, Limits(memory=2 * 10**9))
    assert len({report.seconds for report in limited}) == 3  # each has the whole memory


def test_limits_beyond_those_of_the_system_are_none():
    (report,) = in_processes(["a"], 1, job, Limits(seconds=1e300, memory=10**30))
    assert report.outcome == "pass"
    with pytest.raises(InputError, match="timeout must be a positive number, not nan"):
        check_paths([__file__], limits=Limits(seconds=math.nan))


def test_large_scenes_are_checked_first_and_reported_in_their_place(tmp_path, monkeypatch):
    begun = []

    def recorded(paths, jobs, job, limits):
        begun.extend(paths)
        return (SceneReport(path, "pass", 0.0) for path in paths)

    monkeypatch.setattr("lagrange_cli.check.check.in_processes", recorded)
    scenes = [str(tmp_path / name) for name in ("a.yaml", "b.yaml", "c.yaml")]
    for path, size in zip(scenes, (10, 30, 20), strict=True):
        (tmp_path / path).write_text("#" * size)
    report = check_paths(scenes, jobs=2)
    assert begun == [scenes[1], scenes[2], scenes[0]]
    assert [scene.path for scene in report.scenes] == scenes
    begun.clear()
    check_paths(scenes, limits=Limits(seconds=60))
    assert begun == scenes


SCENE = """\
name: slow{}
parameters: {{m: 1, l: 1, g: 9.81}}
particles:
  bob: {{mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials:
  weight: {{gravity: g}}
initial: {{theta: 1}}
expect:
  state: {{t: 1e8, theta: 1, within: 1e-6}}
"""


def workers_of(number: int) -> list[int]:
    """Processes that the server of a process's workers has started."""
    psutil = pytest.importorskip("psutil")
    servers = psutil.Process(number).children()
    return [worker.pid for server in servers for worker in server.children()]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_interruption_ends_all_processes(number, tmp_path):
    for k in range(3):
        (tmp_path / f"slow{k}.yaml").write_text(SCENE.format(k))
    process = subprocess.Popen(
        [sys.executable, "-m", "lagrange_cli", "check", "-j", "2", ".", "--junit", "r.xml"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    try:
        until(lambda: len(workers_of(process.pid)) == 2)
        time.sleep(1)
        assert process.poll() is None
        process.send_signal(number)
        # Reading to the end waits for every process that holds the pipes.
        _, stderr = process.communicate(timeout=30)
    finally:
        process.kill()
    assert process.returncode == (-number if number == signal.SIGKILL else 128 + number), stderr
    assert b"Traceback" not in stderr
    assert not (tmp_path / "r.xml").exists()
