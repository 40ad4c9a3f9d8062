"""Emitted code of every language on the shipped scenes, against their symbolic equations."""

from __future__ import annotations

import importlib
import math
import re
import subprocess
from pathlib import Path

import pytest

from lagrange_cli import load, loads
from lagrange_cli.emit.languages.interface import interface_of
from lagrange_cli.mechanics.dynamics import body_recursion
from lagrange_cli.program.lowered.functions import Solve
from lagrange_cli.program.lowered.routines.registry import ROUTINES
from lagrange_cli.program.program import build_program
from lagrange_cli.program.systems import agreement
from tests.emit.languages.c_and_python import Python
from tests.emit.languages.cases import CASES, MORE, built
from tests.emit.languages.cpp import Cpp
from tests.emit.languages.drivers import MODED, executed
from tests.emit.languages.fortran import Fortran
from tests.emit.languages.javascript import JavaScript
from tests.emit.languages.octave import Octave
from tests.emit.languages.reference import calls, derivatives, states_at
from tests.emit.languages.rust import Rust
from tests.systems.shipped import APART, SCENES, SLICE, derived

DRIVERS = {driver.language: driver for driver in (JavaScript(), Fortran(), Octave(), Rust(), Cpp())}

ROOT = Path(__file__).parents[3]

#: Largest error of a result, relative to the sum of the magnitudes that it is made of.
TOLERANCE = 1e-13

#: Part of a scene's run that scripts are compared over.
SPAN = 1 / 50

#: Scenes whose scripts the suite runs: free and with closures, with inputs and time.
SCRIPTS = ("kepler", "driven_spring", "chaplygin_sleigh", "four_bar_linkage", "heavy_top")

every_language = pytest.mark.parametrize("driver", DRIVERS.values(), ids=DRIVERS)


def held_by(driver, equations):
    """Those equations whose solvers a driver's language has."""
    return [e for e in equations if driver.has_solvers or _solvers(e) <= ROUTINES.keys()]


def _solvers(equations):
    functions = interface_of(equations, frozenset()).functions
    steps = (step for function, _ in functions for step in function.body)
    return {step.routine for step in steps if isinstance(step, Solve)}


ALL = [*SCENES, *APART]


def in_parts(chosen, number):
    """Scenes in parts of one process each: those chosen, and the others as campaigns."""
    others = [name for name in ALL if name not in chosen]
    parts = [others[k : k + number] for k in range(0, len(others), number)]
    return [
        pytest.param(list(chosen), id="slice"),
        *(pytest.param(p, id=p[0], marks=pytest.mark.campaign) for p in parts),
    ]


@pytest.mark.slow
@every_language
@pytest.mark.parametrize("names", in_parts((*SLICE, "slider_with_play"), 25))
def test_functions_agree_with_the_equations(driver, names, tmp_path):
    driver.require()
    _agree(driver, [derived(name) for name in names], tmp_path)


@pytest.mark.slow
@every_language
@pytest.mark.parametrize(
    "names",
    [
        pytest.param([name for name in CASES if name not in MORE], id="few"),
        pytest.param(MORE, id="more", marks=pytest.mark.campaign),
    ],
)
def test_functions_of_other_systems_agree_with_the_equations(driver, names, tmp_path):
    driver.require()
    _agree(driver, [built(name) for name in names], tmp_path)


#: Two turns of a body, a frame without joints, a body that slides, another that turns.
CHAIN = """
name: chain_of_bodies
parameters: {m: 1.25, l: 0.5, g: 9.81}
frames:
  foot: {on: a, at: [0, 0.1, -l]}
bodies:
  a: {turn: [z: p, x: q], centre: [0.1, 0, -l/2], mass: m, inertia: [0.02, 0.03, 0.01]}
  b: {on: foot, at: [r, 0, -l], turn: [y: 0.3], mass: 2*m, inertia: [0.02, 0.03, 0.01]}
  c: {on: b, at: [0, l, 0], turn: [y: s], centre: [0, 0, -l/2], mass: m, inertia: {rod: l}}
coordinates: [p, q, r, s]
potentials: {weight: {gravity: g}}
"""


@pytest.mark.slow
@every_language
def test_loops_make_the_mass_matrix_of_a_chain_of_bodies(driver, tmp_path, monkeypatch):
    driver.require()
    monkeypatch.setattr(body_recursion, "CHAIN_TERMS", 0)
    monkeypatch.setattr(agreement, "FEWEST_ARTICULATED", 1)
    equations = loads(CHAIN).derive().equations
    assert build_program(equations, ["mass_matrix"]).composite_numbers
    _agree(driver, [equations], tmp_path)


#: Of one degree of freedom; unrolled; with closures of positions and of velocities; with inputs;
#: sparse in C and Python.
DIFFERENTIATED = ("pendulum", "furuta_pendulum", "four_bar_linkage", "snakeboard", "driven_spring")


@pytest.mark.slow
@every_language
def test_jacobians_are_derivatives_of_the_right_hand_side(driver, tmp_path):
    driver.require()
    equations = [*map(derived, DIFFERENTIATED), fput_chain()]
    held = held_by(driver, equations)
    modules = [driver.emitted(e, tmp_path / e.presentation.name, jacobian=True) for e in held]
    rows = [derivatives(e) for e in held]
    assert {call.function for call in rows[-2]} == {"jacobian", "jacobian_u", "jacobian_p"}
    results = driver.results(tmp_path, modules, rows)
    wrong = [
        f"{module.folder.name}: {problem}"
        for module, calls_of, found in zip(modules, rows, results, strict=True)
        for call, values in zip(calls_of, found, strict=True)
        if (problem := call.wrong(values, 1e-10))
    ]
    assert wrong == []


def fput_chain():
    """Springs between neighbours, of which most derivatives vanish."""
    return load(ROOT / "systems/chains/fput.yaml", parameters={"n": 20}).derive().equations


def _recorded(module):
    return {"inputs"} if module.interface.recorded else set()


def _agree(driver, equations, folder):
    held = held_by(driver, equations)
    modules = [driver.emitted(e, folder / e.presentation.name) for e in held]
    expected = [calls(e) for e in held]
    for module, rows in zip(modules, expected, strict=True):
        # Functions in a mode, and recorded inputs, are compared in test_contacts.
        moded = set(MODED) - {"rhs"} if module.interface.contacts else set()
        functions = set(module.functions) - moded - _recorded(module)
        assert {call.function for call in rows} == functions, module.folder.name
    results = driver.results(folder, modules, expected)
    wrong = [
        f"{module.folder.name}: {problem}"
        for module, rows, found in zip(modules, expected, results, strict=True)
        for call, values in zip(rows, found, strict=True)
        if (problem := call.wrong(values, TOLERANCE))
    ]
    assert wrong == []


@pytest.mark.slow
@every_language
@pytest.mark.parametrize("names", in_parts(SCRIPTS, 25))
def test_scripts_agree_with_the_simulation(driver, names, tmp_path):
    driver.require()
    if driver.is_slow:
        names = names[:3]
    for equations in held_by(driver, map(derived, names)):
        name = equations.presentation.name
        module = driver.emitted(equations, tmp_path / name)
        start, end = module.interface.start, module.interface.until
        until = start + (end - start) * SPAN
        coarse, fine = (driver.rows(module, until=until, steps=k) for k in (1, 2))
        assert len(fine) == module.interface.rows + 1
        states = states_at(equations, [start, until])
        for k, (row, state) in enumerate(zip((fine[0], fine[-1]), states, strict=True)):
            largest = max(map(abs, state)) or 1
            for x, by_one, exact in zip(row[1:], coarse[-1][1:], state, strict=True):
                step_error = k * abs(x - by_one)
                assert abs(x - exact) <= step_error + 1e-8 * largest, name


@pytest.mark.slow
@pytest.mark.parametrize("language", ["javascript", "fortran", "octave"])
def test_starts_off_the_closures_are_refused_with_the_nearest(language, tmp_path):
    driver = DRIVERS[language]
    driver.require()
    equations = derived("four_bar_linkage")
    module = driver.emitted(equations, tmp_path / "module")
    done = subprocess.run(
        driver.script(module, ["beta=0.5"]), capture_output=True, text=True, cwd=module.folder
    )
    assert done.returncode == 1
    assert "the initial state violates the constraints" in done.stderr
    nearest = done.stderr.split("nearest:")[1].splitlines()[0]
    words = dict(word.split("=") for word in nearest.split())
    assert set(words) == set(module.interface.state)
    angles = {name: float(words[name]) for name in ("alpha", "beta", "gamma")}
    a, b, c = (0.5, 1.5, 1.25)
    height = a * math.sin(angles["alpha"]) + b * math.sin(angles["beta"])
    assert height == pytest.approx(c * math.sin(angles["gamma"]), abs=1e-14)


#: Arguments that scripts refuse: unknown names, texts that are no number, steps that are no count.
BAD = ("z0=1", "x", "x=", "x=1=2", "x=5-3", "x=1,5", "x=inf", "steps=0", "steps=-1", "steps=0.5")


@pytest.mark.slow
@every_language
def test_arguments_that_are_no_values_are_refused(driver, tmp_path):
    driver.require()
    module = driver.emitted(derived("bead_on_parabola"), tmp_path / "module")
    for word in BAD[-5:] if driver.is_slow else BAD:
        command = driver.script(module, [word])
        done = subprocess.run(command, capture_output=True, text=True, cwd=module.folder)
        assert (done.returncode, done.stdout) == (1, ""), word
        assert f"{word}: not NAME=NUMBER with a known name" in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="a device of Linux")
@pytest.mark.parametrize("language", ["javascript", "rust", "cpp"])
def test_a_full_disk_is_told(language, tmp_path):
    """Octave and the library of gfortran pass over it."""
    driver = DRIVERS[language]
    driver.require()
    module = driver.emitted(derived("bead_on_parabola"), tmp_path / "module")
    with open("/dev/full", "w") as full:
        command = driver.script(module, ["until=1"])
        done = subprocess.run(
            command, stdout=full, stderr=subprocess.PIPE, text=True, cwd=module.folder
        )
    assert done.returncode == 1
    assert "the table could not be written" in done.stderr


@pytest.mark.slow
def test_programs_of_fortran_hold_many_coordinates(tmp_path):
    """A statement has 255 further lines at most, which is fewer than the 320 names of this one."""
    driver = DRIVERS["fortran"]
    driver.require()
    chain = load(ROOT / "systems/chains/fput.yaml", parameters={"n": 160}).derive().equations
    module = driver.emitted(chain, tmp_path / "module")
    (first, *_) = driver.rows(module, until=0.1, steps=1)
    assert first[1:161] == pytest.approx([math.sin(math.pi * i / 161) for i in range(1, 161)])


def test_errors_beyond_the_tolerance_are_found():
    rows = calls(derived("driven_spring"))
    assert {call.function for call in rows} >= {"rhs", "inputs", "outputs"}
    for call in rows:
        assert call.wrong(call.expected, 0) is None
        off = [x + 2e-13 * size for x, size in zip(call.expected, call.sizes, strict=True)]
        assert not any(call.sizes) or call.wrong(off, TOLERANCE)
        assert call.wrong([*call.expected, 0.0], TOLERANCE)


@pytest.mark.slow
@pytest.mark.parametrize("language", ["cpp", "rust"])
def test_a_start_off_the_closures_is_refused(language, tmp_path):
    driver = DRIVERS[language]
    driver.require()
    module = driver.emitted(derived("four_bar_linkage"), tmp_path / "module")
    name = module.interface.state[0]
    with pytest.raises(AssertionError, match=r"violates the constraints; nearest: ?"):
        executed(driver.script(module, [f"{name}=0.1"]), "", module.folder)


@pytest.mark.slow
def test_the_page_names_errors(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    module = importlib.import_module("languages")
    kinds = {"inputs": [derived("driven_spring")], "a file": [derived("seismometer")]}
    drivers = {"python": Python(), "javascript": DRIVERS["javascript"]}
    DRIVERS["javascript"].require()
    heading, _, inputs, recorded, *_ = module.table(kinds, drivers)
    assert heading == "| kind of scene | scenes | python | javascript |"
    row = re.fullmatch(r"\| inputs \| 1 \| (\S+) \| (\S+) \|", inputs)
    assert all(0 < float(error) < 1e-15 for error in row.groups())
    row = re.fullmatch(r"\| a file \| 1 \| (\S+) \| (\S+) \|", recorded)
    assert all(0 < float(error) < 1e-15 for error in row.groups())
