"""Inputs from scene to trajectory: derivation, facts, emitted code, both ways to simulate."""

from __future__ import annotations

import ctypes
import math
import types

import numpy as np
import pytest

from lagrange_cli import loads
from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.cache import open_cache
from lagrange_cli.errors import InputError
from lagrange_cli.report.contents.derivation.contents import derivation_text
from lagrange_cli.report.values.derivation import derivation_report
from lagrange_cli.report.writers.latex.document import latex_document
from lagrange_cli.simulate import simulate
from lagrange_cli.simulate.model.build import model_of
from lagrange_cli.simulate.system.functions import interpreted
from lagrange_cli.toolchain.compiler import find_compiler
from lagrange_cli.toolchain.shared_library import CSource, load_libraries
from tests.simulate.compiling import compiled_or_skip

#: A cart on a spring whose other end and which itself are driven.
CART = """
name: cart
parameters: {m: 1.0, k: 4.0, A: 2.0, w: 3.0, c: 5.0}
inputs: {u: A*sin(w*t), f: c*t}
particles:
  cart: {mass: m, position: [x, y, z]}
constraints: {rail: [y = 0, z = 0]}
coordinates: [x]
potentials: {spring: k*(x - u)^2/2}
forces: {push: {on: x, force: f}}
outputs: {pull: k*(u - x), drive: f}
initial: {x: 1.0}
simulate: {until: 2, samples: 21, accuracy: 1e-9}
"""

#: The same without inputs.
WRITTEN_OUT = CART.replace(
    "inputs: {u: A*sin(w*t), f: c*t}", "definitions: {u: A*sin(w*t), f: c*t}"
)

#: A pendulum in x and z, driven sideways.
KEPT = """
name: kept
parameters: {l: 2.0}
inputs: {u: cos(3*t)}
plane: xz
particles:
  bob: {mass: 1, position: [x, y, z]}
constraints: {rod: x^2 + z^2 = l^2}
potentials: {weight: {gravity: 9.81}}
forces: {wind: {on: bob, force: [u, 0, 0]}}
initial: {x: 2, z: 0}
simulate: {until: 2, samples: 11, accuracy: 1e-9}
"""


@pytest.fixture(scope="module")
def cart():
    return loads(CART).derive().equations


def cart_by_hand(t):
    """x'' + 4 x = 8 sin 3t + 5 t from x = 1 at rest."""
    # -8/5 sin 3t + 5/4 t is a solution; what starts at 1 and at rest is added.
    return np.cos(2 * t) + (24 / 5 - 5 / 4) / 2 * np.sin(2 * t) - 8 / 5 * np.sin(3 * t) + 5 / 4 * t


def assert_cart(run):
    x = cart_by_hand(run.t)
    assert np.abs(run.columns["x"] - x).max() < 1e-8
    assert np.abs(run.columns["pull"] - 4 * (2 * np.sin(3 * run.t) - x)).max() < 1e-7
    assert run.columns["drive"] == pytest.approx(5 * run.t, abs=1e-14)
    assert run.energy_drift is None


def test_compiled(cart):
    model = model_of(cart)
    assert_cart(simulate(model, functions=compiled_or_skip(model)))


def test_interpreted(cart):
    model = model_of(cart)
    assert_cart(simulate(model, functions=interpreted(model, "a test")))


def test_the_same_written_out_gives_the_same_code(cart):
    other = model_of(loads(WRITTEN_OUT).derive().equations)
    assert model_of(cart).code == other.code


def test_facts(cart):
    assert not cart.derivation.facts.autonomous
    assert cart.derivation.conserved == ()
    assert cart.derivation.facts.unused_parameters == ()
    assert cart.derivation.certificate.mismatch < 1e-25


@pytest.mark.parametrize("where", ["potentials: {spring: k*x^2/2 - x*u}", "kinetic: {odd: x*u}"])
def test_energy_is_not_conserved_where_the_lagrangian_is_driven(where):
    text = CART.replace("potentials: {spring: k*(x - u)^2/2}", where)
    text = text.replace("forces: {push: {on: x, force: f}}\n", "")
    equations = loads(text.replace("pull: k*(u - x), ", "")).derive().equations
    assert equations.derivation.conserved == ()
    assert not equations.derivation.facts.autonomous


def test_an_input_that_nothing_holds_changes_nothing():
    text = CART.replace("(x - u)", "x").replace("forces: {push: {on: x, force: f}}\n", "")
    equations = loads(text).derive().equations
    assert equations.derivation.facts.autonomous
    assert [c.name for c in equations.derivation.conserved] == ["energy"]


def test_momenta_of_cyclic_coordinates_stay_conserved():
    text = (
        CART.replace("[y = 0, z = 0]", "[z = 0]")
        .replace("[x]\n", "[x, y]\n")
        .replace("x: 1.0", "x: 1.0, y: 0")
    )
    equations = loads(text).derive().equations
    assert [c.name for c in equations.derivation.conserved] == ["p_y"]


def test_beside_velocities_they_are_refused():
    text = CART.replace("k*(x - u)^2/2", "x*dot(x)*u")
    with pytest.raises(InputError, match="stands beside velocities") as refused:
        loads(text).derive()
    mark = refused.value.problems[0].mark
    assert mark is not None
    assert (mark.line, mark.column) == (4, 10)


def test_a_value_that_leaves_no_real_force_is_refused():
    text = CART.replace("force: f", "force: 1/f").replace("f: c*t", "f: 0")
    equations = loads(text).derive().equations
    with pytest.raises(InputError, match="no finite real number"):
        simulate(equations)


def test_reports(cart):
    report = derivation_report(cart)
    assert report["inputs"] == [
        {"name": "u", "expression": "A*sin(w*t)"},
        {"name": "f", "expression": "c*t"},
    ]
    assert report["equations"][0]["residual"] == "m*ddot(x) + k*(x - u) - f"
    assert "Inputs\n  u = A*sin(w*t)\n  f = c*t\n" in derivation_text(cart, ascii=True)
    assert r"\section*{Inputs}" in latex_document(cart)


def emitted(equations):
    (source,) = EMITTERS["python"].emit(equations, {}).values()
    module = types.ModuleType("emitted")
    exec(compile(source, "emitted", "exec"), module.__dict__)
    return module


def test_emitted_python(cart):
    module = emitted(cart)
    assert module.INPUTS == ("u", "f")
    assert module.inputs(0.5, np.array([1.0, 0.0])) == pytest.approx([2 * math.sin(1.5), 2.5])
    assert module.rhs(0.5, np.array([1.0, 3.0]))[1] == pytest.approx(
        4 * (2 * math.sin(1.5) - 1) + 2.5
    )
    own = module.rhs(0.5, np.array([1.0, 3.0]), u=lambda t, y, p: (t, -y[1]))
    assert own == pytest.approx([3.0, 4 * (0.5 - 1) - 3.0])
    assert np.isnan(module.rhs(0.0, np.array([1.0, 0.0]), u=lambda t, y, p: (math.nan, 0))[1])


class Library:
    """The functions of emitted C, called with inputs."""

    def __init__(self, equations, size):
        files = EMITTERS["c"].emit(equations, {"real": "double", "main": True})
        header = files[f"{equations.presentation.name}.h"]
        text = files[f"{equations.presentation.name}.c"].replace(
            f'#include "{equations.presentation.name}.h"', header
        )
        (self.library,) = load_libraries(
            find_compiler(), [CSource({"system.c": text})], open_cache()
        )
        self.name, self.size = equations.presentation.name, size
        self.p = np.zeros(max(1, len(equations.system.parameters)))
        self.library[f"{self.name}_defaults"](ctypes.c_void_p(self.p.ctypes.data))

    def __call__(self, function, t, y, u, size):
        work, out = np.zeros(1000), np.zeros(size)
        arrays = [np.array(y, dtype=float), np.array(u, dtype=float), self.p, work, out]
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in arrays]
        assert self.library[f"{self.name}_{function}"](ctypes.c_double(t), *pointers) == 0
        return out


def test_emitted_c(cart):
    library = Library(cart, 2)
    assert library("inputs", 0.5, [1, 0], [0, 0], 2) == pytest.approx([2 * math.sin(1.5), 2.5])
    assert library("rhs", 0.5, [1, 3], [7, -2], 2) == pytest.approx([3, 4 * (7 - 1) - 2])
    assert library("energy", 0.5, [1, 3], [7, -2], 3)[1] == pytest.approx(2 * 36)
    assert library("outputs", 0.5, [1, 3], [7, -2], 2) == pytest.approx([24, -2])


@pytest.mark.slow
def test_with_closures():
    equations = loads(KEPT).derive().equations
    model = model_of(equations)
    run = simulate(model, functions=compiled_or_skip(model))
    other = simulate(model, functions=interpreted(model, "a test"))
    angle = "x: l*sin(a), z: -l*cos(a)"
    text = KEPT.replace("potentials", f"coordinates: [a]\ndefinitions: {{{angle}}}\npotentials")
    text = text.replace("initial: {x: 2, z: 0}", "initial: {a: pi/2}")
    minimal = simulate(loads(text).derive().equations)
    for name in ("x", "z", "dot(x)"):
        assert np.abs(run.columns[name] - minimal.columns[name]).max() < 1e-7
        assert np.abs(run.columns[name] - other.columns[name]).max() < 1e-7
    # The rod's force along itself: -T for the tension T, and x'' by Newton's law.
    state = np.array([2 * math.sin(0.4), -2 * math.cos(0.4), 0.0, 0.0])
    expected = -(9.81 * math.cos(0.4) + 6 * math.sin(0.4)) / 4
    assert emitted(equations).multipliers(0.0, state, u=lambda *_: [6.0]) == pytest.approx(
        [expected], rel=1e-14
    )
    assert Library(equations, 4)("multipliers", 0.0, state, [6.0], 1) == pytest.approx([expected])


@pytest.mark.slow
def test_a_family_of_inputs_in_loops():
    """Masses on springs, each with its own input: code of many statements."""
    n = 40
    text = f"""
name: row
sizes: {{n: {n}}}
parameters: {{k: 100.0}}
inputs: {{"u[i=1..n]": sin(i*t)}}
particles:
  "b[i=1..n]": {{mass: i, position: ["x[i]", "0", "0"]}}
coordinates: ["x[i=1..n]"]
potentials: {{"wall[i=1..n]": "k*(x[i] - u[i])^2/2*(1 + x[i]^2)"}}
initial: {{"x[i=1..n]": 0}}
"""
    equations = loads(text).derive().equations
    y, u = np.linspace(-1, 1, 2 * n), np.linspace(2, 3, n)
    x, i = y[:n], np.arange(1, n + 1)
    force = -100 * ((x - u) * (1 + x**2) + (x - u) ** 2 * x)
    found = Library(equations, 2 * n)("rhs", 0.0, y, u, 2 * n)
    assert found[n:] == pytest.approx(force / i, rel=1e-13)
    assert emitted(equations).rhs(0.0, y, u=lambda *_: u)[n:] == pytest.approx(force / i, rel=1e-13)
