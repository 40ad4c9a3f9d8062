"""Runs that were interrupted and went on are, bit for bit, those that were not."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.cache import Cache
from lagrange_cli.errors import InputError
from lagrange_cli.mechanics import derive
from lagrange_cli.report.values.simulation import TRAJECTORY
from lagrange_cli.scene import read_file, read_text
from lagrange_cli.simulate import samples, simulate
from lagrange_cli.simulate.charts.simulation import simulate_past_singularities
from lagrange_cli.simulate.checkpoint import checkpoint
from lagrange_cli.simulate.checkpoint.checkpoint import Checkpoint
from lagrange_cli.simulate.integrators import INTEGRATORS
from lagrange_cli.simulate.integrators.native.c_types import DOUBLE, EXTENDED
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.options import SimulationOptions
from lagrange_cli.simulate.results.streaming import Stream
from lagrange_cli.simulate.runs import run
from lagrange_cli.simulate.simulation import RunContext
from lagrange_cli.simulate.system import libraries
from lagrange_cli.stages import Listener, heard_by
from lagrange_cli.toolchain.compiler import CompileError
from tests.simulate.available import or_skip
from tests.simulate.compiling import compiled_or_skip

ROOT = Path(__file__).resolve().parents[3]

PENDULUM = """
parameters: {m: 1, l: 1.5}
particles: {bob: {mass: m, position: [l*sin(theta), 0, -l*cos(theta)]}}
coordinates: [theta]
potentials: {weight: {gravity: 9.81}}
initial: {theta: 2.5}
simulate: {until: 20}
"""

BALL = """
particles: {ball: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
potentials: {weight: {gravity: 9.81}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.9}}
initial: {x: 0, z: 2, dot(x): 1}
simulate: {until: 20}
"""

ROD = """
plane: xz
particles: {bob: {mass: 1, position: [x, 0, z]}}
constraints: {rod: x^2 + z^2 = 4}
potentials: {weight: {gravity: 9.81}}
initial: {x: 2, z: 0}
simulate: {until: 20, formulation: multiplier}
"""

DRIVEN = """
particles: {cart: {mass: 1, position: [x, 0, 0]}}
coordinates: [x]
inputs: {F: {file: push.csv, column: push, interpolation: linear}}
forces: {push: {on: x, force: F - x^3}}
initial: {x: 1}
simulate: {until: 20}
"""

SAMPLED = """
particles: {ball: {mass: 1, position: [x, 0, z]}}
coordinates: [x, z]
potentials: {weight: {gravity: 9.81}}
constraints: {floor: {unilateral: z >= 0, restitution: 0.5}}
inputs: [F]
forces: {push: {on: z, force: F}}
controllers: {every: 0.35, hold: {F: 20*cos(s) - 3*dot(z)}, memory: {s: s + 1}}
initial: {x: 0, z: 2, dot(x): 1, s: 0}
simulate: {until: 20}
"""

RELAY = """
coordinates: [x]
kinetic: {block: dot(x)^2/2}
potentials: {spring: x^2}
states: {r: {on: x <= -0.3, off: x >= 0.5}}
forces: {push: {on: x, force: 3*r - 0.2*dot(x)}}
initial: {x: 0, dot(x): 1, r: 0}
simulate: {until: 20}
"""

KINDS = {"ball": BALL, "rod": ROD, "driven": DRIVEN, "sampled": SAMPLED, "relay": RELAY}
SCENES = {"pendulum": PENDULUM, **KINDS}


@pytest.fixture(autouse=True)
def _many_looks(monkeypatch):
    """Runs are looked at often, so that they can be stopped at many places."""
    monkeypatch.setattr(run, "FIRST_LOOK", 16)
    monkeypatch.setattr(run, "FASTER", 1.0)


@pytest.fixture
def scene(tmp_path):
    """The model of a scene, with what it reads."""
    times = np.arange(0, 21, 0.25)
    table = "".join(f"{t},{np.sin(3 * t)}\n" for t in times)
    (tmp_path / "push.csv").write_text(f"t,push\n{table}")

    def made(name):
        path = tmp_path / f"{name}.yaml"
        path.write_text(SCENES[name])
        return model_of(derive(read_file(path)))

    return made


def compared(found):
    return TRAJECTORY.write(found)


def in_parts(model, path, calls, stream=None, **how):
    """A run that is stopped again and again, each time after some more looks at the clock."""
    parts = 0
    while True:
        looks = iter(range(10**9))
        found = simulate(
            model,
            **how,
            stream=stream,
            checkpoint=Checkpoint(str(path), resume=path.exists()),
            stop=lambda looks=looks, most=calls * (parts + 1): next(looks) >= most,
        )
        if found.status != "stopped":
            return found, parts
        parts += 1


def how_of(method):
    if method.adaptive:
        rtol = 1e-9 if method.order > 5 else 1e-6
        return {"method": method.name, "rtol": rtol, "atol": rtol, "samples": 126, "until": 5.0}
    return {"method": method.name, "step": 0.01, "until": 2.0}


#: Each method, and each kind of scene with a few of them.
PAIRS = [
    *(("pendulum", method.name) for method in INTEGRATORS.values() if method.resumes),
    *((name, method) for name in KINDS for method in ("DOP853", "BDF")),
    *((name, "Radau") for name in ("rod", "driven")),
    *((name, "Gauss6") for name in ("rod", "driven")),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "method"), PAIRS)
def test_every_method_goes_on(scene, tmp_path, name, method):
    model, how = scene(name), how_of(INTEGRATORS[method])
    try:
        whole = simulate(model, **how)
    except InputError as refusal:
        pytest.skip(str(refusal))
    path = tmp_path / "run.checkpoint"
    found, parts = in_parts(model, path, 1, **how)
    assert parts > 0
    assert compared(found) == compared(whole)
    assert found.npz() == whole.npz()
    assert not path.exists()


#: What is asked of motion whose error is measured, by scenes.
PROMISES = {
    "pendulum": {"accuracy": 1e-9},
    "ball": {"accuracy": 1e-6, "until": 5.0},
    "rod": {"accuracy": 1e-9},
    "driven": {"accuracy": 1e-7},
    "sampled": {"accuracy": 1e-7},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "calls"),
    [(name, 8) for name in PROMISES if name != "ball"] + [("ball", 3), ("ball", 8)],
)
def test_a_measured_run_goes_on(scene, tmp_path, name, calls):
    model, how = scene(name), PROMISES[name]
    whole = simulate(model, **how)
    found, parts = in_parts(model, tmp_path / "c", calls, **how)
    assert parts > 1
    assert compared(found) == compared(whole)
    assert found.npz() == whole.npz()


@pytest.mark.slow
def test_attempts_in_wider_arithmetic_go_on(scene, tmp_path):
    model, how = scene("rod"), {"accuracy": 1e-13, "until": 30.0}
    whole = simulate(model, **how)
    if EXTENDED.epsilon < DOUBLE.epsilon and whole.implementation.startswith("compiled"):
        assert whole.implementation.endswith("long double")
    found, parts = in_parts(model, tmp_path / "c", 8, **how)
    assert parts > 1
    assert compared(found) == compared(whole)
    assert found.npz() == whole.npz()


@pytest.mark.slow
def test_a_measured_run_with_samples_in_files_goes_on(monkeypatch, scene, tmp_path):
    monkeypatch.setattr(samples, "WINDOW", 400)
    model, how = scene("pendulum"), {"accuracy": 1e-9, "samples": 5001}
    whole = tmp_path / "whole.npz"
    simulate(model, **how).write(whole)
    stream = Stream(str(tmp_path / "part.npz"), in_memory=0)
    _, parts = in_parts(model, tmp_path / "c", 10, stream, **how)
    assert parts > 1
    assert (tmp_path / "part.npz").read_bytes() == whole.read_bytes()
    assert not any(name.startswith("c") for name in os.listdir(tmp_path))


def test_an_orbit_in_polar_coordinates_goes_on(tmp_path):
    """Its coordinates are singular at the centre, which it does not meet."""
    model = model_of(derive(read_file(ROOT / "systems" / "celestial" / "kepler.yaml")))
    assert model.singular
    whole = simulate_past_singularities(model, SimulationOptions(accuracy=1e-9))
    looks = iter(range(10**9))
    path = str(tmp_path / "c")
    options = SimulationOptions(accuracy=1e-9)
    context = RunContext(checkpoint=Checkpoint(path), stop=lambda: next(looks) >= 25)
    first = simulate_past_singularities(model, options, context=context)
    assert first.status == "stopped"
    again = Checkpoint(path, resume=os.path.exists(path))
    found = simulate_past_singularities(model, options, context=RunContext(checkpoint=again))
    assert compared(found) == compared(whole)
    assert found.npz() == whole.npz()


@pytest.mark.slow
@pytest.mark.parametrize(("name", "calls"), [("pendulum", 3), ("ball", 6)])
def test_samples_in_a_file_go_on(monkeypatch, scene, tmp_path, name, calls):
    monkeypatch.setattr(samples, "WINDOW", 400)
    model, how = scene(name), {"method": "DOP853", "rtol": 1e-9, "samples": 10_001, "until": 10.0}
    whole = tmp_path / "whole.npz"
    simulate(model, **how).write(whole)
    stream = Stream(str(tmp_path / "part.npz"), in_memory=0)
    path = tmp_path / "run.checkpoint"
    _, parts = in_parts(model, path, calls, stream, **how)
    assert parts > 0
    assert (tmp_path / "part.npz").read_bytes() == whole.read_bytes()
    assert not any("run.checkpoint" in name for name in os.listdir(tmp_path))


def stopped(model, path, **how):
    """A run that is stopped soon, and leaves its state."""
    looks = iter(range(10**9))
    found = simulate(model, **how, checkpoint=Checkpoint(str(path)), stop=lambda: next(looks) >= 3)
    assert found.status == "stopped"
    return found


#: A run that takes long enough to be stopped in it.
STEPS = {"method": "RK4", "step": 1e-4}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"step": 2e-4}, "--samples was 200001 and is 100001"),
        ({"until": 15.0}, "--until was 20 and is 15"),
        ({"method": "Gauss4"}, "--method was RK4 and is Gauss4"),
    ],
)
def test_other_options_are_refused(scene, tmp_path, change, said):
    model, path = scene("pendulum"), tmp_path / "c"
    stopped(model, path, **STEPS)
    with pytest.raises(InputError, match=said):
        simulate(model, **{**STEPS, **change}, checkpoint=Checkpoint(str(path), resume=True))
    assert path.exists()


def test_another_scene_and_other_numbers_are_refused(scene, tmp_path):
    model, path = scene("pendulum"), tmp_path / "c"
    stopped(model, path, **STEPS)
    first, *others = model.parameters
    heavier = dataclasses.replace(
        model, parameters=(dataclasses.replace(first, value=2.0), *others)
    )
    higher = dataclasses.replace(model, initial=(2.6, 0.0))
    other = model_of(derive(read_text(PENDULUM.replace("9.81", "9.8"))))
    said = [
        (heavier, "m was 1 and is 2"),
        (higher, "theta was 2.5 and is 2.6"),
        (other, "the scene"),
    ]
    for changed, words in said:
        with pytest.raises(InputError, match=words):
            simulate(changed, **STEPS, checkpoint=Checkpoint(str(path), resume=True))


def test_another_version_is_refused(monkeypatch, scene, tmp_path):
    model, path = scene("pendulum"), tmp_path / "c"
    stopped(model, path, **STEPS)
    monkeypatch.setattr(checkpoint, "__version__", "0.0.1")
    with pytest.raises(InputError, match="another version of lagrange"):
        simulate(model, **STEPS, checkpoint=Checkpoint(str(path), resume=True))


def test_recordings_that_have_changed_are_refused(scene, tmp_path):
    model, path = scene("driven"), tmp_path / "c"
    stopped(model, path, **STEPS)
    record = tmp_path / "push.csv"
    record.write_text(record.read_text().replace("1.0,0.14", "1.0,0.15"))
    changed = model_of(derive(read_file(tmp_path / "driven.yaml")))
    with pytest.raises(InputError, match="recorded of its inputs has changed"):
        simulate(changed, **STEPS, checkpoint=Checkpoint(str(path), resume=True))


def test_what_could_go_on_is_not_begun_anew(scene, tmp_path):
    model, path = scene("pendulum"), tmp_path / "c"
    stopped(model, path, **STEPS)
    before = path.read_bytes()
    with pytest.raises(InputError, match="has the state of a run that was interrupted"):
        simulate(model, **STEPS, checkpoint=Checkpoint(str(path)))
    assert path.read_bytes() == before


def test_there_must_be_something_to_go_on_from(scene, tmp_path):
    again = Checkpoint(str(tmp_path / "nothing"), resume=True)
    model = scene("pendulum")
    with pytest.raises(InputError, match=r"cannot read '.*nothing'"):
        simulate(model, **STEPS, checkpoint=again)


def test_what_is_no_checkpoint_is_kept_and_not_to_be_removed(scene, tmp_path):
    path = tmp_path / "scene.yaml"
    path.write_text("name: mine")
    with pytest.raises(InputError, match="there already, and was not written by") as refused:
        simulate(scene("pendulum"), **STEPS, checkpoint=Checkpoint(str(path)))
    assert "rm " not in str(refused.value)
    assert path.read_text() == "name: mine"


@pytest.mark.parametrize("endless", ["/dev/zero", "fifo"])
def test_devices_and_pipes_are_not_read(scene, tmp_path, endless):
    if endless == "fifo":
        endless = str(tmp_path / "pipe")
        os.mkfifo(endless)
    with pytest.raises(InputError, match="is damaged, or was not written by"):
        simulate(scene("pendulum"), **STEPS, checkpoint=Checkpoint(endless, resume=True))


def torn(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def flipped(path: Path) -> None:
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(bytes(data))


def other(path: Path) -> None:
    np.savez(path.with_suffix(".npz"), a=np.arange(3))
    path.with_suffix(".npz").rename(path)


@pytest.mark.parametrize("damage", [torn, flipped, other])
@pytest.mark.parametrize("file", ["c", "c.samples"])
def test_damage_is_noticed(monkeypatch, scene, tmp_path, file, damage):
    model, path = scene("pendulum"), tmp_path / "c"
    stream = Stream(in_memory=0)
    stopped(model, path, **STEPS, stream=stream)
    damage(tmp_path / file)
    again = Checkpoint(str(path), resume=True)
    with pytest.raises(InputError, match="is damaged"):
        simulate(model, **STEPS, stream=stream, checkpoint=again)


@pytest.mark.parametrize("name", [m.name for m in INTEGRATORS.values() if not m.resumes])
def test_a_method_whose_state_is_out_of_reach_is_refused(scene, tmp_path, name):
    """With the methods that can go on, before any file is made."""
    or_skip(name)
    how = {"method": name, "rtol": 1e-6, "checkpoint": Checkpoint(str(tmp_path / "c"))}
    with pytest.raises(InputError, match=f"{name} cannot be interrupted") as refusal:
        simulate(scene("pendulum"), **how, stream=Stream(in_memory=0))
    _, can = refusal.value.problems[0].hint.split("methods that can: ")
    assert can.split(", ") == [m.name for m in INTEGRATORS.values() if m.resumes]
    assert not list(tmp_path.glob("c*"))


def test_the_state_is_written_now_and_then(monkeypatch, scene, tmp_path):
    monkeypatch.setattr(checkpoint, "INTERVAL", 0.0)
    times = []
    path = tmp_path / "c"

    def look():
        times.append(path.stat().st_mtime_ns if path.exists() else 0)
        return len(times) > 20

    simulate(scene("pendulum"), **STEPS, checkpoint=Checkpoint(str(path)), stop=look)
    assert len(set(times)) > 5


@pytest.mark.parametrize("resume", [False, True])
def test_an_end_while_the_compiler_works_leaves_checkpoints_as_they_are(tmp_path, resume):
    """What Python would have to interpret then is not what a run goes on by."""
    model = model_of(derive(read_text(PENDULUM)))
    functions = compiled_or_skip(model)
    path, options = tmp_path / "c", {"method": "RK4", "step": 1e-3, "stop": lambda: True}
    if resume:
        simulate(model, **options, functions=functions, checkpoint=Checkpoint(str(path)))
    before = path.read_bytes() if resume else None
    with heard_by(Listener(ends=lambda: True)):
        checkpoint = Checkpoint(str(path), resume=resume)
        ended = simulate(model, **options, cache=Cache(None, "none"), checkpoint=checkpoint)
    assert ended.status == "stopped"
    assert "interrupted" in ended.implementation
    assert (path.read_bytes() if path.exists() else None) == before


@pytest.mark.parametrize("resume", [False, True])
def test_an_end_while_a_method_is_compiled_leaves_checkpoints_as_they_are(
    monkeypatch, tmp_path, resume
):
    """The equations are compiled by then, and the state of a run in Python would be another."""
    model = model_of(derive(read_text(PENDULUM)))
    functions = compiled_or_skip(model)
    path, options = tmp_path / "c", {"method": "Gauss4", "step": 1e-3}
    if resume:
        stopped = {**options, "stop": lambda: True}
        simulate(model, **stopped, functions=functions, checkpoint=Checkpoint(str(path)))
    before = path.read_bytes() if resume else None
    asked = []

    def ended_by_a_signal(*arguments):
        asked.append(arguments)
        raise CompileError("cc was interrupted")

    fresh = compiled_or_skip(model)
    monkeypatch.setattr(libraries, "load_libraries", ended_by_a_signal)
    with heard_by(Listener(ends=lambda: bool(asked))):
        checkpoint = Checkpoint(str(path), resume=resume)
        ended = simulate(model, **options, functions=fresh, checkpoint=checkpoint)
    assert asked
    assert ended.status == "stopped"
    assert (path.read_bytes() if path.exists() else None) == before
