"""Emitted canonical equations: against Lagrange's right-hand side at random states, and C."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from lagrange_cli import load, loads
from lagrange_cli.errors import InputError
from tests.cli.terminal import lagrange
from tests.emit.emitted_c import WARNINGS, compiler, run
from tests.emit.test_jacobians import SCENES, Library, state_near
from tests.emit.test_jacobians import module_of as module_with
from tests.systems.shipped import NARROW, SYSTEMS, sliced

#: Of one and of two coupled coordinates; solved by elimination and by a loop; with velocities in V;
#: no square of the velocities; with friction and inputs; of a moving frame.
FEW = [
    "pendulums/pendulum",
    "pendulums/double_pendulum",
    "pendulums/triple_pendulum",
    "chains/pendulum_chain",
    "fields/penning_trap",
    "fields/relativistic_particle",
    "oscillators/driven_spring",
    "pendulums/damped_driven_pendulum",
    "lecture/pendulum_driven_support",
    "rigid/heavy_top",
]

TOLERANCE = 1e-12


def module_of(derivation):
    return module_with(derivation, canonical=True)


def expected_rates(equations, t, y, u, a):
    """dp/dt by the chain rule of SymPy's ∂L/∂q̇, and H, with the sizes of their terms."""
    n = len(equations.system.coordinates)
    coordinates = equations.system.coordinates
    at = {equations.system.t: t, **{p.symbol: p.value for p in equations.system.parameters}}
    at |= {c.q: x for c, x in zip(coordinates, y, strict=False)}
    at |= {c.v: x for c, x in zip(coordinates, y[n:], strict=True)}
    at |= {source.symbol: x for source, x in zip(equations.system.inputs, u, strict=True)}
    at = {symbol: sp.Float(float(value), 40) for symbol, value in at.items()}

    def value(expression):
        return float(expression.subs(at).evalf(30))

    momenta, rates, sizes = [], [], []
    for c in coordinates:
        p = sp.diff(equations.system.lagrangian, c.v)
        momenta.append(value(p))
        parts = [value(sp.diff(p, equations.system.t))]
        for other, v, b in zip(coordinates, y[n:], a, strict=True):
            parts += [value(sp.diff(p, other.q)) * v, value(sp.diff(p, other.v)) * b]
        rates.append(sum(parts))
        sizes.append(sum(map(abs, parts)))
    lagrangian = value(equations.system.lagrangian)
    work = [p * v for p, v in zip(momenta, y[n:], strict=True)]
    return np.array(momenta), np.array(rates), np.array(sizes), sum(work) - lagrangian


def check(scene, seeds=(3, 4, 5)):
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    equations = derivation.equations
    if equations.system.pushing:
        with pytest.raises(InputError, match="no constraint is kept"):
            derivation.emit("python", canonical=True)
        return
    module = module_of(derivation)
    n, t = len(equations.system.coordinates), 0.3
    if not n:
        assert not hasattr(module, "canonical")
        return
    for seed in seeds:
        y = state_near(module, seed)
        u = module.inputs(t, y) if equations.system.inputs else ()
        a = module.rhs(t, y)[n:]
        momenta, rates, sizes, energy = expected_rates(equations, t, y, u, a)
        z = module.to_canonical(t, y)
        scale = np.abs(momenta).max() or 1.0
        assert_allclose(z, [*y[:n], *momenta], rtol=TOLERANCE, atol=TOLERANCE * scale)
        assert_allclose(module.from_canonical(t, z), y, rtol=1e-10, atol=1e-10 * np.abs(y).max())
        found = module.canonical(t, z)
        assert_allclose(found[:n], y[n:], rtol=1e-10, atol=1e-10 * np.abs(y).max())
        # Velocities are differences of momenta and what these are at rest.
        rest = module.to_canonical(t, np.array([*y[:n], *np.zeros(n)]))[n:]
        lost = max(1.0, np.abs(momenta).max() / (np.abs(momenta - rest).max() or 1.0))
        error = np.abs(found[n:] - rates)
        assert (error <= TOLERANCE * lost * sizes.max() + 1e-300).all(), error / sizes.max()
        size = abs(energy) + np.abs(momenta * y[n:]).sum()
        assert abs(module.hamiltonian(t, z) - energy) <= 1e-10 * size


@pytest.mark.slow
@pytest.mark.parametrize("scene", FEW)
def test_python(scene):
    check(scene)


@pytest.mark.slow
@sliced(sorted(set(SCENES) - set(FEW)), NARROW, "scene")
def test_shipped_scenes(scene):
    check(scene, (3,))


def test_gradient_of_h():
    """∂H/∂p and −∂H/∂q by differences of the emitted H alone."""
    module = module_of(load(SYSTEMS / "pendulums/double_pendulum.yaml").derive())
    z = np.array([0.3, -0.7, 1.1, 0.4])
    slopes = []
    for k in range(4):
        h = np.zeros(4)
        h[k] = 1e-3
        near, far = (
            module.hamiltonian(0.0, z + s * h) - module.hamiltonian(0.0, z - s * h) for s in (1, 2)
        )
        slopes.append((8 * near - far) / (12 * 1e-3))
    assert_allclose(module.canonical(0.0, z), [*slopes[2:], -slopes[0], -slopes[1]], rtol=1e-9)


def test_many_states_and_names():
    module = module_of(load(SYSTEMS / "pendulums/double_pendulum.yaml").derive())
    assert module.MOMENTA == ("p_theta1", "p_theta2")
    z = np.random.default_rng(1).uniform(-1, 1, (4, 50))
    many, energies = module.canonical(0.0, z), module.hamiltonian(0.0, z)
    assert many.shape == (4, 50)
    for k in (0, 23):
        assert_allclose(many[:, k], module.canonical(0.0, z[:, k]), rtol=1e-12)
        assert energies[k] == pytest.approx(module.hamiltonian(0.0, z[:, k]), rel=1e-13)


class Canonical(Library):
    """Emitted C with canonical equations."""

    asked = "canonical"

    def call(self, function, t, state, u, count):
        arrays = [np.ascontiguousarray(a, float) for a in (state, u, self.defaults)]
        work, out = np.full(self.macro("WORK") + 1, np.nan), np.full(count + 1, np.nan)
        work[-1] = 7.0
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, work, out)]
        assert (
            getattr(self.library, f"{self.prefix}_{function}")(ctypes.c_double(t), *pointers) == 0
        )
        assert np.isnan(out[-1]), "nothing is written behind the results"
        assert work[-1] == 7.0, "nothing is written behind the workspace"
        return out[:-1]


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    "scene", ["chains/pendulum_chain", "oscillators/driven_spring", "fields/relativistic_particle"]
)
def test_c_gives_what_python_gives(scene, tmp_path):
    compiler()
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    module, equations = module_of(derivation), derivation.equations
    library = Canonical(equations, tmp_path, derivation)
    y, t = state_near(module), 0.3
    u = module.inputs(t, y) if equations.system.inputs else np.zeros(0)
    z = library.call("to_canonical", t, y, u, len(y))
    assert_allclose(z, module.to_canonical(t, y), rtol=1e-13, atol=1e-14)
    assert_allclose(library.call("from_canonical", t, z, u, len(y)), y, rtol=1e-10, atol=1e-12)
    rates = library.call("canonical", t, z, u, len(y))
    assert_allclose(rates, module.canonical(t, z), rtol=1e-10, atol=1e-11)
    (energy,) = library.call("hamiltonian", t, z, u, 1)
    assert energy == pytest.approx(module.hamiltonian(t, z), rel=1e-12)


@pytest.mark.compiler
@pytest.mark.parametrize("real", ["float", "long-double"])
def test_other_types_compile_in_c_and_cpp(real, tmp_path):
    derivation = load(SYSTEMS / "chains/pendulum_chain.yaml").derive()
    for name, text in derivation.emit("c", canonical=True, real=real).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (source,) = tmp_path.glob("*.c")
    for words in (["-std=c99"], ["-x", "c++", "-std=c++11"]):
        run(compiler(), *words, *WARNINGS, "-Wdouble-promotion", "-fsyntax-only", source)


def test_a_scene_with_a_letter_p():
    text = """
name: s
parameters: {p_x: 2}
coordinates: [x]
kinetic: {T: p_x*dot(x)^2/2}
potentials: {V: x^2}
initial: {x: 0.5, dot(x): 1}
"""
    module = module_of(loads(text).derive())
    assert module.MOMENTA == ("P_x",)
    assert_allclose(module.to_canonical(0.0, np.array([0.5, 1.0])), [0.5, 2.0])


def test_refusals():
    scene = str(SYSTEMS / "constraints/four_bar_linkage.yaml")
    done = lagrange("emit", scene, "--to", "python", "--with", "canonical")
    assert done.returncode == 2
    assert "four_bar_linkage.yaml:1:1: canonical equations are emitted where" in done.stderr
    pendulum = load(SYSTEMS / "pendulums/pendulum.yaml").derive()
    with pytest.raises(InputError, match="--with canonical is for --style numpy"):
        pendulum.emit("python", style="jax", canonical=True)
