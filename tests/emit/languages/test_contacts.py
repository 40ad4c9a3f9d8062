"""Contacts and recorded inputs in every language: functions in a mode, events, scripts."""

from __future__ import annotations

import subprocess
import tempfile
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from lagrange_cli.simulate import simulate
from tests.emit import contact_systems as contacts
from tests.emit.emitted_c import run, write
from tests.emit.languages.drivers import executed
from tests.emit.languages.reference import Call
from tests.emit.languages.test_languages import every_language
from tests.emit.test_emitted_contacts import ILL_CONDITIONED
from tests.emit.test_recorded_inputs import made
from tests.systems.shipped import derived

pytestmark = [pytest.mark.slow, pytest.mark.compiler]

#: Systems of every kind: free, driven by time, beside closures, with pushes that are guessed, with
#: states of first order.
SYSTEMS = {
    **{name: contacts.CASES[name] for name in ("bouncing_ball", "ladder", "moving_walls")},
    **{name: contacts.CASES[name] for name in ("pendulum_at_wall", "sleigh_at_wall")},
    "balls": lambda: contacts.balls(10),
    **contacts.IN_AIR,
}

#: Modes of a system that are compared: those with many contacts are a slice.
MOST_MODES = 4


def calls_of(name, equations):
    """Calls of every function that takes a mode, with what the interpreter returns."""
    simulated = contacts.Interpreted(equations)
    generator, c = np.random.default_rng(3), len(equations.system.contacts)
    n, parameters = len(equations.system.coordinates), contacts.defaults(equations)
    size = equations.system.layout.size
    modes = list(product((0, 1), repeat=c))
    for k in range(2):
        y = generator.uniform(-1, 1, size)
        t, p = float(generator.uniform(0, 2)), parameters * generator.uniform(0.9, 1.1)
        y[:n] = np.sort(y[:n]) if name == "balls" else y[:n]
        for mode in modes[:: max(1, len(modes) // MOST_MODES)]:
            flags = [float(flag) for flag in mode]
            given = (t, tuple(y.tolist()), tuple(p.tolist()), ())
            for function in ("rhs", "multipliers", "constraints", "events"):
                own = function if function == "events" else f"contact_{function}"
                own = own if any(mode) or function != "rhs" else "rhs"
                found = simulated(own, t, y, p, flags)
                if found is not None:
                    yield Call(function, *given, tuple(found), (), mode)
            found = simulated.project(t, y, p, flags)
            if found is not None:
                yield Call("project", *given, tuple(found), (), mode)
            event, bounce = int(generator.integers(-1, c)), float(k)
            after = simulated.reset(t, y, p, flags, event, bounce)
            found = np.full(size + c, np.nan) if after is None else np.concatenate(after)
            yield Call("reset", *given, tuple(found), (), mode, (event + 1.0, bounce))


@every_language
def test_functions_in_a_mode_are_those_of_the_interpreter(driver, tmp_path):
    driver.require()
    equations = {name: build() for name, build in SYSTEMS.items()}
    expected = [list(calls_of(name, e)) for name, e in equations.items()]
    functions = {call.function for rows in expected for call in rows}
    assert functions == {"rhs", "multipliers", "constraints", "events", "project", "reset"}
    resets = [call for rows in expected for call in rows if call.function == "reset"]
    assert 0 < sum(np.isnan(call.expected).any() for call in resets) < len(resets)
    modules = [driver.emitted(e, tmp_path / name) for name, e in equations.items()]
    results = driver.results(tmp_path, modules, expected)
    for name, rows, found in zip(equations, expected, results, strict=True):
        within = ILL_CONDITIONED.get(name, 1e-12)
        for call, values in zip(rows, found, strict=True):
            exact, case = np.array(call.expected), f"{name}: {call}"
            assert np.isnan(values).tolist() == np.isnan(exact).tolist(), case
            off = np.abs(np.array(values) - exact)
            assert np.isnan(exact).all() or off.max() <= within * np.abs(exact).max(), case


#: Scene → part of its run that is followed: rounding grows from bounce to bounce.
RUNS = {
    "bouncing_ball": 1.0,
    "dropped_rod": 1.0,
    "ball_on_vibrating_table": 0.3,
    **dict.fromkeys(contacts.IN_AIR, 1.0),
}


@cache
def by_c(name):
    """Equations, the words of a run, and what the program of C says for them."""
    equations = contacts.IN_AIR[name]() if name in contacts.IN_AIR else derived(name)
    start, end = equations.system.simulate.start, equations.system.simulate.until
    words = [f"until={start + RUNS[name] * (end - start)!r}", "steps=2"]
    with tempfile.TemporaryDirectory() as folder:
        program = Path(folder, "run")
        run("gcc", "-Og", write(equations, Path(folder), main=True), "-o", program, "-lm")
        return equations, words, subprocess.run([program, *words], capture_output=True, text=True)


@every_language
@pytest.mark.parametrize("name", RUNS)
def test_scripts_follow_events_as_c_does(driver, name, tmp_path):
    driver.require()
    if driver.is_slow and name not in ("dropped_rod", "ball_in_air"):
        pytest.skip("two runs show it")
    equations, words, expected = by_c(name)
    module = driver.emitted(equations, tmp_path / "module")
    command = driver.script(module, words)
    found = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
    assert (expected.returncode, found.returncode) == (0, 0), found.stderr
    events, others = (text.stderr.splitlines() for text in (expected, found))
    assert len(events) == len(others) > 0
    for mine, other in zip(events, others, strict=True):
        (t, what), (moment, also) = (
            line.removeprefix("t = ").split(": ") for line in (mine, other)
        )
        assert what == also
        assert float(moment) == pytest.approx(float(t), abs=1e-9)
    rows = [
        np.array([[float(x) for x in line.split(",")] for line in text.stdout.split()[1:]])
        for text in (expected, found)
    ]
    assert np.abs(rows[1] - rows[0]).max() <= 1e-9 * np.abs(rows[0]).max()


@every_language
def test_runs_back_in_time_and_starts_below_a_floor_are_refused(driver, tmp_path):
    driver.require()
    module = driver.emitted(contacts.in_air(contacts.BALL_IN_AIR), tmp_path / "module")
    # Velocities and states are no measure of a gap.
    below = ["z=-1", "dot(z)=1e12", "s1=1e12"]
    for words, message in ((["until=-1"], "back in time"), (below, "violates floor by 1")):
        command = driver.script(module, words)
        done = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
        assert (done.returncode, done.stdout) == (1, "")
        assert message in done.stderr.replace("1.000e0", "1")


@every_language
@pytest.mark.parametrize("kind", ["previous", "linear", "cubic"])
def test_scripts_follow_recordings(driver, kind, tmp_path):
    driver.require()
    if driver.is_slow and kind != "cubic":
        pytest.skip("one run shows it")
    equations = made(tmp_path, kind)
    wanted = simulate(equations).state
    module = driver.emitted(equations, tmp_path / "module")
    *_, last = executed(driver.script(module, []), "", module.folder).split()
    values = [float(x) for x in last.split(",")]
    assert values == pytest.approx([4, wanted["x"], wanted["dot(x)"]], abs=1e-8)
    # Column h is held after its last row; a is not.
    command = driver.script(module, ["until=4.01"])
    done = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
    assert done.returncode == (0 if kind == "previous" else 1)
