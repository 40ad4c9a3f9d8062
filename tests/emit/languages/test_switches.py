"""States with two values in every language: scripts follow their changes as the simulation does."""

from __future__ import annotations

import subprocess
import sys
from functools import cache
from itertools import product

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.simulate import simulate
from tests.campaign import slice_of
from tests.emit.emitted_c import run, write
from tests.emit.languages.test_languages import DRIVERS
from tests.systems.shipped import derived

pytestmark = [pytest.mark.slow, pytest.mark.compiler]

#: A contact, an input, a state with a rate, and two relays of which one changes at the start.
MAGNET = """
name: magnet
parameters: {m: 1, g: 9.81, e: 0.7, F: 14, low: 0.35, high: 0.6, T: 0.3}
particles:
  ball: {mass: m, position: [0, 0, z]}
coordinates: [z]
constraints: {floor: {unilateral: 'z >= 0', restitution: e}}
potentials: {weight: {gravity: g}}
inputs: {u: sin(5*t)}
states:
  lag: (dot(z) - lag)/T
  pull: {on: z <= low, off: z >= high}
  late: {on: lag >= 0.1, off: lag <= -0.1}
forces:
  coil: {on: z, force: F*pull + u}
  air: {on: z, force: -late - lag}
initial: {z: 0.3, dot(z): 0, lag: 0, pull: 0, late: 0}
simulate: {until: 3}
"""

#: A block at rest on a floor, which a relay lifts off: forces change while a contact is closed.
LIFT = """
name: lift
parameters: {m: 1, g: 9.81, F: 15}
particles:
  block: {mass: m, position: [x, 0, z]}
coordinates: [x, z]
constraints: {floor: 'z >= 0'}
potentials: {weight: {gravity: g}}
states:
  pull: {on: x >= 0.5, off: z >= 0.2}
forces:
  rope: {on: z, force: F*pull}
initial: {x: 0, dot(x): 1, z: 0, dot(z): 0, pull: 0}
simulate: {until: 0.75}
"""

SCENES = {
    "magnet": lambda: loads(MAGNET).derive().equations,
    "lift": lambda: loads(LIFT).derive().equations,
    "slider_with_play": lambda: derived("slider_with_play"),
    "hit_and_miss_engine": lambda: derived("hit_and_miss_engine"),
}


@cache
def motion(name):
    """Equations, and the state at the end of the scene's run."""
    equations = SCENES[name]()
    end = simulate(equations, accuracy=1e-10)
    assert end.status == "ok"
    return equations, np.array([end.columns[n][-1] for n in equations.system.state_names])


def require_same(done, name):
    equations, exact = motion(name)
    assert done.returncode == 0, done.stderr
    row = np.array([float(x) for x in done.stdout.splitlines()[-1].split(",")])
    assert row[0] == pytest.approx(equations.system.simulate.until, rel=1e-14)
    assert np.abs(row[1:] - exact).max() <= 1e-9 * np.abs(exact).max()
    return [line.split(": ")[1] for line in done.stderr.splitlines() if line.startswith("t = ")]


PLAY = ["off:right", "on:left", "off:left", "on:right"]

#: Scripts that take a good part of a minute; others of the language follow states with two values.
MINUTES = [("octave", "magnet"), ("octave", "lift")]

#: Changes on the way, in their order.
CHANGES = {
    "magnet": ["on:late", "off:pull", "off:late", "on:pull", "contact:floor"] * 3 + ["on:late"],
    "lift": ["on:pull"],
    "slider_with_play": (PLAY * 4)[:14],
    "hit_and_miss_engine": ["off:firing", "on:firing"] * 3,
}


@pytest.mark.parametrize(
    ("language", "name"),
    slice_of([*product(DRIVERS, SCENES)], 0, lambda pair: pair not in MINUTES),
)
def test_scripts_change_states_as_the_simulation_does(language, name, tmp_path):
    driver = DRIVERS[language]
    driver.require()
    module = driver.emitted(motion(name)[0], tmp_path / "module")
    command = driver.script(module, [])
    done = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
    assert require_same(done, name) == CHANGES[name]


@pytest.mark.parametrize("name", SCENES)
def test_programs_of_c_change_states_as_the_simulation_does(name, tmp_path):
    sanitize = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
    source = write(motion(name)[0], tmp_path, main=True)
    run("gcc", "-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", *sanitize, source, "-o",
        tmp_path / "run", "-lm")  # fmt: skip
    done = subprocess.run([tmp_path / "run"], capture_output=True, text=True)
    assert require_same(done, name) == CHANGES[name]


@pytest.mark.parametrize("name", SCENES)
def test_scripts_of_python_change_states_as_the_simulation_does(name, tmp_path):
    ((file, text),) = EMITTERS["python"].emit(motion(name)[0]).items()
    (tmp_path / file).write_text(text, encoding="utf-8")
    done = subprocess.run([sys.executable, tmp_path / file], capture_output=True, text=True)
    assert require_same(done, name) == CHANGES[name]


#: It is pulled where it is pushed off: from x = 1 on both conditions hold.
NEITHER = """
name: neither
coordinates: [x]
kinetic: {block: dot(x)^2/2}
states:
  r: {on: x >= 1, off: x >= 0.5}
forces: {push: {on: x, force: r}}
initial: {x: START, dot(x): 1, r: 0}
simulate: {until: 2}
"""


@pytest.mark.parametrize("language", DRIVERS)
def test_scripts_end_where_both_conditions_hold(language, tmp_path):
    driver = DRIVERS[language]
    driver.require()
    for start in (0, 1.5):
        equations = loads(NEITHER.replace("START", str(start))).derive().equations
        module = driver.emitted(equations, tmp_path / f"module{start}")
        command = driver.script(module, [])
        done = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
        assert done.returncode == 1
        message = "stopped" if start == 0 else "a state with two values has neither at the start"
        assert message in done.stderr
