"""Fixed steps in emitted C: loops with sampled controllers beside simulations, orders, refusals."""

from __future__ import annotations

import ctypes
import re
import subprocess
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from tests.simulate.test_sampled_control import BALL, OSCILLATOR

pytestmark = [pytest.mark.slow, pytest.mark.compiler]

SCENE = Path(__file__).parents[2] / "systems/actuators/sampled_cart_pole.yaml"
GAINS = np.array([-61.9933, 95.0597, -33.5040, 18.8300])


@pytest.fixture(scope="module")
def cart_pole():
    return load(str(SCENE)).derive()


class Steps:
    """Fixed steps of emitted C, called through ctypes."""

    def __init__(self, derivation, folder, real="double"):
        texts = derivation.emit("c", step=True, midpoint=True, real=real)
        for name, text in texts.items():
            (folder / name).write_text(text)
            self.header = text if name.endswith(".h") else getattr(self, "header", "")
        (source,) = (folder / name for name in texts if name.endswith(".c"))
        warnings = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror", "-O2"]
        library = folder / f"{source.stem}.so"
        command = ["gcc", *warnings, "-shared", "-fPIC", str(source), "-o", str(library), "-lm"]
        subprocess.run(command, check=True)
        self._code, self._name = ctypes.CDLL(str(library)), source.stem
        self.dtype = np.float64 if real == "double" else np.float32
        self._number = ctypes.c_double if real == "double" else ctypes.c_float
        self._p, self._work = np.zeros(64, self.dtype), np.zeros(256, self.dtype)
        getattr(self._code, f"{source.stem}_defaults")(self._at(self._p))

    @staticmethod
    def _at(array):
        return ctypes.c_void_p(array.ctypes.data)

    def __call__(self, function, t, y, u, h):
        step = getattr(self._code, f"{self._name}_{function}")
        u = np.atleast_1d(np.asarray(u, self.dtype))
        arguments = self._at(y), self._at(u), self._at(self._p), self._number(h)
        return step(self._number(t), *arguments, self._at(self._work))


@pytest.fixture(scope="module")
def steps(cart_pole, tmp_path_factory):
    return Steps(cart_pole, tmp_path_factory.mktemp("steps"))


def closed(steps, function, parts, until=4.0):
    """The loop of the regulator, with some steps to a sample; the states at samples."""
    y, rows, h = np.array([0, 0.2, 0, 0.0]), [], 0.01
    for number in range(round(until / h) + 1):
        rows.append(y.copy())
        force = -GAINS @ y
        for part in range(parts):
            assert steps(function, number * h + part * h / parts, y, force, h / parts) == 0
    return np.array(rows)


def relative(found, exact):
    return (np.abs(found - exact).max(axis=0) / np.abs(exact).max(axis=0)).max()


@pytest.fixture(scope="module")
def exact(cart_pole):
    motion = cart_pole.simulate(accuracy=1e-11, samples=401)
    return np.array([motion.columns[name] for name in ("x", "phi", "dot(x)", "dot(phi)")]).T


@pytest.mark.parametrize(("function", "order"), [("step", 4), ("midpoint", 2)])
def test_the_loop_in_c_is_that_of_simulate(steps, exact, function, order):
    errors = [relative(closed(steps, function, parts), exact) for parts in (1, 2)]
    assert abs(np.log2(errors[0] / errors[1]) - order) < 0.2
    # The header says the error at one step a sample.
    said = re.search(rf"_{function}: .*? was (\S+),", re.sub(r"\n \* +", " ", steps.header))
    assert f"{errors[0]:.0e}" == said[1]


def test_the_loop_in_python_is_that_of_simulate(cart_pole, exact):
    (text,) = cart_pole.emit("python").values()
    module: dict[str, object] = {"__name__": "emitted"}
    exec(compile(text, "emitted", "exec"), module)
    y, h = np.array([0, 0.2, 0, 0.0]), 0.01
    for number in range(100):
        force = -GAINS @ y
        run = solve_ivp(
            lambda t, y, force=force: module["rhs"](
                t, y, module["DEFAULTS"], lambda t, y, p: np.array([force])
            ),
            (number * h, (number + 1) * h),
            y,
            "DOP853",
            rtol=1e-12,
            atol=1e-14,
        )
        y = run.y[:, -1]
    assert np.abs(y - exact[100]).max() < 1e-10


def test_the_midpoint_rule_keeps_the_energy_of_an_oscillator(tmp_path):
    text = re.sub(r"(dissipation|controllers|forces|inputs): .*\n", "", OSCILLATOR)
    steps, y = Steps(loads(text).derive(), tmp_path), np.array([1.0, -0.5])
    energies = []
    for number in range(2000):
        energies.append(3 * y[0] ** 2 / 2 + y[1] ** 2)
        assert steps("midpoint", 0.3 * number, y, 0.0, 0.3) == 0
    assert np.ptp(energies) < 1e-11


def test_steps_in_single_precision(cart_pole, exact, tmp_path):
    steps = Steps(cart_pole, tmp_path, "float")
    y = np.array([0, 0.2, 0, 0], np.float32)
    for number in range(100):
        assert steps("midpoint" if number % 2 else "step", number / 100, y, -GAINS @ y, 0.01) == 0
    assert np.abs(y - exact[100]).max() < 2e-3


def test_a_step_that_does_not_settle_leaves_the_state(steps):
    y = np.array([0, 0.2, 0, 3.0])
    assert steps("midpoint", 0.0, y, 0.0, 0.5) == 3
    assert y.tolist() == [0, 0.2, 0, 3.0]
    assert steps("step", 0.0, y, np.inf, 0.01) == 2
    assert y.tolist() == [0, 0.2, 0, 3.0]


def test_steps_are_refused_where_contacts_close():
    with pytest.raises(InputError, match="contacts open and close within a step"):
        loads(BALL).derive().emit("c", step=True)


def test_a_header_says_why_nothing_was_measured():
    text = OSCILLATOR.replace("initial: {x: 1, dot(x): -0.5}\n", "").replace("k: 3,", "k: {},")
    header, _ = loads(text).derive().emit("c", step=True).values()
    assert "Its error was not measured" in re.sub(r"\n \* +", " ", header)


def test_a_header_names_inputs_that_were_not_held():
    text = OSCILLATOR.replace("forces: {", "forces: {push: {on: x, force: w}, ")
    for inputs, says in (("{F: 0, w: 0.1*sin(3*t)}", True), ("[F, w]", False)):
        scene = text.replace("inputs: [F]", f"inputs: {inputs}")
        header, _ = loads(scene).derive().emit("c", step=True).values()
        assert ("There w varied within steps" in re.sub(r"\n \* +", " ", header)) == says
