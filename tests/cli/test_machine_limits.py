"""What the machine refuses is told as such: it is neither the scene's mistake nor a defect."""

from __future__ import annotations

import errno
import os
import subprocess
import sys

import pytest

from tests.cli.terminal import lagrange

pytestmark = pytest.mark.slow

PENDULUM = """\
name: pendulum
parameters: {g: 9.81}
particles: {bob: {mass: 1, position: [sin(theta), 0, -cos(theta)]}}
coordinates: [theta]
potentials: {weight: g*z_bob}
initial: {theta: 2.0}
simulate: {until: 0.1, samples: 3}
"""


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "scene.yaml").write_text(PENDULUM)
    return tmp_path


def run_in(folder, *words, environment=None, **more):
    return subprocess.run(
        [sys.executable, "-m", "lagrange_cli", *words],
        cwd=folder,
        timeout=120,
        env={**os.environ, **(environment or {})},
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def told(done) -> str:
    assert done.returncode in (1, 2), done.stderr
    assert "internal error" not in done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr


def test_closed_standard_input(scene):
    done = run_in(scene, "derive", "-", preexec_fn=lambda: os.close(0), stdout=subprocess.PIPE)
    assert "<stdin>:1:1: " in told(done)


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no device that is full")
@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("--version",),
        ("derive", "--help"),
        pytest.param(("simulate", "--help"), marks=pytest.mark.campaign),
        ("emit", "x", "--list"),
        ("derive", "scene.yaml"),
        ("check", "scene.yaml"),
        ("cache", "--json"),
    ],
)
def test_a_full_device(words, scene):
    with open("/dev/full", "w") as full:
        done = run_in(scene, *words, stdout=full)
    assert done.returncode == 2
    assert "No space left" in told(done)
    assert "Exception ignored" not in done.stderr


def test_backends_for_windows_are_no_matter(scene):
    pytest.importorskip("matplotlib")
    words = ("simulate", "scene.yaml", "--plot", "plot.png")
    done = run_in(scene, *words, environment={"MPLBACKEND": "nonsense"}, stdout=subprocess.PIPE)
    assert done.returncode == 0, done.stderr
    assert (scene / "plot.png").stat().st_size > 1000


def test_plots_of_programs_that_are_not_there_are_refused_before_the_run(scene, monkeypatch):
    pytest.importorskip("matplotlib")
    monkeypatch.setenv("PATH", str(scene))
    monkeypatch.setattr("lagrange_cli.simulate.charts.simulation.simulate_past_singularities", None)
    assert "xelatex" in told(lagrange("simulate", "scene.yaml", "--plot", "a.pgf", cwd=scene))


def test_settings_of_matplotlib_that_cannot_be_served(scene, monkeypatch):
    pytest.importorskip("matplotlib")
    from matplotlib.figure import Figure

    def fails(*arguments, **more):
        raise RuntimeError("Failed to process string with tex\nbecause latex could not be found")

    monkeypatch.setattr(Figure, "savefig", fails)
    done = lagrange("simulate", "scene.yaml", "--plot", "plot.png", cwd=scene)
    assert "matplotlib cannot make the plot: Failed" in told(done)


@pytest.mark.parametrize(
    "range_",
    [
        "linspace(10*1e308,1,3)",
        "logspace(1,10*1e308,3)",
        "geomspace(-10*1e308,-1,3)",
        "linspace(1,1e400,3)",
        "logspace(0,400,3)",
        "linspace(-1.7e308,1.7e308,3)",
        "linspace(1,2,1e150)",
        f"linspace(1,2,{10**30})",
    ],
)
def test_ranges_beyond_doubles_are_refused_at_their_place(range_, scene):
    done = lagrange("simulate", "scene.yaml", "--vary", f"g={range_}", cwd=scene)
    assert told(done).startswith("--vary:1:3: ")


@pytest.mark.parametrize("budget", ["1e300", "1.7e308"])
def test_budgets_longer_than_any_alarm(budget, scene):
    assert lagrange("simulate", "scene.yaml", "--budget", budget, cwd=scene).returncode == 0


# Memory.


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (MemoryError(), "out of memory, while "),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "Cannot allocate memory"),
        (OSError(errno.EMFILE, "Too many open files"), "Too many open files"),
        (ImportError("failed to map segment from shared object"), "failed to map segment"),
        (ImportError("broken", name="scipy.linalg"), "scipy.linalg"),
    ],
)
@pytest.mark.parametrize("command", ["derive", "emit", "simulate"])
def test_what_the_machine_lacks_is_told(error, says, command, scene, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")

    def fails(*arguments, **more):
        raise error

    monkeypatch.setattr("lagrange_cli.mechanics.derive", fails)
    words = ("--to", "latex") if command == "emit" else ()
    assert says in told(lagrange(command, "scene.yaml", *words, cwd=scene))


def test_other_errors_of_the_system_are_still_defects(scene, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")

    def fails(*arguments, **more):
        raise FileNotFoundError(errno.ENOENT, "No such file or directory")

    monkeypatch.setattr("lagrange_cli.mechanics.derive", fails)
    assert lagrange("derive", "scene.yaml", cwd=scene).returncode == 3


def test_a_scene_that_takes_all_memory_reaches_a_limit_where_many_are_checked(scene, monkeypatch):
    monkeypatch.setenv("LAGRANGE_CACHE", "off")

    def fails(*arguments, **more):
        raise MemoryError

    monkeypatch.setattr("lagrange_cli.mechanics.derive", fails)
    done = lagrange("check", "scene.yaml", cwd=scene)
    assert done.returncode == 1
    assert "scene.yaml:1:1: out of memory" in done.stdout
    assert "timeout" in done.stdout


@pytest.mark.parametrize("megabytes", [60, 90])
def test_limits_of_memory_on_a_process(megabytes, scene):
    resource = pytest.importorskip("resource")

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (megabytes * 2**20, megabytes * 2**20))

    words = ("derive", "scene.yaml")
    environment = {"LAGRANGE_CACHE": "off", "OPENBLAS_NUM_THREADS": "1"}
    done = run_in(scene, *words, environment=environment, preexec_fn=limit, stdout=subprocess.PIPE)
    told(done)


def test_whole_numbers_of_thousands_of_digits_are_written(scene):
    text = PENDULUM.replace("g*z_bob", "g*z_bob*(10^60 + 7)^100")
    (scene / "scene.yaml").write_text(text)
    done = lagrange("derive", "scene.yaml", cwd=scene)
    assert done.returncode in (0, 2), done.stderr
    assert "internal error" not in done.stderr
