"""The benchmark bicycle: published eigenvalues, and Lagrange's equations by rotation matrices."""

from __future__ import annotations

import sys
from types import ModuleType, SimpleNamespace

import mpmath
import numpy as np
import pytest
import scipy.linalg
import sympy as sp
from numpy.typing import NDArray

from lagrange_cli import Derivation, load
from lagrange_cli.cache import open_cache
from lagrange_cli.program.operations import count_operations
from lagrange_cli.program.program import build_program
from tests.systems import textbook_bicycle
from tests.systems.shipped import APART

Array = NDArray[np.float64]

#: Half of 60 digits is left of a second difference with this step.
DIGITS, STEP = 60, mpmath.mpf(10) ** -15


@pytest.fixture(scope="module")
def derivation() -> Derivation:
    return load(APART["bicycle"]).derive(cache=open_cache())


@pytest.fixture(scope="module")
def module(derivation: Derivation) -> ModuleType:
    (text,) = derivation.emit("python", jacobian=True).values()
    module = ModuleType("emitted_bicycle")
    sys.modules[module.__name__] = module
    exec(compile(text, "emitted_bicycle", "exec"), vars(module))
    return module


def published(v: float) -> Array:
    """Eigenvalues of λ² M + λ v C1 + g K0 + v² K2."""
    m, c1, k0, k2 = (np.array(textbook_bicycle.MATRICES[name]) for name in ("M", "C1", "K0", "K2"))
    stiffness = 9.81 * k0 + v**2 * k2
    lower = [-np.linalg.solve(m, stiffness), -np.linalg.solve(m, v * c1)]
    return np.linalg.eigvals(np.block([[np.zeros((2, 2)), np.eye(2)], lower]))


@pytest.mark.slow
@pytest.mark.parametrize("v", range(11))
def test_published_eigenvalues(module: ModuleType, v: int) -> None:
    """Of the Jacobian at upright, straight motion, among states that the constraints allow."""
    names, p = list(module.COORDINATES), module.DEFAULTS._replace(v=float(v))
    n = len(names)
    y = np.zeros(2 * n)
    for name, rate in (("x", v), ("alpha", -v / p.rR), ("beta", -v / p.rF)):
        y[n + names.index(name)] = rate
    assert np.abs(module.constraints(0.0, y, p)).max() < 1e-12
    linear = module.jacobian(0.0, y, p)
    h = 1e-6
    slopes = [
        (module.constraints(0.0, y + h * e, p) - module.constraints(0.0, y - h * e, p)) / (2 * h)
        for e in np.eye(2 * n)
    ]
    allowed = scipy.linalg.null_space(np.array(slopes).T, rcond=1e-8)
    found = np.linalg.eigvals(allowed.T @ linear @ allowed)
    assert found.shape == (10,)
    for exact in published(float(v)):
        assert np.abs(found - exact).min() < 1e-11


def textbook_residual(derivation: Derivation, y: Array, a: Array) -> list[float]:
    """d/dt ∂L/∂q̇ − ∂L/∂q by differences in many digits; then of the constraints, their rates."""
    e = derivation.equations
    names = [c.name for c in e.system.coordinates]
    p, q, v = (
        SimpleNamespace(**{name: sp.Symbol(prefix + name) for name in listed})
        for prefix, listed in (
            ("p_", [x.name for x in e.system.parameters]),
            ("q_", names),
            ("v_", names),
        )
    )
    symbols = [*vars(q).values(), *vars(v).values(), *vars(p).values()]
    parts = [textbook_bicycle.lagrangian(p, q, v), *textbook_bicycle.rolling(p, q, v)]
    parts += textbook_bicycle.touch(p, q)
    evaluate = sp.lambdify(symbols, parts, modules="mpmath", cse=True)
    n = len(names)
    with mpmath.workdps(DIGITS):
        known = [mpmath.mpf(float(x.value or 0)) for x in e.system.parameters]
        here, rate = [mpmath.mpf(float(x)) for x in y], [mpmath.mpf(float(x)) for x in (*y[n:], *a)]

        def at(state: list[mpmath.mpf], *moves: tuple[int, int]) -> list[mpmath.mpf]:
            moved = list(state)
            for k, sign in moves:
                moved[k] += sign * STEP
            return list(evaluate(*moved, *known))

        def along(sign: int) -> list[mpmath.mpf]:
            return [x + sign * STEP * r for x, r in zip(here, rate, strict=True)]

        residuals = []
        for j in range(n):
            momenta = [
                (at(along(s), (n + j, 1))[0] - at(along(s), (n + j, -1))[0]) for s in (1, -1)
            ]
            slope = (at(here, (j, 1))[0] - at(here, (j, -1))[0]) / (2 * STEP)
            residuals.append(float((momenta[0] - momenta[1]) / (4 * STEP**2) - slope))
        ahead, behind = at(along(1)), at(along(-1))
        rates = [(x - z) / (2 * STEP) for x, z in zip(ahead[1:], behind[1:], strict=True)]
    return [*residuals, *map(float, rates)]


@pytest.mark.slow
def test_lagranges_equations_by_rotation_matrices(
    derivation: Derivation, module: ModuleType
) -> None:
    """Residuals are forces of the constraints: combinations of their gradients with λ."""
    n = len(module.COORDINATES)
    random = np.random.default_rng(2)
    y = np.array(module.INITIAL) + 0.2 * random.uniform(-1, 1, 2 * n)
    y = module.project(0.0, y, module.DEFAULTS)
    assert np.abs(module.constraints(0.0, y)).max() < 1e-12
    a, pushes = module.rhs(0.0, y)[n:], module.multipliers(0.0, y)
    found = textbook_residual(derivation, y, a)
    h = 1e-6
    gradients = np.array(
        [
            (module.constraints(0.0, y + h * e) - module.constraints(0.0, y - h * e)) / (2 * h)
            for e in np.eye(2 * n)[n:]
        ]
    ).T[-len(pushes) :]
    forces = np.array(found[:n])
    assert np.abs(forces - gradients.T @ pushes).max() < 1e-7 * np.abs(forces).max()
    assert np.abs(found[n:-1]).max() < 1e-9, "the rolling constraints stay"


def test_code_is_derived_on_the_graph(derivation: Derivation) -> None:
    """Collected equations would take 6067 operations."""
    program = build_program(derivation.equations, ("acceleration",))
    assert count_operations(program).total < 2500


@pytest.mark.slow
def test_a_ride(derivation: Derivation) -> None:
    """Between 4.3 and 6 m/s a bicycle rides upright by itself; energy is kept."""
    run = derivation.simulate(until=5.0, accuracy=1e-9)
    assert run.status == "ok"
    assert run.energy_drift is not None
    assert run.energy_drift < 1e-11
    assert np.abs(run.columns["phi"]).max() < 0.1
    assert abs(run.columns["phi"][-1]) < 0.01 < np.abs(run.columns["phi"]).max()
