"""FMI units, run by FMPy: an importer of the Modelica Association's standard that is not ours."""

from __future__ import annotations

import ctypes
import hashlib
import math
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import load, loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange
from tests.emit.emitted_c import WARNINGS, compiler, run
from tests.systems.shipped import APART, SCENES

pytestmark = [pytest.mark.slow, pytest.mark.compiler]

try:
    import fmpy
    from fmpy import fmi2, fmi3
    from fmpy.validation import validate_fmu
except ImportError:
    assert os.environ.get("CI") != "true", "fmpy is not installed"
    pytest.skip("fmpy is not installed", allow_module_level=True)

VERSIONS = ["2", "3"]

#: A cart that is pushed by an input and shaken by another; all texts try to end what they stand in.
CART = """
name: driven_cart
title: 'Cart & pole <"driven"> ]]> -- %s &amp;'
description: "breaks\\tand\\nlines \\\\ */ <!-- \\u0394 -->"
parameters:
  M: {value: 1.0, unit: kg, description: 'mass & "more" <b>'}
  m: {value: 0.3, unit: kg}
  l: {value: 0.5, unit: m, positive: true}
  g: {value: 9.81, unit: m/s^2}
plane: xz
particles:
  cart: {mass: M, position: [s, yc, zc]}
  bob: {mass: m, position: [x, y, z]}
constraints: {rail: zc = 0}
coordinates:
  s: {unit: m, description: "position </Real> of the cart"}
  theta: {unit: rad}
definitions: {x: s + l*sin(theta), z: l*cos(theta)}
inputs: {F: 0, w: 0.1*sin(3*t)}
forces: {motor: {on: cart, force: [F + w, 0, 0]}}
potentials: {weight: {gravity: g}}
outputs: {tip: x^2, power: F*dot(s)}
initial: {s: 0, theta: 0.2}
simulate: {until: 2, accuracy: 1e-9}
"""

#: A ball with a push; of two of them, joined by a spring, TWO is the whole.
ONE = """
name: ball_{name}
parameters: {{m: {mass}, k: 3.0}}
particles: {{ball: {{mass: m, position: [x, y, z]}}}}
constraints: {{line: [y = 0, z = 0]}}
coordinates: [x]
inputs: {{F: 0}}
potentials: {{spring: k/2*x^2}}
forces: {{push: {{on: ball, force: [F, 0, 0]}}}}
initial: {{x: {start}, dot(x): 0.5}}
simulate: {{until: 2}}
"""
TWO = """
parameters: {m1: 1.0, m2: 2.0, k: 3.0, c: 5.0}
particles:
  one: {mass: m1, position: [x1, y1, z1]}
  two: {mass: m2, position: [x2, y2, z2]}
constraints: {lines: [y1 = 0, z1 = 0, y2 = 0, z2 = 0]}
coordinates: [x1, x2]
potentials: {walls: k/2*(x1^2 + x2^2), spring: c/2*(x1 - x2)^2}
initial: {x1: 1, dot(x1): 0.5, x2: -0.5, dot(x2): 0.5}
simulate: {until: 2, accuracy: 1e-11, samples: 21}
"""

FIXED = """
particles: {p: {mass: 1, position: [x, y, z]}}
constraints: {fixed: [x = 1, y = 0, z = 0]}
"""

SCENES_HERE: dict[str, Callable[[], object]] = {
    "bouncing_ball": lambda: load(SCENES["bouncing_ball"]).derive(),
    "double_pendulum": lambda: load(SCENES["double_pendulum"]).derive(),
    "four_bar_linkage": lambda: load(SCENES["four_bar_linkage"]).derive(),
    **{
        name: lambda name=name: load(SCENES[name]).derive()
        for name in (
            "block_leaving_wedge",
            "ladder_leaving_wall",
            "particle_leaving_sphere",
            "slack_rope",
        )
    },
    "dc_motor_pendulum": lambda: load(APART["dc_motor_pendulum"]).derive(),
    "seismometer": lambda: load(SCENES["seismometer"]).derive(),
    "driven_cart": lambda: loads(CART).derive(),
    "ball_one": lambda: loads(ONE.format(name="one", mass=1.0, start=1)).derive(),
    "ball_two": lambda: loads(ONE.format(name="two", mass=2.0, start=-0.5)).derive(),
}


@pytest.fixture(scope="module")
def derivation():
    known = {}

    def derived(name):
        if name not in known:
            known[name] = SCENES_HERE[name]()
        return known[name]

    return derived


@pytest.fixture(scope="module")
def unit(derivation, tmp_path_factory):
    """The path of a unit, which is made once."""
    compiler()
    folder = tmp_path_factory.mktemp("units")

    def made(name: str, version: str = "2") -> str:
        path = folder / f"{name}{version}.fmu"
        if not path.exists():
            package = derivation(name).package("fmu", fmi=version)
            assert not package.remarks
            path.write_bytes(package.files[f"{name}.fmu"])
        return str(path)

    return made


def columns_of(path: str, reference, kind: str = "CoSimulation", **more):
    """What an importer finds at the sample times of a run."""
    step = float(reference.t[1] - reference.t[0])
    found = fmpy.simulate_fmu(
        path, fmi_type=kind, stop_time=float(reference.t[-1]), output_interval=step, **more
    )
    rows = np.searchsorted(found["time"], reference.t - 1e-9)
    return {name: found[name][rows] for name in found.dtype.names}


def worst_error(found, reference) -> float:
    """The largest error of coordinates and velocities, over their scales."""
    return max(
        float(np.abs(found[name] - reference.columns[name]).max() / scale)
        for name, scale in reference.scales.items()
    )


class Instance:
    """An instance of a unit for model exchange or co-simulation, by the names of variables."""

    def __init__(self, path: str, folder: str, *, steps: bool) -> None:
        description = fmpy.read_model_description(path)
        module, is_old = (fmi2, True) if description.fmiVersion == "2.0" else (fmi3, False)
        kind = "Slave" if steps else "Model"
        maker = getattr(module, f"FMU{2 if is_old else 3}{kind}")
        self.is_old, self.variables = is_old, {v.name: v for v in description.modelVariables}
        self.unknowns = [u.variable.name for u in description.outputs + description.derivatives]
        self.states = [u.variable.derivative.name for u in description.derivatives]
        self.unit = maker(
            guid=description.guid if is_old else description.instantiationToken,
            unzipDirectory=folder,
            modelIdentifier=description.modelExchange.modelIdentifier,
            instanceName="one",
        )
        self.unit.instantiate()

    def start(self, **values: float) -> Instance:
        self.set(**values)
        if self.is_old:
            self.unit.setupExperiment(startTime=0.0)
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        return self

    def references(self, names):
        return [self.variables[name].valueReference for name in names]

    def get(self, *names: str) -> np.ndarray:
        getter = self.unit.getReal if self.is_old else self.unit.getFloat64
        return np.array(getter(self.references(names)))

    def set(self, **values: float) -> None:
        setter = self.unit.setReal if self.is_old else self.unit.setFloat64
        if values:
            setter(self.references(values), list(values.values()))

    def set_states(self, y: np.ndarray) -> None:
        y = np.ascontiguousarray(y, dtype=float)
        pointer = y.ctypes.data_as(ctypes.POINTER(ctypes.c_double))
        if self.is_old:
            self.unit.fmi2SetContinuousStates(self.unit.component, pointer, len(y))
        else:
            self.unit.setContinuousStates(pointer, len(y))

    def slopes(self, unknowns, known: str) -> np.ndarray:
        return np.array(
            self.unit.getDirectionalDerivative(
                self.references(unknowns), self.references([known]), [1.0]
            )
        )

    def step(self, t: float, h: float) -> None:
        self.unit.doStep(t, h)


@contextmanager
def instances(*paths: str, steps: bool = False) -> Iterator[list[Instance]]:
    with ExitStack() as stack:
        made = []
        for path in paths:
            folder = fmpy.extract(path)
            stack.callback(shutil.rmtree, folder, ignore_errors=True)
            made.append(Instance(path, folder, steps=steps))
            stack.callback(made[-1].unit.freeInstance)
        yield made


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(
    "name", ["bouncing_ball", "four_bar_linkage", "seismometer", "driven_cart"]
)
def test_units_are_valid(unit, name, version):
    assert validate_fmu(unit(name, version)) == []


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["bouncing_ball", "four_bar_linkage", "driven_cart"])
def test_sources_compile_without_warnings(derivation, tmp_path, name, version):
    """With the prefix of functions, by which units of one program are told apart, too."""
    for path, text in derivation(name).emit("fmu", fmi=version).items():
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")
    source = f"sources/{name}_fmi.c"
    for prefix in ([], [f"-DFMI{version}_FUNCTION_PREFIX=own_"]):
        words = [compiler(), "-std=c99", *WARNINGS, *prefix, "-c", source, "-o", "a.o"]
        run(*words, cwd=tmp_path)
    assert b"own_fmi" in (tmp_path / "a.o").read_bytes()


@pytest.mark.parametrize(
    ("name", "version", "within"),
    [
        ("double_pendulum", "2", 1e-9),
        ("double_pendulum", "3", 1e-9),
        ("four_bar_linkage", "3", 1e-9),
        ("driven_cart", "2", 1e-10),
        ("dc_motor_pendulum", "2", 1e-9),
        ("dc_motor_pendulum", "3", 1e-9),
    ],
)
def test_co_simulation_is_as_exact_as_stated(derivation, unit, name, version, within):
    reference = derivation(name).simulate(accuracy=1e-11, samples=51)
    assert worst_error(columns_of(unit(name, version), reference), reference) < within


def test_errors_follow_the_tolerance(derivation, unit):
    reference = derivation("four_bar_linkage").simulate(accuracy=1e-11, samples=51)
    path = unit("four_bar_linkage")
    errors = [
        worst_error(columns_of(path, reference, relative_tolerance=given), reference)
        for given in (1e-4, 1e-6, 1e-8)
    ]
    assert all(error < given for error, given in zip(errors, (1e-4, 1e-6, 1e-8), strict=True))
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


@pytest.mark.parametrize("version", VERSIONS)
def test_model_exchange_gives_the_equations_to_another_integrator(derivation, unit, version):
    """What is left of errors is that of CVode, whose steps may drift from closures."""
    bounds = {"double_pendulum": 1e-4, "four_bar_linkage": 2e-4, "dc_motor_pendulum": 1e-4}
    for name, within in bounds.items():
        reference = derivation(name).simulate(samples=51)
        found = columns_of(
            unit(name, version), reference, "ModelExchange", relative_tolerance=1e-10
        )
        assert worst_error(found, reference) < within


@pytest.mark.parametrize(
    ("name", "version"),
    [
        ("block_leaving_wedge", "2"),
        ("ladder_leaving_wall", "3"),
        ("particle_leaving_sphere", "2"),
        ("slack_rope", "3"),
    ],
)
def test_contacts_open_in_model_exchange(derivation, unit, name, version):
    """An importer's zero of a multiplier lies on either side of it: the contact opens all the same,
    and does not close again while its gap is rounding error."""
    reference = derivation(name).simulate(samples=51)
    assert reference.events[0].name.startswith("release")
    found = columns_of(unit(name, version), reference, "ModelExchange", relative_tolerance=1e-9)
    assert worst_error(found, reference) < 1e-6


def height(t: float, h: float = 1.0, g: float = 9.81, e: float = 0.8) -> float:
    """The height of a ball that was dropped, by its bounces; 0 behind the last of them."""
    fall = math.sqrt(2 * h / g)
    if t < fall:
        return h - g * t * t / 2
    t, speed = t - fall, e * g * fall
    while t >= 2 * speed / g:
        t, speed = t - 2 * speed / g, e * speed
        if speed < 1e-12:
            return 0.0
    return speed * t - g * t * t / 2


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize(("kind", "within"), [("CoSimulation", 1e-9), ("ModelExchange", 1e-7)])
def test_a_ball_bounces_and_comes_to_rest(unit, kind, within, version):
    """Infinitely many bounces end at 4.06 s."""
    found = fmpy.simulate_fmu(
        unit("bouncing_ball", version),
        fmi_type=kind,
        stop_time=5.0,
        output_interval=0.01,
        relative_tolerance=1e-9,
    )
    exact = np.array([height(t) for t in found["time"]])
    # In events the importer records both sides of a bounce.
    assert np.abs(found["z"] - exact).max() < within
    assert np.abs(found["x"] - 0.5 * found["time"]).max() < 1e-12
    assert np.abs(found["dot(z)"][found["time"] > 4.1]).max() < 1e-6


@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("name", ["driven_cart", "four_bar_linkage", "dc_motor_pendulum"])
def test_directional_derivatives_are_those_of_differences(unit, name, version):
    with instances(unit(name, version)) as (model,):
        model.start()
        model.unit.enterContinuousTimeMode()
        inputs = [n for n, v in model.variables.items() if v.causality == "input"]
        start, h = model.get(*model.states), 1e-6
        model.set(**dict.fromkeys(inputs, 0.0))
        for number, known in enumerate([*model.states, *inputs]):
            values = []
            for sign in (1, -1):
                y = start.copy()
                if known in inputs:
                    model.set(**{known: sign * h})
                else:
                    y[number] += sign * h
                model.set_states(y)
                values.append(model.get(*model.unknowns))
                model.set(**dict.fromkeys(inputs, 0.0))
            model.set_states(start)
            difference = (values[0] - values[1]) / (2 * h)
            assert model.slopes(model.unknowns, known) == pytest.approx(difference, abs=1e-7)


def pulls(one: Instance, two: Instance, c: float = 5.0) -> None:
    """Join two units by a spring."""
    pull = c * (two.get("x")[0] - one.get("x")[0])
    one.set(F=pull)
    two.set(F=-pull)


@pytest.mark.parametrize("versions", [("2", "3"), ("3", "3")])
def test_two_units_in_model_exchange_are_one_system(unit, versions):
    reference = loads(TWO).derive().simulate()
    paths = [unit(n, v) for n, v in zip(("ball_one", "ball_two"), versions, strict=True)]
    with instances(*paths) as pair:
        for model in pair:
            model.start()
            model.unit.enterContinuousTimeMode()

        def rates(t, y):
            for model, part in zip(pair, (y[:2], y[2:]), strict=True):
                model.set_states(part)
            pulls(*pair)
            return np.concatenate([m.get("der(x)", "der(dot(x))") for m in pair])

        start = np.concatenate([model.get("x", "dot(x)") for model in pair])
        run = solve_ivp(rates, (0, 2), start, "DOP853", reference.t, rtol=1e-10, atol=1e-12)
    for row, name in ((0, "x1"), (1, "dot(x1)"), (2, "x2"), (3, "dot(x2)")):
        assert run.y[row] == pytest.approx(reference.columns[name], abs=1e-8)


def test_two_units_in_co_simulation_approach_one_system(unit):
    """Forces are held for a communication step: errors are of the first order in it."""
    reference = loads(TWO).derive().simulate()
    errors = []
    for count in (200, 400, 800):
        with instances(unit("ball_one"), unit("ball_two", "3"), steps=True) as pair:
            for one in pair:
                one.start()
            h = 2.0 / count
            for number in range(count):
                pulls(*pair)
                for one in pair:
                    one.step(number * h, h)
            errors.append(abs(pair[0].get("x")[0] - reference.columns["x1"][-1]))
    assert errors[0] < 0.05
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.1)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.1)


@pytest.mark.parametrize("version", VERSIONS)
def test_inputs_are_set_or_computed(unit, version):
    """A constant of the scene is an input of the unit; a function of time is computed."""
    with instances(unit("driven_cart", version), steps=True) as (cart,):
        causality = {name: cart.variables[name].causality for name in ("F", "w", "tip", "M")}
        assert causality == {"F": "input", "w": "output", "tip": "output", "M": "parameter"}
        cart.start(M=2.0, theta=0.0)
        cart.set(F=1.0)
        for number in range(10):
            cart.step(0.1 * number, 0.1)
        assert cart.get("w")[0] == pytest.approx(0.1 * math.sin(3.0), rel=1e-14)
        assert cart.get("power")[0] == cart.get("dot(s)")[0]
    pushed = loads(CART.replace("F: 0,", "F: 1,"), parameters={"M": "2"}, initial={"theta": "0"})
    reference = pushed.derive().simulate(until=1.0, accuracy=1e-11)
    with instances(unit("driven_cart", version), steps=True) as (cart,):
        cart.start(M=2.0, theta=0.0, F=1.0)
        cart.step(0.0, 1.0)
        for name in ("s", "dot(theta)"):
            assert cart.get(name)[0] == pytest.approx(reference.columns[name][-1], abs=1e-10)
        assert cart.get("energy(kinetic)")[0] > 0


def test_a_recorded_input_is_an_input(unit):
    with instances(unit("seismometer"), steps=True) as (instrument,):
        recorded = [v for v in instrument.variables.values() if v.causality == "input"]
        assert [v.start for v in recorded] == ["0.0"]
        assert "csv" in recorded[0].description


@pytest.mark.parametrize("version", VERSIONS)
def test_a_saved_state_is_gone_on_from(unit, version):
    with instances(unit("bouncing_ball", version), steps=True) as (ball,):
        ball.start()
        ball.step(0.0, 0.7)
        states = ("getFMUstate", "setFMUstate", "freeFMUstate")
        if version == "3":
            states = tuple(name.replace("state", "State") for name in states)
        get, put, free = (getattr(ball.unit, name) for name in states)
        saved = get()
        ball.step(0.7, 1.0)
        first = ball.get("z", "dot(z)", "time")
        put(saved)
        assert ball.get("time")[0] == 0.7
        ball.step(0.7, 1.0)
        assert ball.get("z", "dot(z)", "time").tolist() == first.tolist()
        free(saved)


@pytest.mark.parametrize("version", VERSIONS)
def test_what_is_not_allowed_is_an_error(unit, version):
    failing = pytest.raises(Exception, match="ExitInitializationMode")
    with instances(unit("four_bar_linkage", version), steps=True) as (linkage,), failing:
        linkage.start(alpha=1.5, beta=0.1)
    with instances(unit("driven_cart", version), steps=True) as (cart,):
        cart.start()
        for name in ("M", "s", "w", "tip", "time"):
            with pytest.raises(Exception, match=r"Real|Float64"):
                cart.set(**{name: 1.0})


FRICTION = """
name: stick
parameters: {m: 1, k: 10, F: 2}
coordinates: [x]
kinetic: {block: m*dot(x)^2/2}
potentials: {spring: k*x^2/2}
forces: {friction: {on: x, force: -F*sign(dot(x))}}
initial: {x: 1, dot(x): 0}
simulate: {until: 5, accuracy: 1e-9}
"""


def test_dry_friction_at_rest_is_the_reason_of_steps_that_become_too_small(tmp_path, capfd):
    compiler()
    path = tmp_path / "stick.fmu"
    path.write_bytes(loads(FRICTION).derive().package("fmu").files["stick.fmu"])
    with pytest.raises(Exception, match="DoStep"):
        fmpy.simulate_fmu(str(path), fmi_type="CoSimulation", stop_time=5.0)
    assert "as those of dry friction where a body comes to rest" in capfd.readouterr().out


def test_texts_of_a_scene_stay_texts(derivation):
    for version in VERSIONS:
        texts = derivation("driven_cart").emit("fmu", fmi=version)
        root = ET.fromstring(texts["modelDescription.xml"])
        assert root.attrib["description"] == 'Cart & pole <"driven"> ]]> -- %s &amp;'
        described = {
            e.attrib["name"]: e.attrib.get("description")
            for e in root.iter()
            if "valueReference" in e.attrib and "name" in e.attrib
        }
        assert described["M"] == 'mass & "more" <b>'
        assert described["s"] == "position </Real> of the cart"
        page = texts["documentation/index.html"]
        assert "<b>" not in page
        assert "&lt;!-- \u0394 --&gt;" in page
        ET.fromstring(page.partition("\n")[2].replace('<meta charset="utf-8">', ""))


@pytest.mark.parametrize("name", ["fmi", "int", "math"])
def test_a_scene_of_any_name_makes_a_valid_unit(name, tmp_path):
    scene = ONE.format(name="one", mass=1.0, start=1).replace("name: ball_one", f"name: '{name}'")
    ((file, data),) = loads(scene).derive().package("fmu").files.items()
    assert file == f"{name}.fmu"
    (tmp_path / "a.fmu").write_bytes(data)
    assert validate_fmu(str(tmp_path / "a.fmu")) == []
    with instances(str(tmp_path / "a.fmu"), steps=True) as (ball,):
        ball.start().step(0.0, 1.0)
        # x'' = -k x/m
        exact = math.cos(3**0.5) + 0.5 / 3**0.5 * math.sin(3**0.5)
        assert ball.get("x")[0] == pytest.approx(exact, abs=1e-9)


def test_bytes_are_the_same_again(derivation):
    texts = derivation("driven_cart").emit("fmu")
    assert texts == loads(CART).derive().emit("fmu")
    one, two = (EMITTERS["fmu"].package("driven_cart", texts).files for _ in range(2))
    assert [hashlib.sha256(data).hexdigest() for data in one.values()] == [
        hashlib.sha256(data).hexdigest() for data in two.values()
    ]


def test_without_a_compiler_a_unit_has_its_sources(
    monkeypatch, tmp_path, without_packaged_compiler
):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    done = lagrange("emit", str(SCENES["pendulum"]), "--to", "fmu", "-o", str(tmp_path))
    assert done.returncode == 0
    assert "pendulum.fmu holds sources and no library: no C compiler was found" in done.stderr
    with zipfile.ZipFile(tmp_path / "pendulum.fmu") as archive:
        assert archive.namelist() == [
            "modelDescription.xml",
            "documentation/index.html",
            "sources/pendulum.c",
            "sources/pendulum.h",
            "sources/pendulum_fmi.c",
        ]


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    pendulum = str(SCENES["pendulum"])
    (tmp_path / "file").write_text("")
    for words in (("-o", str(tmp_path / "file")), ()):
        done = lagrange("emit", pendulum, "--to", "fmu", *words)
        assert done.returncode == 2
        assert "pendulum.fmu" not in done.stdout
    assert "name a folder" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("old", "new", "message", "hint"),
    [
        ("m: 1.0,", "m: {},", "it gives no value of 'm'", "add -p m=VALUE"),
        (
            "initial: {x: 1, dot(x): 0.5}",
            "",
            "it gives no initial state",
            "add values to 'initial'",
        ),
    ],
)
def test_what_has_no_start_is_refused(old, new, message, hint):
    scene = ONE.format(name="one", mass=1.0, start=1)
    assert old in scene
    with pytest.raises(InputError) as refused:
        loads(scene.replace(old, new)).derive().emit("fmu")
    (problem,) = refused.value.problems
    assert message in problem.message
    assert problem.hint == hint


def test_what_cannot_move_is_refused():
    with pytest.raises(InputError) as refused:
        loads(FIXED).derive().emit("fmu")
    assert "has no degrees of freedom" in refused.value.problems[0].message
