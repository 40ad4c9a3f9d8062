"""Emitted modules for JAX and CasADi against those for NumPy, values and derivatives."""

from __future__ import annotations

from types import ModuleType
from typing import Any

import numpy as np
import pytest

from lagrange_cli.api.emitters import EMITTERS
from lagrange_cli.errors import InputError
from tests.emit import emit_systems as systems
from tests.emit.test_arrays import example
from tests.emit.test_python import load
from tests.program import test_bandwidth as bands
from tests.systems.shipped import NARROW, SCENES, derived, sliced

STYLES = ["jax", "casadi"]

#: Written out, dense, with closures, with a nonholonomic constraint, with inputs.
FEW = ["double_pendulum", "heavy_top", "net_of_springs", "four_bar_linkage", "chaplygin_sleigh"]
FEW += ["driven_spring"]

#: Functions that both have; inputs are those of the scene.
FUNCTIONS = ["rhs", "mass_matrix", "forcing", "energy", "positions", "velocities", "inputs"]
FUNCTIONS += ["outputs", "multipliers", "constraints"]


def module(equations, style="numpy", **options):
    ((_, source),) = EMITTERS["python"].emit(equations, {"style": style, **options}).items()
    return load(source)


class OfJax:
    """Functions and the Jacobian of the right-hand side, compiled as one."""

    def __init__(self, functions: dict[str, Any]) -> None:
        self.functions = functions
        self.jax: Any = pytest.importorskip("jax")
        self.jax.config.update("jax_enable_x64", True)
        # What is compiled here runs once.
        self.jax.config.update("jax_disable_most_optimizations", True)

    def results(self, names, t, y, p):
        """Values of functions at a state; ``jacobian`` is that of the right-hand side."""
        called = {name: self.functions[name] for name in names if name != "jacobian"}
        if "jacobian" in names:
            called["jacobian"] = self.jax.jacfwd(self.functions["rhs"], 1)
        together = self.jax.jit(lambda *state: {name: f(*state) for name, f in called.items()})
        return together(t, y, self.functions["Parameters"](*p))


class OfCasadi:
    """The same as functions of CasADi."""

    def __init__(self, functions: dict[str, Any]) -> None:
        self.functions = functions
        self.casadi: Any = pytest.importorskip("casadi")

    def given(self, name, t, y, p):
        driven = name != "inputs" and "INPUTS" in self.functions
        return [t, y, list(p), *([self.value("inputs", t, y, p)] if driven else [])]

    def results(self, names, t, y, p):
        return {name: self.value(name, t, y, p) for name in names}

    def value(self, name, t, y, p):
        if name == "jacobian":
            return self.jacobian(t, y, p)
        function = self.functions["function"](self.functions[name])
        return np.array(function(*self.given(name, t, y, p)))

    def jacobian(self, t, y, p):
        rhs = self.functions["function"](self.functions["rhs"])
        symbols = [self.casadi.SX.sym(rhs.name_in(k), *rhs.size_in(k)) for k in range(rhs.n_in())]
        columns = self.casadi.jacobian(rhs(*symbols), symbols[1])
        return np.array(self.casadi.Function("J", symbols, [columns])(*self.given("rhs", t, y, p)))


#: What runs the modules of a style.
RUNS = {"jax": OfJax, "casadi": OfCasadi}


def require(style: str) -> ModuleType:
    package: ModuleType = pytest.importorskip(style)
    return package


def compare(equations, style):
    require(style)
    reference, run = module(equations, jacobian=True), RUNS[style](module(equations, style))
    n = len(reference["COORDINATES"])
    random = np.random.default_rng(3)
    start = np.full(2 * n, 0.3) if reference["INITIAL"] is None else reference["INITIAL"]
    t, y, p = 0.3, start + 0.03 * random.standard_normal(2 * n), reference["DEFAULTS"]
    names = [name for name in FUNCTIONS if name in reference]
    assert names == [name for name in FUNCTIONS if name in run.functions]
    results = run.results([*names, "jacobian"], t, y, p)
    for name in names:
        expected = np.asarray(reference[name](t, y, p))
        got = np.asarray(results[name]).reshape(expected.shape)
        assert np.abs(got - expected).max(initial=0) <= 1e-10 * np.abs(expected).max(initial=1e-3)
    expected = reference["jacobian"](t, y, p)
    got = np.asarray(results["jacobian"])
    assert np.abs(got - expected).max() <= 1e-8 * np.abs(expected).max()


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("name", FEW)
def test_values_and_derivatives(name, style):
    compare(derived(name), style)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@sliced((name for name in SCENES if name not in FEW), NARROW)
def test_every_scene(name, style):
    """A scene that a style cannot hold is refused."""
    equations = derived(name)
    if equations.system.contacts or name in ("seismometer", "hanging_net"):
        with pytest.raises(InputError, match=f"style '{style}' does not suit this scene"):
            module(equations, style)
    else:
        compare(equations, style)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    "make", [lambda: systems.pendulum_chain(6), systems.indefinite], ids=["definite", "indefinite"]
)
def test_systems_that_are_solved_by_elimination(make, style):
    compare(make(), style)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
def test_bands(style, monkeypatch):
    monkeypatch.setattr(bands.programs_of, "is_large_system", lambda _: False)
    compare(bands.chain(10), style)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    ("make", "massless"),
    [(lambda: derived("double_pendulum"), "m2"), (lambda: systems.pendulum_chain(6), "m6")],
    ids=["unrolled", "dense"],
)
def test_a_singular_mass_matrix_gives_nan(make, massless, style):
    require(style)
    run = RUNS[style](module(make(), style))
    p, y = run.functions["DEFAULTS"], np.array([0.1, 0.4, 0.2, 0.9, 0.3, 0.7, *[0.0] * 6])
    y = y if massless == "m6" else y[[0, 1, 6, 7]]
    assert np.isfinite(run.results(["rhs"], 0.0, y, p)["rhs"]).all()
    light = p._replace(**{massless: 0.0})
    assert np.isnan(np.asarray(run.results(["rhs"], 0.0, y, light)["rhs"])).any()


@pytest.mark.slow
def test_jax_maps_states_and_differentiates_energies():
    jax: Any = pytest.importorskip("jax")
    jax.config.update("jax_enable_x64", True)
    equations = derived("four_bar_linkage")
    functions, reference = module(equations, "jax"), module(equations)
    random = np.random.default_rng(5)
    start = reference["INITIAL"]
    y = start[:, None] + 0.02 * random.standard_normal((len(start), 20))
    p = functions["DEFAULTS"]
    got = jax.jit(jax.vmap(functions["rhs"], (None, 1, None), 1))(0.0, y, p)
    expected = reference["rhs"](0.0, y)
    assert np.abs(got - expected).max() < 1e-10 * np.abs(expected).max()
    # Along a velocity, the derivative of the energy is twice its kinetic part.
    n = len(y) // 2
    slope = jax.grad(functions["energy"], 1)(0.0, y[:, 0], p)[n:]
    inertia = reference["mass_matrix"](0.0, y[:, 0])
    assert np.allclose(slope, inertia @ y[n:, 0], rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("bouncing_ball", "contacts open and close"),
        ("seismometer", "inputs from a file"),
        ("hanging_net", "is loops"),
    ],
)
def test_what_a_style_cannot_say_is_refused(name, reason, style):
    with pytest.raises(InputError, match=rf"style '{style}' does not suit this scene: .*{reason}"):
        module(derived(name), style)
    with pytest.raises(InputError, match=f"{style} differentiates by itself"):
        module(derived("double_pendulum"), style, jacobian=True)


@pytest.mark.parametrize("style", STYLES)
def test_inputs_are_values_or_a_function(style):
    """A cart with a spring that is driven, by values of the input and by a function of them."""
    library = require(style)
    driven, plain = (module(derived("driven_spring"), s) for s in (style, "numpy"))
    y, p = [0.3, 0.2], driven["DEFAULTS"]
    expected = plain["rhs"](0.5, np.array(y), p, lambda t, y, p: [0.7])
    if style == "jax":
        y, u = library.numpy.array(y), library.numpy.array([0.7])
        slopes = library.jacfwd(driven["rhs"], 3)(0.5, y, p, u)
    else:
        u = library.SX.sym("u")
        slopes = library.evalf(library.jacobian(driven["rhs"](0.5, library.SX(y), p, u), u))
        y, u = library.SX(y), library.SX(0.7)
    for given in (u, lambda t, y, p: u):
        found = driven["rhs"](0.5, y, p, given)
        found = found if style == "jax" else library.evalf(found)
        assert np.allclose(np.ravel(found), expected, rtol=1e-6)
    exact = module(derived("driven_spring"), "numpy", jacobian=True)["jacobian_u"]
    slope = exact(0.5, np.array([0.3, 0.2]), p, lambda t, y, p: [0.7])
    assert np.allclose(np.array(slopes), slope, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("style", STYLES)
def test_the_examples_of_the_documentation(style, monkeypatch):
    require(style)
    shown = example(style, monkeypatch)
    double = module(derived("double_pendulum"), jacobian=True)
    expected = double["rhs"](0.0, double["INITIAL"])
    assert np.allclose(np.array(shown["rates"])[:, 0].ravel(), expected, rtol=1e-12)
    if style == "jax":
        assert np.allclose(shown["slopes"], double["jacobian"](0.0, double["INITIAL"]), rtol=1e-9)
