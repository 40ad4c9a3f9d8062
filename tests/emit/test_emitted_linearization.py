"""Emitted A, B, C, D and E at any state: against 60 digits, SymPy, the analysis, and in a loop."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import null_space, solve_continuous_are

from lagrange_cli import load, loads
from lagrange_cli.cache import open_cache
from lagrange_cli.errors import InputError
from tests.analysis.test_linearization import CART
from tests.emit.derivative_reference import AccelerationReference, relative
from tests.emit.emitted_c import WARNINGS, compiler, run
from tests.emit.test_jacobians import FEW, SCENES, SYSTEMS, TOLERANCE, Library, modes_of, state_near
from tests.emit.test_jacobians import module_of as module_of_text
from tests.systems.shipped import NARROW, sliced


def module_of(derivation):
    return module_of_text(derivation, linearization=True)


class Linearized(Library):
    """Emitted C with the linearization."""

    asked = "linearization"

    def matrices(self, t, y, u, shapes, mode=(), wanted="ABCDE"):
        arrays = [np.ascontiguousarray(a, float) for a in (y, u, self.defaults)]
        flags = [np.array(mode, ctypes.c_int)] if len(mode) else []
        work = np.full(self.macro("WORK"), np.nan)
        out = [np.full(rows * columns + 1, np.nan) for rows, columns in shapes]
        places = [
            a.ctypes.data if name in wanted else None for name, a in zip("ABCDE", out, strict=False)
        ]
        pointers = [ctypes.c_void_p(a.ctypes.data) for a in (*arrays, *flags, work)]
        call = getattr(self.library, f"{self.prefix}_linearization")
        assert call(ctypes.c_double(t), *pointers, *map(ctypes.c_void_p, places)) == 0
        assert all(np.isnan(a[-1]) for a in out), "nothing is written behind the results"
        return [a[:-1].reshape(shape) for a, shape in zip(out, shapes, strict=True)]


def output_slopes(equations, t, y, u):
    """C and D by SymPy's derivatives."""
    n = len(equations.system.coordinates)
    state = [
        *(c.q for c in equations.system.coordinates),
        *(c.v for c in equations.system.coordinates),
    ]
    driven = [source.symbol for source in equations.system.inputs]
    if not equations.system.outputs:
        return np.eye(n, 2 * n), np.zeros((n, len(driven)))
    at = dict(zip([equations.system.t, *state, *driven], [t, *y, *u], strict=True))
    at |= {p.symbol: p.value for p in equations.system.parameters}

    def slopes(by):
        rows = [[float(e.diff(s).subs(at)) for s in by] for _, e in equations.system.outputs]
        return np.array(rows).reshape(len(rows), len(by))

    return slopes(state), slopes(driven)


def differenced(function, y, step=1e-5):
    """Central differences, with the error of the fourth order."""
    columns = []
    for k in range(len(y)):
        move = np.zeros(len(y))
        move[k] = step * max(1.0, abs(y[k]))
        near = function(y + move) - function(y - move)
        far = function(y + 2 * move) - function(y - 2 * move)
        columns.append((8 * near - far) / (12 * move[k]))
    return np.array(columns).T


def check(scene, folder=None, **parameters):
    derivation = load(SYSTEMS / f"{scene}.yaml", parameters=parameters).derive()
    equations, module = derivation.equations, module_of(derivation)
    n, p, t = len(equations.system.coordinates), module.DEFAULTS, 0.3
    if not n:
        assert not hasattr(module, "linearization")
        return
    y = state_near(module)
    u = module.inputs(t, y, p) if equations.system.inputs else ()
    for mode in modes_of(equations):
        keywords = {"mode": mode} if mode else {}
        found = module.linearization(t, y, p, **keywords)
        try:
            by_state, by_inputs, _ = AccelerationReference(equations, mode).derivatives(t, y, u, p)
        except ZeroDivisionError:  # a contact that cannot be closed here
            assert np.isnan(found.A[n:]).all()
            continue
        assert_allclose(found.A[:n], np.eye(n, 2 * n, n), atol=0)
        assert relative(found.A[n:], by_state).max(initial=0.0) < TOLERANCE
        assert not found.B[:n].any()
        assert relative(found.B[n:], by_inputs).max(initial=0.0) < TOLERANCE
        assert_allclose(found.C, output_slopes(equations, t, y, u)[0], rtol=1e-9, atol=1e-9)
        assert_allclose(found.D, output_slopes(equations, t, y, u)[1], rtol=1e-9, atol=1e-9)
        assert hasattr(found, "E") == bool(equations.system.pushing)
        if equations.system.pushing:
            expected = differenced(lambda x: module.constraints(t, x, p, **keywords), y)  # noqa: B023
            size = np.abs(expected).max()
            assert_allclose(found.E, expected, atol=2e-8 * max(size, 1.0))
        if folder is not None:
            shapes = [matrix.shape for matrix in found]
            results = Linearized(equations, folder, derivation).matrices(t, y, u, shapes, mode)
            for name, matrix, result in zip("ABCDE", found, results, strict=False):
                scale = np.abs(matrix).max(initial=0.0)
                assert_allclose(result, matrix, atol=1e-9 * scale, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("scene", FEW)
def test_python(scene):
    check(scene)


@pytest.mark.slow
@pytest.mark.compiler
@pytest.mark.parametrize(
    ("scene", "parameters"),
    [
        ("oscillators/driven_spring", {}),
        ("rolling/snakeboard", {}),
        ("contact/ladder_leaving_wall", {}),
        ("chains/net_of_springs", {"n": 5}),  # sparse
    ],
)
def test_c(scene, parameters, tmp_path):
    compiler()
    check(scene, tmp_path, **parameters)


@pytest.mark.slow
@pytest.mark.compiler
@sliced(SCENES, NARROW, "scene")
def test_shipped_scenes(scene, tmp_path):
    compiler()
    check(scene, tmp_path)


@pytest.mark.compiler
def test_c_leaves_out_what_is_not_wanted(tmp_path):
    compiler()
    derivation = loads(CART).derive()
    library = Linearized(derivation.equations, tmp_path, derivation)
    shapes = [(4, 4), (4, 1), (3, 4), (3, 1)]
    y, u = np.array([0.1, 0.2, 0.3, 0.4]), np.array([0.5])
    whole = library.matrices(0.0, y, u, shapes)
    a, b, c, d = library.matrices(0.0, y, u, shapes, wanted="BD")
    assert np.isnan(a).all()
    assert np.isnan(c).all()
    assert_allclose(b, whole[1], rtol=0)
    assert_allclose(d, whole[3], rtol=0)


@pytest.mark.compiler
@pytest.mark.parametrize("real", ["float", "long-double"])
@pytest.mark.parametrize("scene", ["contact/ladder_leaving_wall", "oscillators/driven_spring"])
def test_other_types_compile_in_c_and_cpp(scene, real, tmp_path):
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    for name, text in derivation.emit("c", linearization=True, real=real).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    (source,) = tmp_path.glob("*.c")
    for words in (["-std=c99"], ["-x", "c++", "-std=c++11"]):
        run(compiler(), *words, *WARNINGS, "-Wdouble-promotion", "-fsyntax-only", source)


def test_many_states_at_once():
    module = module_of(loads(CART).derive())
    y = np.random.default_rng(2).uniform(-1, 1, (4, 40))
    many = module.linearization(0.0, y, u=lambda t, y, p: [np.full(40, 0.7)])
    assert many.A.shape == (4, 4, 40)
    for k in (0, 17, 39):
        one = module.linearization(0.0, y[:, k], u=lambda t, y, p: [0.7])
        for whole, single in zip(many, one, strict=True):
            assert_allclose(whole[..., k], single, rtol=1e-12, atol=1e-14)


def test_at_rest_it_is_the_state_space_of_the_analysis():
    derivation = loads(CART).derive()
    space = derivation.analyze("linearization", at={"theta": 0}).linearization.state_space
    found = module_of(derivation).linearization(0.0, np.zeros(4), u=lambda t, y, p: [0.0])
    for name in "ABCD":
        assert_allclose(getattr(found, name), getattr(space, name.lower()), atol=1e-13)


@pytest.mark.slow
def test_constraints_leave_the_poles_of_the_minimal_form():
    """With a basis of what E allows, A of a pendulum in Cartesian coordinates is a pendulum's."""
    loaded = load(SYSTEMS / "pendulums" / "double_pendulum.yaml")
    minimal = loaded.derive(formulation="minimal")
    expected = np.linalg.eigvals(module_of(minimal).linearization(0.0, np.zeros(4)).A)
    derivation = loaded.derive(formulation="multiplier")
    module = module_of(derivation)
    rest = minimal.simulate(until=1e-9, initial={"theta1": 0, "theta2": 0}).state
    names = [*module.COORDINATES]
    y = np.array([*(rest[name] for name in names), *(0.0 for _ in names)])
    found = module.linearization(0.0, y)
    allowed = null_space(found.E)
    assert allowed.shape[1] == 4
    drift = found.E @ found.A @ allowed
    assert np.abs(drift).max() < 1e-9, "constraints stay fulfilled"
    poles = np.linalg.eigvals(allowed.T @ found.A @ allowed)
    assert_allclose(np.sort(poles.imag), np.sort(expected.imag), atol=1e-6)
    assert_allclose(poles.real, 0, atol=1e-6)


@pytest.mark.slow
def test_regulator_from_emitted_matrices_holds_the_pendulum_up():
    """Gains of SciPy's Riccati equation for emitted A and B, put into the scene as a force."""
    module = module_of(loads(CART).derive())
    found = module.linearization(0.0, np.zeros(4), u=lambda t, y, p: [0.0])
    weights = np.diag([1.0, 10.0, 1.0, 1.0])
    (gains,) = (found.B.T @ solve_continuous_are(found.A, found.B, weights, np.eye(1))).tolist()
    states = [*module.COORDINATES, *(f"dot({name})" for name in module.COORDINATES)]
    law = " - ".join(f"({gain!r})*{name}" for gain, name in zip(gains, states, strict=True))
    held = CART.replace("inputs: [F]\n", "").replace("force: F", f"force: -{law}")
    held = held.replace("outputs: {place: p, tip: p + l*sin(theta), push: 2*F + dot(p)}\n", "")
    motion = loads(held).derive().simulate(until=15.0, accuracy=1e-6, initial={"theta": 0.3})
    assert motion.status == "ok"
    assert np.abs(motion.columns["theta"]).max() < 0.5
    assert abs(motion.state["theta"]) < 1e-4
    assert abs(motion.state["p"]) < 1e-2


def test_style_that_differentiates_by_itself_is_refused():
    with pytest.raises(InputError, match=r"--with linearization is for --style numpy"):
        loads(CART).derive().emit("python", style="jax", linearization=True)


def poles_beside(scene):
    """Poles of the analysis, and of emitted A on what E allows, at the equilibrium at the start."""
    derivation = load(SYSTEMS / f"{scene}.yaml").derive()
    found = derivation.analyze("linearization").linearization
    poles = poles_at(module_of(derivation), found.at.position)
    assert len(poles) == len(found.state_space.a)
    return np.sort_complex(np.linalg.eigvals(found.state_space.a)), poles


def poles_at(module, position):
    """Poles of emitted A on what E allows, at rest."""
    y = np.array([*map(float, position), *(0.0 for _ in module.COORDINATES)])
    emitted = module.linearization(0.0, y)
    allowed = null_space(emitted.E)
    return np.sort_complex(np.linalg.eigvals(allowed.T @ emitted.A @ allowed))


@pytest.mark.slow
def test_poles_of_a_rolling_board():
    expected, poles = poles_beside("rolling/snakeboard")
    assert_allclose(np.sort(poles.imag), np.sort(expected.imag), atol=1e-5)


@pytest.mark.campaign
@pytest.mark.slow
def test_poles_of_a_bicycle_at_rest():
    """J. P. Meijaard, J. M. Papadopoulos, A. Ruina, A. L. Schwab, Proc. R. Soc. A 463 (2007) 1955,
    table 1, at v = 0."""
    derivation = load(SYSTEMS / "rolling" / "bicycle.yaml").derive(cache=open_cache())
    poles = poles_at(module_of(derivation), derivation.equations.system.initial.positions)
    assert len(poles) == 10  # seven positions and three velocities are free
    published = [-5.53094371765393, -3.13164324790656, 3.13164324790656, 5.53094371765393]
    fast = np.sort(poles.real[np.abs(poles) > 1])
    assert_allclose(fast, published, rtol=1e-9)
